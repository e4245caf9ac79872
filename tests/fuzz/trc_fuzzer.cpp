#include "tests/fuzz/fuzz.h"
#include "tests/fuzz/marker_round_trip.h"

FUZZ_TARGET(trc) { shaped::fuzz::readAndRewriteMarkers(bytes, ".trc", ".trc"); }
