#include "core/model/shell_pga_shapes.h"

#include "core/model/marker_fitter.h"
#include "core/model/marker_fitter_checkpoint.h"
#include "core/model/shell_pga_file.h"
#include "core/model/shell_pga_tasks.h"
#include "core/numerics/error.h"

namespace shaped {
namespace {

const SubmanifoldPoint& submanifoldPoint(const ModelPoint& point) {
  if (const auto* wanted = std::get_if<SubmanifoldPoint>(&point)) return *wanted;
  throw InvalidInput("coefficients", std::string("are those of a body, and the model is of kind ") + kShellPgaKind +
                                         ": want alpha and scale");
}

class ShellPgaTakeFitter final : public TakeFitter {
 public:
  ShellPgaTakeFitter(ShellPgaModelPtr model, const MarkerSet& markers, const MarkerTrackerOptions& options)
      : fitter_(std::move(model), markers, options) {}

  Outcome calibrate(const std::vector<MarkerPositions>& frames) override { return fitter_.calibrate(frames); }

  Solved<TakeFrame> fit(const MarkerPositions& markers) override {
    auto solved = fitter_.fit(markers);
    auto& [shape, fit, ratio] = solved.solution;
    return {{std::move(shape), std::move(fit.point), std::move(fit.residuals), fit.rms, fit.scale, fit.held, ratio},
            solved};
  }

  Keep state() const override {
    return [state = fitter_.state()](const std::filesystem::path& path, std::int64_t frames) {
      writeFitterCheckpoint(path, {frames, state});
    };
  }

  std::int64_t resume(const std::filesystem::path& path) override {
    auto checkpoint = readFitterCheckpoint(path);
    fitter_.resume(std::move(checkpoint.state));
    return checkpoint.frames;
  }

 private:
  MarkerFitter fitter_;
};

}  // namespace

std::string ShellPgaShapes::kind() const { return kShellPgaKind; }

void ShellPgaShapes::warm() const { shaped::warm(*model_); }

Solved<ShapeProjection> ShellPgaShapes::project(const Vertices& shape, const ProjectionOptions& options) const {
  auto solved = shaped::project(*model_, shape, options);
  auto& found = solved.solution;
  return {{std::move(found.shape), std::move(found.coefficients), std::move(found.tangent_coordinates),
           found.residual_energy, found.score, found.smallest_area_ratio},
          solved};
}

Solved<SynthesizedShape> ShellPgaShapes::synthesize(const ModelPoint& point, const SynthesisOptions& options) const {
  return shaped::synthesize(*model_, submanifoldPoint(point), options);
}

std::unique_ptr<TakeFitter> ShellPgaShapes::takeFitter(const MarkerSet& markers, const TakeOptions& options) const {
  MarkerTrackerOptions tracking;
  tracking.prior_weight = options.prior_weight;
  tracking.robust_scale = options.robust_scale;
  tracking.scale = options.scale;
  tracking.submanifold.modes = options.modes;
  tracking.submanifold.stop = options.stop;
  return std::make_unique<ShellPgaTakeFitter>(model_, markers, tracking);
}

std::int64_t ShellPgaShapes::publish(const ModelDirectory& directory, const std::string& name,
                                     const nlohmann::json& provenance) const {
  return publishShellPga(directory, name, *model_, provenance);
}

}  // namespace shaped
