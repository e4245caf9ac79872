#pragma once

#include <chrono>
#include <functional>

#include "core/mesh/topology.h"
#include "core/numerics/progress.h"
#include "server/convert/mesh.h"
#include "server/errors/errors.h"
#include "server/rpc/call.h"
#include "shaped/v1/curves.pb.h"

namespace shaped::server {

/// What a call of Curves writes: progress, ten times a second at most, frames and a summary.
template <class Response>
class CurveStream {
 public:
  using Write = std::function<void(Response&&)>;

  CurveStream(const Write& write, const Topology& topology) : write_(write), topology_(topology) {}

  /// For the solvers: writes what they tell. From one thread at a time.
  ProgressSink progress() {
    return [this](const Progress& progress) {
      constexpr std::chrono::milliseconds often(100);
      const auto now = std::chrono::steady_clock::now();
      if (now - last_ < often) return;
      last_ = now;
      Response response;
      auto& message = *response.mutable_progress();
      message.set_stage(progress.stage);
      message.set_fraction(progress.fraction);
      message.set_residual(progress.residual);
      write_(std::move(response));
    };
  }
  void frame(std::int64_t index, const Vertices& shape) {
    Response response;
    auto& message = *response.mutable_frame();
    message.set_index(static_cast<std::uint32_t>(index));
    toProto(shape, topology_, *message.mutable_shape());
    write_(std::move(response));
  }
  void frames(const std::vector<Vertices>& shapes) {
    for (std::size_t i = 0; i < shapes.size(); ++i) frame(static_cast<std::int64_t>(i), shapes[i]);
  }
  /// fill(summary) sets what the summary says.
  template <class Fill>
  void summary(const Fill& fill) {
    Response response;
    fill(*response.mutable_summary());
    write_(std::move(response));
  }

 private:
  const Write& write_;
  const Topology& topology_;
  std::chrono::steady_clock::time_point last_;
};

/// Counts the outcome. Throws Stopped when the solver was cancelled.
inline void countCurve(const Outcome& outcome, Call& call) {
  if (outcome.termination == Termination::kCancelled) throw Stopped();
  call.solved(outcome);
}

}  // namespace shaped::server
