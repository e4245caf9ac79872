#include "client/load/arrivals.h"

#include <cmath>
#include <string>

#include "core/numerics/error.h"

namespace shaped::client {
namespace {

double checked(double rate) {
  constexpr double most = 1e6;
  if (!(rate > 0 && rate <= most))
    throw InvalidInput("rate", "= " + std::to_string(rate) + ", want more than 0 and at most 1000000 a second");
  return rate;
}

}  // namespace

Arrivals::Arrivals(Kind kind, double rate, std::uint64_t seed)
    : kind_(kind), rate_(checked(rate)), random_(seed), gap_(rate_) {}

std::chrono::nanoseconds Arrivals::next() {
  // Equal gaps are multiplied, not added: no drift in a run of hours.
  time_ = kind_ == Kind::kFixed ? static_cast<double>(count_) / rate_ : time_ + gap_(random_);
  ++count_;
  return std::chrono::nanoseconds(std::llround(1e9 * time_));
}

}  // namespace shaped::client
