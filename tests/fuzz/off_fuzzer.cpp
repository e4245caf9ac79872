#include "tests/fuzz/fuzz.h"
#include "tests/fuzz/mesh_round_trip.h"

FUZZ_TARGET(off) { shaped::fuzz::readAndRewriteMesh(bytes, ".off"); }
