#pragma once

#include <string>

#include "client/shapectl/session.h"
#include "shaped/v1/shapes.pb.h"

namespace shaped::shapectl {

void printEvaluation(const v1::EvaluateResponse& response, const Session& session);

/// The three measures over the number of modes, SVG.
std::string evaluationPlot(const v1::EvaluateResponse& response);

}  // namespace shaped::shapectl
