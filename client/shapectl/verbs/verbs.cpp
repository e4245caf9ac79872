#include "client/shapectl/verbs/verbs.h"

namespace shaped::shapectl {

std::vector<Verb> allVerbs() {
  return {
      modelsVerb(), describeVerb(), deleteVerb(),  //
      jobsVerb(),   watchVerb(),    cancelVerb(),
  };
}

}  // namespace shaped::shapectl
