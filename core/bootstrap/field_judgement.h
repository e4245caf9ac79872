#pragma once

#include <vector>

#include "core/bootstrap/field_trainer.h"

namespace shaped {

/// Takes every fifth registration's pairs out of a set, for judging the field that is trained on the others. None where
/// there are fewer than ten registrations: all are needed then.
std::vector<RestPair> takeJudges(std::vector<RestPair>& pairs);

/// What a field does for bodies that it was not trained on.
struct FieldJudgement {
  double before = 0, after = 0;  ///< mean distance of corresponding vertices of source and target, of X' and target, m

  /// By a hundredth at least: less is not worth the time that evaluating it takes.
  bool helps() const { return after < 0.99 * before; }
};

/// judges: at least one pair. `after` is infinite where the field overflows on one. Throws as jacobianFieldFeatures
/// does.
FieldJudgement judgeField(const FieldTrainingSet& set, const JacobianFieldWeights& field,
                          const std::vector<RestPair>& judges);

/// The field that leaves every shape as it is: a last layer of zeros.
JacobianFieldWeights silenced(JacobianFieldWeights field);

}  // namespace shaped
