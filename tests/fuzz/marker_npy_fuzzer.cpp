#include "tests/fuzz/fuzz.h"
#include "tests/fuzz/marker_round_trip.h"

FUZZ_TARGET(marker_npy) { shaped::fuzz::readAndRewriteMarkers(bytes, ".npy", ""); }
