#pragma once

#include "core/model/shape_model.h"
#include "core/model/shell_pga_model.h"

namespace shaped {

/// A Shell PGA model as a served one. Its points are SubmanifoldPoints.
class ShellPgaShapes final : public ShapeModel {
 public:
  explicit ShellPgaShapes(ShellPgaModelPtr model) : model_(std::move(model)) {}
  const ShellPgaModelPtr& model() const { return model_; }

  std::string kind() const override;
  const TopologyPtr& topologyPtr() const override { return model_->topologyPtr(); }
  const Vertices& mean() const override { return model_->mean(); }
  int modes() const override { return model_->modes(); }
  std::size_t bytes() const override { return model_->bytes(); }
  void warm() const override;
  Solved<ShapeProjection> project(const Vertices& shape, const ProjectionOptions& options) const override;
  Solved<SynthesizedShape> synthesize(const ModelPoint& point, const SynthesisOptions& options) const override;
  std::unique_ptr<TakeFitter> takeFitter(const MarkerSet& markers, const TakeOptions& options) const override;
  std::int64_t publish(const ModelDirectory& directory, const std::string& name,
                       const nlohmann::json& provenance) const override;

 private:
  ShellPgaModelPtr model_;
};

}  // namespace shaped
