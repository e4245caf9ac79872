#include "client/shapectl/verbs/verbs.h"

namespace shaped::shapectl {

std::vector<Verb> allVerbs() {
  return {
      trainVerb(),                                                                         //
      modelsVerb(),   describeVerb(),   deleteVerb(),                                      //
      loadVerb(),     unloadVerb(),     labelVerb(),       waitVerb(),                     //
      downloadVerb(), uploadVerb(),                                                        //
      jobsVerb(),     watchVerb(),      resultVerb(),      cancelVerb(), deleteJobVerb(),  //
      projectVerb(),  synthesizeVerb(), interpolateVerb(), editVerb(),                     //
      fitVerb(),      scoreVerb(),      evaluateVerb(),                                    //
      sampleVerb(),   renderVerb(),     tokenVerb(),                                       //
      topVerb(),      healthVerb(),     benchVerb(),                                       //
  };
}

}  // namespace shaped::shapectl
