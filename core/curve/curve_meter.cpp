#include "core/curve/curve_meter.h"

namespace shaped {

void CurveMeter::add(const Vertices& frame) {
  ShellMeasures measures;
  measure(*topology_, frame, measures);
  if (!gradient_norms_.empty()) path_energy_ += kBothDirections * energy_.value(*topology_, last_measures_, measures);
  if (gradient_norms_.size() > 1)
    gradient_norms_.back() =
        curveGradient(*topology_, energy_, last_, before_last_measures_, last_measures_, measures).norm();
  gradient_norms_.push_back(0);
  before_last_measures_ = std::move(last_measures_);
  last_measures_ = std::move(measures);
  last_ = frame;
}

}  // namespace shaped
