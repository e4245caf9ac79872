#pragma once

#include <string>

namespace shaped::experiments {

/// One section of RESULTS.md on standard output: a title and a table of what was measured against what is asked for.
/// Lines appear as soon as they are known.
class Report {
 public:
  explicit Report(const std::string& title);

  /// A line with a target; `met` says whether the number reaches it.
  void entry(const std::string& quantity, const std::string& measured, const std::string& target, bool met);
  /// A line that is only told.
  void entry(const std::string& quantity, const std::string& measured);
};

/// printf into a string.
[[gnu::format(printf, 1, 2)]] std::string text(const char* format, ...);

/// The rows of the measured table; each prints its section. Throw MissingData where the real data is not there.
void row0Oracles();
void row2Geodesics();
void row3GeodesicTime();
void row4PathSteps();
void row5Training();
void row6Projection();
void row7Generalisation();
void row8RealTrial();
void row9VirtualTrials();
void row10HandleEdits();
void row11RigidMotions();
/// Row "curves".
void curves();
/// Row "motions".
void motions();
/// Row "denoising".
void denoising();
/// Row "bodies".
void bodyModels();
/// Row "registration".
void registration();
/// Row "bliss"; only where LibTorch is there to train fields.
void bliss();
/// Row "faces"; likewise.
void blissFaces();
/// Row "clothing".
void clothing();
/// Row "robustness".
void robustness();
/// Row "stop".
void stopLatency();

}  // namespace shaped::experiments
