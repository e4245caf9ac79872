#include "tests/fuzz/fuzz.h"
#include "tests/fuzz/mesh_round_trip.h"

FUZZ_TARGET(ply) { shaped::fuzz::readAndRewriteMesh(bytes, ".ply"); }
