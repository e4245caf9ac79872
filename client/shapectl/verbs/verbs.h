#pragma once

#include <vector>

#include "client/shapectl/verb.h"

namespace shaped::shapectl {

Verb modelsVerb();
Verb describeVerb();
Verb deleteVerb();
Verb jobsVerb();
Verb watchVerb();
Verb cancelVerb();

/// Every verb, in the order of the help.
std::vector<Verb> allVerbs();

}  // namespace shaped::shapectl
