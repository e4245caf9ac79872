#include "core/clothing/first_fits.h"

#include <algorithm>

#include "core/registration/limb_search.h"

namespace shaped {
namespace {

bool lessScore(const FirstFit& one, const FirstFit& other) { return one.score < other.score; }

std::size_t between(std::size_t one, std::size_t other) { return one > other ? one - other : other - one; }

/// The body where it stands, every joint but the root at rest.
BodyState withoutTurns(BodyState state) {
  state.pose.rotations.bottomRows(state.pose.rotations.rows() - 1).setZero();
  return state;
}

}  // namespace

FirstFits::FirstFits(const std::deque<ScanSurface>& scans, const BodyModel& model,
                     std::span<const std::vector<Landmark>> landmarks, const ClothingOptions& options)
    : scans_(scans), model_(model), landmarks_(landmarks), options_(options), fits_(scans.size()) {}

const std::vector<FirstFit>& FirstFits::run() {
  const auto tell = [&](std::size_t frame, double fraction) {
    if (options_.progress) options_.progress({"first fit " + std::to_string(frame + 1), fraction, 0});
  };
  const std::size_t alone = std::min(scans_.size(), std::size_t(options_.fitted_alone));
  for (std::size_t i = 0; i < alone && !stopped(); ++i) {
    const std::size_t frame = i * scans_.size() / alone;
    tell(frame, 0.3 * double(i) / double(alone));
    fitAlone(frame);
  }
  for (std::size_t round = 0; round < scans_.size() && !stopped(); ++round) {
    const auto frame = badFrameNearGood();
    if (!frame) break;
    tell(*frame, 0.3 + 0.2 * double(round) / double(scans_.size()));
    retry(*frame);
    tried_.insert(*frame);
  }
  return fits_;
}

std::size_t FirstFits::best() const {
  return std::size_t(std::max_element(fits_.begin(), fits_.end(), lessScore) - fits_.begin());
}

std::vector<Landmark> FirstFits::landmarksOf(std::size_t frame) const {
  return landmarks_.empty() ? std::vector<Landmark>() : landmarks_[frame];
}

void FirstFits::descend(std::size_t frame, const BodyState& start) {
  ModelFitOptions fit = options_.registration.fit;
  fit.stop = options_.stop;
  if (stopped()) return;
  const auto state = fitModelToScan(scans_[frame], model_, start, landmarksOf(frame), fit).solution.state;
  if (stopped()) return;
  const double score = registrationScore(scans_[frame], model_, model_.posed(state).vertices());
  if (score > fits_[frame].score) fits_[frame] = {state, score};
}

BodyState FirstFits::seated(std::size_t frame, const BodyState& start, bool backwards) const {
  auto options = options_.limbs;
  options.backwards = backwards;
  return searchLimbs(scans_[frame], model_, start, options, options_.stop).state;
}

void FirstFits::fitAlone(std::size_t frame) {
  const auto& faces = model_.topology()->faces();
  const auto landmarks = landmarksOf(frame);
  if (landmarks.size() >= 3)
    return descend(frame,
                   placedState(model_, startFromLandmarks(landmarks, model_.parts().mean, faces).solution.motion));
  const auto start =
      startRigidly(scans_[frame], model_.parts().mean, faces, options_.registration.start, options_.stop).solution;
  ModelFitOptions coarse = options_.registration.fit;
  coarse.levels.resize(1);
  coarse.stop = options_.stop;
  std::optional<ModelFit> chosen;
  for (const auto& motion : {start.motion, start.runner_up}) {
    if (chosen && (start.margin >= options_.registration.doubtful_margin || stopped())) break;
    const auto fit =
        fitModelToScan(scans_[frame], model_, seated(frame, placedState(model_, motion)), landmarks, coarse).solution;
    if (stopped()) return;
    if (!chosen || fit.report.chamfer < chosen->report.chamfer) chosen = fit;
  }
  descend(frame, chosen->state);
}

std::vector<std::size_t> FirstFits::goodFramesNear(std::size_t frame) const {
  std::vector<std::size_t> frames;
  for (std::size_t f = 0; f < fits_.size(); ++f)
    if (f != frame && good(f)) frames.push_back(f);
  std::stable_sort(frames.begin(), frames.end(),
                   [&](std::size_t a, std::size_t b) { return between(a, frame) < between(b, frame); });
  return frames;
}

/// Of those that were not tried again yet, the one nearest to a good frame.
std::optional<std::size_t> FirstFits::badFrameNearGood() const {
  std::optional<std::size_t> chosen;
  std::size_t least = scans_.size();
  for (std::size_t f = 0; f < scans_.size(); ++f) {
    if (good(f) || tried_.count(f)) continue;
    const std::size_t away = between(f, goodFramesNear(f).front());
    if (away < least) least = away, chosen = f;
  }
  return chosen;
}

void FirstFits::retry(std::size_t frame) {
  const auto near = goodFramesNear(frame);
  const auto attempt = [&](const BodyState& state) {
    for (const bool backwards : {false, true})
      if (!good(frame) && !stopped()) descend(frame, seated(frame, state, backwards));
  };
  // With the trunk in place the search sees what it could not before.
  if (fits_[frame].score >= 0) attempt(withoutTurns(fits_[frame].state));
  for (std::size_t i = 0; i < near.size() && i < std::size_t(options_.retries); ++i) {
    const BodyState& known = fits_[near[i]].state;
    const auto start = startRigidly(scans_[frame], model_.posed(known).vertices(), model_.topology()->faces(),
                                    options_.registration.start, options_.stop)
                           .solution;
    for (const auto& motion : {start.motion, start.runner_up}) {
      if (good(frame) || stopped()) return;
      descend(frame, carried(model_, known, motion));
      attempt(carried(model_, known, motion));
    }
  }
}

}  // namespace shaped
