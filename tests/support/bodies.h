#pragma once

#include "core/body/body_training.h"
#include "tests/support/rigs.h"

namespace shaped::test {

/// A rigged tube as a posture template.
PostureTemplate tubeTemplate(int joints);

/// Tubes of differing girth, length and taper, with the template's connectivity, all at rest.
std::vector<Vertices> tubeIdentities(const PostureTemplate& reference, int count, unsigned seed);

/// A model of `count` such tubes with `modes` modes.
BodyModel tubeModel(int joints, int count, int modes);

/// Coefficients of a plausible identity: independent standard normal numbers.
Eigen::VectorXd randomIdentity(const BodyModel& model, unsigned seed);

}  // namespace shaped::test
