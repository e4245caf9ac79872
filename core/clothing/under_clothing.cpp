#include "core/clothing/under_clothing.h"

#include <algorithm>
#include <cmath>
#include <deque>

#include "core/clothing/clothed_sequence.h"
#include "core/clothing/first_fits.h"
#include "core/numerics/error.h"
#include "core/numerics/option_checks.h"
#include "core/registration/scan_checks.h"

namespace shaped {
namespace {

void requireLandmarks(const std::vector<Landmark>& landmarks, std::size_t frame, const Topology& topology) {
  for (std::size_t i = 0; i < landmarks.size(); ++i) {
    const std::string where = "landmarks[" + std::to_string(frame) + "][" + std::to_string(i) + "]";
    const auto face = landmarks[i].anchor.face;
    if (face < 0 || face >= topology.faces().rows())
      throw InvalidInput(where, "is on face " + std::to_string(face) + ", and the model has " +
                                    std::to_string(topology.faces().rows()));
    if (!landmarks[i].position.allFinite() || !(landmarks[i].weight >= 0)) throw InvalidInput(where, "is not finite");
  }
}

void requireInput(std::span<const Scan> scans, std::span<const std::vector<Landmark>> landmarks,
                  const Topology& topology) {
  if (scans.empty()) throw InvalidInput("scans", "is empty, want at least one frame");
  if (!landmarks.empty() && landmarks.size() != scans.size())
    throw InvalidInput("landmarks", "has " + std::to_string(landmarks.size()) +
                                        " lists, want none or one for each of " + std::to_string(scans.size()) +
                                        " frames");
  for (std::size_t f = 0; f < scans.size(); ++f) requireUsableScan(scans[f], "scans[" + std::to_string(f) + "]");
  for (std::size_t f = 0; f < landmarks.size(); ++f) requireLandmarks(landmarks[f], f, topology);
}

/// Tells how far the sequence is.
void tell(const ClothingOptions& options, const std::string& stage, double fraction) {
  if (options.progress) options.progress({stage, fraction, 0});
}

/// Who is in the scans and how they stand, pass by pass.
class Estimation {
 public:
  Estimation(const std::deque<ScanSurface>& scans, const BodyModel& model,
             std::span<const std::vector<Landmark>> landmarks, const ClothingOptions& options)
      : model_(model), options_(options), sequence_(scans, model, landmarks, options), outcomes_(scans.size()) {}

  Solved<ClothedBody> run(const std::vector<FirstFit>& fits, std::size_t best) {
    state_.identity = Eigen::VectorXd::Zero(model_.modeCount());
    state_.identity.head(fits[best].state.identity.size()) = fits[best].state.identity;
    for (const auto& fit : fits) state_.poses.push_back(fit.state.pose);
    for (std::size_t f = 0; f < fits.size(); ++f)
      if (fits[f].score >= options_.good_share * fits[best].score) trusted_.push_back(f);
    Solved<ClothedBody> result;
    settlePostures(termsOf(0), {});
    for (int pass = 0; pass < options_.passes; ++pass) {
      const Eigen::VectorXd tightness = sequence_.tightness(state_, trusted_);
      static_cast<Outcome&>(result) = sequence_.settleIdentity(state_, trusted_, termsOf(pass), tightness);
      ClothingTerms postures = termsOf(pass);
      postures.loss_scale = options_.posture_loss_scale;
      const bool second = pass == std::min(1, options_.passes - 1), last = pass == options_.passes - 1;
      if (second) reseat(postures, tightness);
      settlePostures(postures, tightness);
      if (second || last) seatExtremities();
      if (options_.stop.stop_requested()) result.termination = Termination::kCancelled;
      if (result.termination == Termination::kCancelled) return result;  // measuring would take long
      if (pass > 0)
        tell(options_, "pass " + std::to_string(pass + 1), 0.7 + 0.3 * double(pass + 1) / double(options_.passes));
    }
    result.solution.identity = state_.identity;
    result.solution.frames = measured();
    return result;
  }

 private:
  ClothingTerms termsOf(int pass) const {
    const double share = options_.passes > 1 ? double(pass) / double(options_.passes - 1) : 1;
    const auto between = [&](double first, double last) {
      return first > 0 && last > 0 ? first * std::pow(last / first, share) : first + share * (last - first);
    };
    const auto &first = options_.first, &last = options_.last;
    return {
        {between(first.landmarks, last.landmarks), between(first.data, last.data), between(first.cloth, last.cloth)},
        between(options_.first_loss_scale, options_.last_loss_scale)};
  }

  void settlePostures(const ClothingTerms& terms, const Eigen::VectorXd& tightness) {
    for (std::size_t f = 0; f < sequence_.size() && !options_.stop.stop_requested(); ++f)
      outcomes_[f] = sequence_.settlePosture(state_, f, terms, tightness);
  }

  /// Limbs in other ways, and as they stand in frames nearby; then who is trusted is decided anew.
  void reseat(const ClothingTerms& terms, const Eigen::VectorXd& tightness) {
    for (std::size_t f = 0; f < sequence_.size() && !options_.stop.stop_requested(); ++f) {
      tell(options_, "limbs of frame " + std::to_string(f + 1), 0.6 + 0.1 * double(f) / double(sequence_.size()));
      sequence_.reseatLimbs(state_, f, posesOf(state_, nearest(f)), terms, tightness);
      const bool missed = std::find(trusted_.begin(), trusted_.end(), f) == trusted_.end();
      if (missed) sequence_.searchLimbs(state_, f, terms, tightness);
    }
    if (options_.stop.stop_requested()) return;
    const auto frames = measured();
    trusted_.clear();
    for (std::size_t f = 0; f < frames.size(); ++f)
      if (frames[f].trusted) trusted_.push_back(f);
  }

