#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "core/mesh/types.h"

namespace shaped {

/// What a motion-capture system saw: labelled points over time.
struct MarkerTrial {
  std::vector<std::string> labels;  ///< L, as in the file; may carry a subject's name ("Male:LFWT")
  double rate_hz = 0;               ///< frames a second; 0 when the file does not say
  std::vector<Vertices> frames;     ///< L x 3 each, metres; a row of NaN where the marker was not seen
};

/// The label without the subject's name: "Male:LFWT" -> "LFWT".
inline std::string_view withoutSubject(std::string_view label) {
  const auto colon = label.rfind(':');
  return colon == std::string_view::npos ? label : label.substr(colon + 1);
}

}  // namespace shaped
