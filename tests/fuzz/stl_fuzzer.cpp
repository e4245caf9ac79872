#include "tests/fuzz/fuzz.h"
#include "tests/fuzz/mesh_round_trip.h"

FUZZ_TARGET(stl) { shaped::fuzz::readAndRewriteMesh(bytes, ".stl"); }
