#pragma once

#include <vector>

#include "client/shapectl/verb.h"

namespace shaped::shapectl {

Verb trainVerb();
Verb bootstrapVerb();
Verb datasetsVerb();
Verb deleteDatasetVerb();
Verb modelsVerb();
Verb loadVerb();
Verb unloadVerb();
Verb labelVerb();
Verb waitVerb();
Verb describeVerb();
Verb deleteVerb();
Verb downloadVerb();
Verb uploadVerb();
Verb deleteJobVerb();
Verb jobsVerb();
Verb watchVerb();
Verb resultVerb();
Verb cancelVerb();
Verb projectVerb();
Verb synthesizeVerb();
Verb interpolateVerb();
Verb editVerb();
Verb smoothVerb();
Verb geodesicVerb();
Verb bezierVerb();
Verb joinVerb();
Verb renderMotionVerb();
Verb fitVerb();
Verb registerVerb();
Verb underClothingVerb();
Verb scoreVerb();
Verb evaluateVerb();
Verb sampleVerb();
Verb sampleScanVerb();
Verb renderVerb();
Verb tokenVerb();
Verb topVerb();
Verb healthVerb();
Verb benchVerb();

/// Every verb, in the order of the help.
std::vector<Verb> allVerbs();

}  // namespace shaped::shapectl
