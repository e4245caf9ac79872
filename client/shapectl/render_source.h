#pragma once

#include <optional>
#include <string>
#include <vector>

#include "core/rendering/contact_sheet.h"

namespace shaped::shapectl {

/// What `render` draws: mesh files, frames of .npy stacks whose connectivity a template gives, and scans.
struct RenderSource {
  std::vector<std::string> files;
  std::string template_file;  ///< connectivity of the .npy files among them
  std::string frames;         ///< of each stack: "a:b:step"; empty: all, or 24 evenly spaced when there are more

  std::vector<std::string> scans;  ///< without faces they are drawn as little balls

  /// Reads everything, files first. Throws InvalidInput naming a file that cannot be read or lacks its template.
  std::vector<RenderItem> items() const;
};

/// Errors of one item, one per vertex, metres.
struct ItemErrors {
  Eigen::VectorXd distances;
  double mean() const { return distances.mean(); }
  double largest() const { return distances.maxCoeff(); }
};

/// Distances of each item to a reference file: between corresponding vertices where the connectivity is the same, to
/// the closest point of its surface elsewhere. A .npy reference is compared frame by frame with the same selection.
/// Throws InvalidInput when the reference has neither one shape nor as many as there are items.
std::vector<ItemErrors> errorsAgainst(const std::vector<RenderItem>& items, const RenderSource& reference);

}  // namespace shaped::shapectl
