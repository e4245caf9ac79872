#pragma once

#include <iostream>

#include "client/shapectl/output.h"
#include "client/shapectl/session.h"

namespace shaped::shapectl {

/// What every answer of the Shapes service says, as a JSON document to be extended.
template <class Response>
nlohmann::json documentOf(const Response& response) {
  nlohmann::json document;
  addModel(document, response.model());
  addReport(document, response.report());
  document["smallest_area_ratio"] = response.smallest_area_ratio();
  return document;
}

/// The same as a line of text.
template <class Response>
std::string answerText(const Response& response) {
  return modelText(response.model()) + ": " + reportText(response.report()) + ", smallest area ratio " +
         std::to_string(response.smallest_area_ratio());
}

}  // namespace shaped::shapectl
