#include "tests/fuzz/fuzz.h"
#include "tests/fuzz/marker_round_trip.h"

FUZZ_TARGET(marker_csv) { shaped::fuzz::readAndRewriteMarkers(bytes, ".csv", ".csv"); }
