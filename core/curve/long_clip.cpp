#include "core/curve/long_clip.h"

#include <algorithm>
#include <cmath>

#include "core/curve/curve_meter.h"
#include "core/mesh/quality.h"
#include "core/numerics/error.h"

namespace shaped {
namespace {

constexpr double kDeviations = 4;  ///< of the flow's kernel, beyond which nothing can be seen

/// Which part of the clip one window sees, and answers for.
struct Window {
  std::int64_t begin, end;  ///< that it sees
  std::int64_t from, to;    ///< that it answers for; the last ones blended with the next window
};

std::vector<Window> windowsOf(std::int64_t frames, const LongClipOptions& options) {
  const auto size = options.window, blend = options.blend,
             reach = flowReach(options.smoothing.steps, options.smoothing.flow.tau);
  if (frames <= size || options.closed) return {{0, frames, 0, frames}};
  const std::int64_t own = std::max<std::int64_t>(size - 2 * reach - blend, blend + 1);
  std::vector<Window> windows;
  for (std::int64_t from = 0; from < frames; from += own) {
    const bool last = from + own + blend >= frames;
    const std::int64_t to = last ? frames : from + own + blend;
    windows.push_back({std::max<std::int64_t>(from - reach, 0), std::min(to + reach, frames), from, to});
    if (last) break;
  }
  return windows;
}

template <class Value>
std::vector<Value> part(const std::vector<Value>& values, const Window& window) {
  if (values.empty()) return {};
  return {values.begin() + window.begin, values.begin() + window.end};
}

/// Hands the windows' frames on in order.
class LongClip {
 public:
  LongClip(const ShellStructurePtr& structure, double bending, const FrameSource& source,
           const LongClipOptions& options, bool whole, const FrameSink& sink)
      : structure_(structure),
        bending_(bending),
        source_(source),
        options_(options),
        whole_(whole),
        sink_(sink),
        before_(structure->topologyPtr(), bending),
        after_(structure->topologyPtr(), bending) {}

  Outcome smooth(const Window& window, LongClipReport& report, const ProgressSink& progress) {
    Curve curve{{}, options_.closed};
    for (auto i = window.begin; i < window.end; ++i) {
      curve.frames.push_back(source_.frame(i));
      requireValidShape(structure_->topology(), curve.frames.back(), "frames[" + std::to_string(i) + "]");
    }
    auto options = options_.smoothing;
    options.flow.restore = part(options.flow.restore, window);
    options.flow.held = part(options.flow.held, window);
    const auto result = smoothed(structure_, bending_, curve, options, progress);
    if (result.termination == Termination::kCancelled) return result;
    const auto& smooth = result.solution;
    report.steps = report.windows == 0 ? static_cast<int>(smooth.steps.size())
                                       : std::min(report.steps, static_cast<int>(smooth.steps.size()));
    report.dimension = smooth.dimension;
    report.stationary = report.stationary && smooth.stationary;
    ++report.windows;
    if (whole_) tellOf(smooth, report);
    handOn(window, curve, smooth.curve);
    return result;
  }

  void measureWhole(LongClipReport& report) const {
    report.smallest_area_ratio = smallest_area_ratio_;
    if (whole_) return;  // its window has measured it
    report.path_energy_before = before_.pathEnergy();
    report.path_energy_after = after_.pathEnergy();
    report.gradient_before = before_.gradientNorms();
    report.gradient_after = after_.gradientNorms();
  }

 private:
  static void tellOf(const Smoothed& smooth, LongClipReport& report) {
    report.path_energy_before = smooth.path_energy_before;
    report.path_energy_after = smooth.path_energy_after;
    report.gradient_before = smooth.gradient_before;
    report.gradient_after = smooth.gradient_after;
    report.step_energies.push_back(smooth.flow_energy_before);
    for (const auto& step : smooth.steps) report.step_energies.push_back(step.path_energy);
  }

  void handOn(const Window& window, const Curve& original, const Curve& smooth) {
    const auto blend = static_cast<std::int64_t>(pending_.size());
    const bool last = window.to == source_.frames;
    const auto keep = last ? window.to : window.to - options_.blend;
    for (auto i = window.from; i < keep; ++i) {
      const auto k = static_cast<std::size_t>(i - window.begin);
      const auto b = i - window.from;
      if (b >= blend) {
        deliver(i, original.frames[k], smooth.frames[k]);
        continue;
      }
      const double share = static_cast<double>(b + 1) / static_cast<double>(blend + 1);
      const Vertices& other = pending_[static_cast<std::size_t>(b)];
      deliver(i, original.frames[k], (1 - share) * other + share * smooth.frames[k]);
    }
    pending_.clear();
    for (auto i = keep; i < window.to; ++i)
      pending_.push_back(smooth.frames[static_cast<std::size_t>(i - window.begin)]);
  }

  void deliver(std::int64_t index, const Vertices& original, const Vertices& frame) {
    if (!whole_) {
      before_.add(original);
      after_.add(frame);
    }
    const auto& faces = structure_->topology().faces();
    smallest_area_ratio_ = std::min(smallest_area_ratio_, smallestAreaRatio(faces, original, frame));
    sink_(index, frame);
  }

  const ShellStructurePtr& structure_;
  double bending_;
  const FrameSource& source_;
  const LongClipOptions& options_;
  bool whole_;  ///< one window sees the clip
  const FrameSink& sink_;
  std::vector<Vertices> pending_;  ///< the last window's answers that the next one's are blended with
  CurveMeter before_, after_;
  double smallest_area_ratio_ = 1;
};

}  // namespace

std::int64_t flowReach(int steps, double tau) {
  return std::min<std::int64_t>(steps, static_cast<std::int64_t>(std::ceil(kDeviations * std::sqrt(steps * tau))));
}

std::optional<std::string> LongClipOptions::firstViolation(std::int64_t frames) const {
  if (window < 8) return "window = " + std::to_string(window) + ", want >= 8";
  if (blend < 1) return "blend = " + std::to_string(blend) + ", want >= 1";
  return smoothing.firstViolation(static_cast<std::size_t>(frames));
}

Solved<LongClipReport> smoothLongClip(const ShellStructurePtr& structure, double bending, const FrameSource& source,
                                      const LongClipOptions& options, const FrameSink& sink,
                                      const ProgressSink& progress) {
  if (const auto violation = options.firstViolation(source.frames)) throw InvalidInput("options", *violation);
  const auto windows = windowsOf(source.frames, options);
  Solved<LongClipReport> result;
  LongClip clip(structure, bending, source, options, windows.size() == 1, sink);
  for (std::size_t k = 0; k < windows.size(); ++k) {
    const auto within = [&](const Progress& step) {
      progress(
          {"frames " + std::to_string(windows[k].from + 1) + " to " + std::to_string(windows[k].to) + ", " + step.stage,
           (static_cast<double>(k) + step.fraction) / static_cast<double>(windows.size()), step.residual});
    };
    result += clip.smooth(windows[k], result.solution, progress ? ProgressSink(within) : ProgressSink());
    if (result.termination == Termination::kCancelled) break;
  }
  clip.measureWhole(result.solution);
  return result;
}

}  // namespace shaped
