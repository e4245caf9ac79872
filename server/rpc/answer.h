#pragma once

#include "server/convert/model.h"
#include "server/convert/report.h"
#include "server/errors/errors.h"
#include "server/models/model_store.h"
#include "server/rpc/call.h"

namespace shaped::server {

/// Pins the model that a request names and notes it for the log. Throws Waiting while it is being loaded, so call it
/// before anything else.
template <class Request>
ServedModelPtr pinModel(ModelStore& store, const Request& request, Call& call) {
  auto model = store.pin(selectorFromProto(request.model()));
  call.setModel(model->name, model->version);
  return model;
}

/// Fills what every answer carries. seconds: of the work, by the wall clock.
template <class Response>
void fillAnswer(const ServedModel& model, const Outcome& outcome, double seconds, double smallest_area_ratio,
                Response& response) {
  response.mutable_model()->set_name(model.name);
  response.mutable_model()->set_version(model.version);
  toProto(outcome, seconds, *response.mutable_report());
  response.set_smallest_area_ratio(smallest_area_ratio);
}

/// The same for a call, and counts. Throws Stopped when the solver was cancelled: then there is no answer.
template <class Response>
void setAnswer(const ServedModel& model, const Outcome& outcome, double smallest_area_ratio, Call& call,
               Response& response) {
  if (outcome.termination == Termination::kCancelled) throw Stopped();
  call.solved(outcome);
  fillAnswer(model, outcome, call.workSeconds(), smallest_area_ratio, response);
}

}  // namespace shaped::server
