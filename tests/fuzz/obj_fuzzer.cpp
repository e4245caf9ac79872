#include "tests/fuzz/fuzz.h"
#include "tests/fuzz/mesh_round_trip.h"

FUZZ_TARGET(obj) { shaped::fuzz::readAndRewriteMesh(bytes, ".obj"); }
