// The measured table on the real data: shaped_experiments ROW..., for example "shaped_experiments 0 2 3". Each row
// prints a section of RESULTS.md. Environment: SHAPED_DATA, the folder of the real data; SHAPED_ORACLES, the folder of
// shell_energy.json (default: SHAPED_DATA/oracles); SHAPED_SCANS, how many scans the rows of registration take
// (default: all 40), SHAPED_EACH, which tells each of them; SHAPED_ROUNDS, SHAPED_UNREGISTERED, SHAPED_SAMPLE,
// SHAPED_ACCEPTANCE, SHAPED_SHARED, SHAPED_EPOCHS and SHAPED_BASELINES (0: no template fitting) of rows bliss and
// faces; SHAPED_CLOTHED, the only sequence of row clothing (walk or run; default: both), and CLOTHING_MESHES, the
// folder its bodies are written to; SHAPED_EXPERIMENTS_CACHE, where trained models are kept (default:
// ~/.cache/shaped-experiments). Exit code 77 when the data is not there, 2 for a row that does not exist.

#include <cstdio>
#include <functional>
#include <map>
#include <string>

#include "core/numerics/threads.h"
#include "server/daemon/best_kernels.h"
#include "tests/benchmark/experiments/data.h"
#include "tests/benchmark/experiments/experiment.h"

using namespace shaped::experiments;

int main(int argc, char** argv) {
  const std::map<std::string, std::function<void()>> rows = {
#ifdef SHAPED_HAS_TRAINING
      {"bliss", bliss},           {"faces", blissFaces},
#endif
      {"0", row0Oracles},         {"2", row2Geodesics},     {"3", row3GeodesicTime},   {"4", row4PathSteps},
      {"5", row5Training},        {"6", row6Projection},    {"7", row7Generalisation}, {"8", row8RealTrial},
      {"9", row9VirtualTrials},   {"10", row10HandleEdits}, {"11", row11RigidMotions}, {"curves", curves},
      {"motions", motions},       {"denoising", denoising}, {"bodies", bodyModels},    {"registration", registration},
      {"robustness", robustness}, {"clothing", clothing},   {"stop", stopLatency}};
  std::string names;
  for (const auto& [name, row] : rows) names += " " + name;
  shaped::server::useBestBlasKernels();
  shaped::limitLibraryThreads();
  if (argc < 2) {
    std::fprintf(stderr, "usage: shaped_experiments ROW...   rows:%s\n", names.c_str());
    return 2;
  }
  for (int i = 1; i < argc; ++i) {
    const auto row = rows.find(argv[i]);
    if (row == rows.end()) {
      std::fprintf(stderr, "there is no row '%s'; rows:%s\n", argv[i], names.c_str());
      return 2;
    }
    try {
      row->second();
    } catch (const MissingData& missing) {
      std::fprintf(stderr, "row %s skipped: %s\n", argv[i], missing.what());
      return 77;
    } catch (const std::exception& error) {
      std::fprintf(stderr, "row %s failed: %s\n", argv[i], error.what());
      return 1;
    }
  }
  return 0;
}
