#include "tests/fuzz/fuzz.h"
#include "tests/fuzz/marker_round_trip.h"

FUZZ_TARGET(c3d) { shaped::fuzz::readAndRewriteMarkers(bytes, ".c3d", ".csv"); }
