#include "core/bootstrap/field_judgement.h"

#include <oneapi/tbb/parallel_for.h>

#include <algorithm>
#include <iterator>
#include <limits>
#include <set>

#include "core/mesh/quality.h"

namespace shaped {
namespace {

constexpr std::size_t kFewestRegistrations = 10, kOneIn = 5;

}  // namespace

std::vector<RestPair> takeJudges(std::vector<RestPair>& pairs) {
  std::set<std::size_t> examples;
  for (const auto& pair : pairs) examples.insert(pair.example);
  if (examples.size() < kFewestRegistrations) return {};
  const auto judging = [&](const RestPair& pair) {
    return static_cast<std::size_t>(std::distance(examples.begin(), examples.find(pair.example))) % kOneIn ==
           kOneIn - 1;
  };
  const auto first =
      std::stable_partition(pairs.begin(), pairs.end(), [&](const auto& pair) { return !judging(pair); });
  std::vector<RestPair> judges(std::make_move_iterator(first), std::make_move_iterator(pairs.end()));
  pairs.erase(first, pairs.end());
  return judges;
}

FieldJudgement judgeField(const FieldTrainingSet& set, const JacobianFieldWeights& field,
                          const std::vector<RestPair>& judges) {
  const JacobianField deformation(field);
  std::vector<FieldJudgement> each(judges.size());
  tbb::parallel_for(std::size_t{0}, judges.size(), [&](std::size_t i) {
    const auto& pair = judges[i];
    const auto features = jacobianFieldFeatures(*set.reference, pair.source, pair.scan, set.scaling);
    const auto jacobians = deformation.predict(features);
    each[i].before = meanVertexDistance(pair.source, pair.target);
    each[i].after = std::numeric_limits<double>::infinity();
    if (!jacobians.allFinite()) return;
    const Vertices deformed = set.reference->poisson->solve(jacobians, features.centroids);
    each[i].after = meanVertexDistance(deformed, pair.target);
  });
  FieldJudgement mean;
  for (const auto& one : each) {
    mean.before += one.before / double(each.size());
    mean.after += one.after / double(each.size());
  }
  return mean;
}

JacobianFieldWeights silenced(JacobianFieldWeights field) {
  field.mlp.back().weight.setZero();
  field.mlp.back().bias.setZero();
  return field;
}

}  // namespace shaped
