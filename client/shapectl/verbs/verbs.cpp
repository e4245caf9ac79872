#include "client/shapectl/verbs/verbs.h"

namespace shaped::shapectl {

std::vector<Verb> allVerbs() {
  return {
      trainVerb(),    bootstrapVerb(),  datasetsVerb(),      deleteDatasetVerb(),                   //
      modelsVerb(),   describeVerb(),   deleteVerb(),                                               //
      loadVerb(),     unloadVerb(),     labelVerb(),         waitVerb(),                            //
      downloadVerb(), uploadVerb(),                                                                 //
      jobsVerb(),     watchVerb(),      resultVerb(),        cancelVerb(),        deleteJobVerb(),  //
      projectVerb(),  synthesizeVerb(), interpolateVerb(),   editVerb(),                            //
      smoothVerb(),   geodesicVerb(),   bezierVerb(),        joinVerb(),                            //
      fitVerb(),      registerVerb(),   underClothingVerb(), scoreVerb(),         evaluateVerb(),   //
      sampleVerb(),   sampleScanVerb(), renderVerb(),        renderMotionVerb(),                    //
      tokenVerb(),    topVerb(),        healthVerb(),        benchVerb(),                           //
  };
}

}  // namespace shaped::shapectl
