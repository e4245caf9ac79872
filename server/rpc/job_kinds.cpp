#include "server/rpc/job_kinds.h"

#include "server/rpc/body_training.h"
#include "server/rpc/bootstrap_job.h"
#include "server/rpc/evaluate.h"
#include "server/rpc/marker_job.h"
#include "server/rpc/project_job.h"
#include "server/rpc/training.h"

namespace shaped::server {

JobRunner::Kinds jobKinds(const JobContext& context) {
  return {{kTrainShellPga, shellPgaTraining(context)},
          {kTrainBody, bodyTraining(context)},
          {kBootstrap, bootstrapTraining(context)},
          {kEvaluate, evaluation(context)},
          {kProject, projection(context)},
          {kFitMarkers, markerFit(context)}};
}

}  // namespace shaped::server
