#pragma once

#include <functional>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/io/c3d_numbers.h"

namespace shaped {

/// The parameter section of a C3D file: arrays of text or numbers by group and name (POINT:LABELS).
class C3dParameters {
 public:
  /// bytes: the whole file; [begin, end): where the section's parameters start. Every length and offset is checked.
  /// Throws InvalidInput naming the file when one leads out of the file.
  C3dParameters(const std::string& file, std::string_view bytes, std::size_t begin, std::size_t end,
                C3dNumbers numbers);

  bool has(std::string_view group, std::string_view name) const { return find(group, name) != nullptr; }
  /// The first entries of a text array, at most `most`, blanks at their ends removed; empty when there is no such
  /// parameter.
  std::vector<std::string> texts(std::string_view group, std::string_view name, std::size_t most) const;
  /// Entry `index` of a number array, integers unsigned; nothing when there is no such parameter or entry.
  std::optional<double> number(std::string_view group, std::string_view name, std::size_t index = 0) const;
  /// The same, rounded; nothing when it is no number or its magnitude is 1e12 or more.
  std::optional<std::int64_t> count(std::string_view group, std::string_view name, std::size_t index = 0) const;

 private:
  struct Parameter {
    int type;  ///< -1 text, else bytes of a number: 1, 2 integers, 4 real
    std::vector<std::size_t> extents;
    std::string_view data;
  };

  void addParameter(const std::string& file, std::string_view content, int group, std::string name);
  const Parameter* find(std::string_view group, std::string_view name) const;

  C3dNumbers numbers_;
  std::map<std::string, int, std::less<>> groups_;               ///< number by name
  std::map<std::pair<int, std::string>, Parameter> parameters_;  ///< by group and name
};

}  // namespace shaped