  /// Hands and feet by themselves: closest points of the whole body leave them on the wrong sheet.
  void seatExtremities() {
    for (std::size_t f = 0; f < sequence_.size() && !options_.stop.stop_requested(); ++f)
      sequence_.seatExtremities(state_, f, nearest(f));
  }

  /// The trusted frames nearest in time.
  std::vector<std::size_t> nearest(std::size_t frame) const {
    std::vector<std::size_t> frames = trusted_;
    std::erase(frames, frame);
    const auto away = [&](std::size_t f) { return f > frame ? f - frame : frame - f; };
    std::stable_sort(frames.begin(), frames.end(), [&](std::size_t a, std::size_t b) { return away(a) < away(b); });
    frames.resize(std::min(frames.size(), std::size_t(options_.retries)));
    return frames;
  }

  std::vector<ClothedFrame> measured() const {
    std::vector<ClothedFrame> frames;
    double most = 0;
    for (std::size_t f = 0; f < sequence_.size(); ++f) {
      frames.push_back(sequence_.measured(state_, f, outcomes_[f]));
      most = std::max(most, frames.back().explained);
    }
    for (auto& frame : frames) frame.trusted = frame.explained >= options_.explained_share * most;
    return frames;
  }

  const BodyModel& model_;
  const ClothingOptions& options_;
  ClothedSequence sequence_;
  BodySequence state_;
  std::vector<std::size_t> trusted_;  ///< frames that speak of the identity: a missed limb must not
  std::vector<Outcome> outcomes_;
};

}  // namespace

ScanRegistrationOptions clothedRegistration() {
  ScanRegistrationOptions options;
  options.fit.pose_deviation = 1;
  options.fit.levels.erase(options.fit.levels.begin());  // limbs are searched for, and cloth has no finest level
  options.fit.levels.pop_back();
  return options;
}

std::optional<std::string> ClothingOptions::firstViolation() const {
  if (fitted_alone < 1) return "fitted_alone = " + std::to_string(fitted_alone) + ", want >= 1";
  if (retries < 1) return "retries = " + std::to_string(retries) + ", want >= 1";
  if (points < 50) return "points = " + std::to_string(points) + ", want >= 50";
  if (rounds < 1) return "rounds = " + std::to_string(rounds) + ", want >= 1";
  if (first_modes < 1) return "first_modes = " + std::to_string(first_modes) + ", want >= 1";
  if (together < 1) return "together = " + std::to_string(together) + ", want >= 1";
  if (passes < 1) return "passes = " + std::to_string(passes) + ", want >= 1";
  for (const auto& [name, weights] : {std::pair{"first", first}, {"last", last}})
    for (const double weight : {weights.landmarks, weights.data, weights.cloth})
      if (!(weight >= 0) || !std::isfinite(weight)) return std::string(name) + " holds a weight below 0";
  for (const auto& [name, value] : {std::pair{"first_loss_scale", first_loss_scale},
                                    {"last_loss_scale", last_loss_scale},
                                    {"posture_loss_scale", posture_loss_scale},
                                    {"outside_scale", outside_scale},
                                    {"tight_spread", tight_spread},
                                    {"sigma", sigma},
                                    {"observations", observations},
                                    {"max_distance", max_distance},
                                    {"thickest", thickest},
                                    {"tolerance", tolerance}})
    if (auto problem = unlessPositive(name, value)) return problem;
  if (!(scan_noise >= 0) || !std::isfinite(scan_noise))
    return "scan_noise = " + std::to_string(scan_noise) + ", want >= 0";
  if (!(max_normal_angle > 0 && max_normal_angle <= 180))
    return "max_normal_angle = " + std::to_string(max_normal_angle) + ", want (0, 180]";
  for (const auto& [name, share] : {std::pair{"good_share", good_share}, {"explained_share", explained_share}})
    if (!(share >= 0 && share <= 1)) return std::string(name) + " = " + std::to_string(share) + ", want 0 to 1";
  if (auto problem = limbs.firstViolation()) return "limbs." + *problem;
  if (auto problem = extremities.firstViolation()) return "extremities." + *problem;
  return registration.firstViolation();
}

Solved<ClothedBody> estimateUnderClothing(std::span<const Scan> scans, const BodyModel& model,
                                          std::span<const std::vector<Landmark>> landmarks,
                                          const ClothingOptions& options) {
  if (const auto problem = options.firstViolation()) throw InvalidInput("options", *problem);
  requireInput(scans, landmarks, *model.topology());
  std::deque<ScanSurface> surfaces;
  for (const auto& scan : scans) surfaces.emplace_back(pointsInwards(scan) ? flipped(scan) : scan);
  const BodyModel coarse = model.truncated(std::min<Eigen::Index>(options.first_modes, model.modeCount()));
  FirstFits first_fits(surfaces, coarse, landmarks, options);
  const auto& fits = first_fits.run();
  if (options.stop.stop_requested()) {
    Solved<ClothedBody> nothing;
    nothing.termination = Termination::kCancelled;
    return nothing;
  }
  return Estimation(surfaces, model, landmarks, options).run(fits, first_fits.best());
}

}  // namespace shaped
