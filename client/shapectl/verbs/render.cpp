#include <algorithm>
#include <cstdio>
#include <iostream>

#include "client/shapectl/numbers.h"
#include "client/shapectl/output.h"
#include "client/shapectl/render_source.h"
#include "client/shapectl/verbs/verbs.h"
#include "core/io/file.h"
#include "core/numerics/error.h"
#include "core/rendering/color_map.h"
#include "core/rendering/png.h"

namespace shaped::shapectl {
namespace {

constexpr double kMillimetres = 1000;

struct Render {
  std::vector<std::string> files, scans;
  std::string out, template_file, frames, reference, up = "y";
  std::int64_t columns = 0, width = 320;
  double azimuth = 35, elevation = 18;
  std::optional<double> limit;
  bool own_scale = false, no_ground = false;

  void declare(Arguments& arguments) {
    arguments.positionals("MESH", files, 0, "Meshes (OBJ, PLY, OFF, STL), or stacks .npy (n x V x 3) with --template");
    arguments.option("-o,--out", out, "OUT.png", "The picture");
    arguments.required();
    arguments.option("--template", template_file, "T.ply", "Connectivity of .npy stacks");
    arguments.option("--frames", frames, "a:b:step", "Frames of each stack, as a Python slice (all, 24 at most)");
    arguments.option("--scans", scans, "SCAN",
                     "Scans (PLY, OBJ, OFF, STL, .npy, .xyz), drawn as points, after the meshes");
    arguments.option("--error-against", reference, "REF", "Colour by the distance to this mesh or stack");
    arguments.option("--error-limit", limit, "MM", "Distance of the darkest colour [mm] (from the data)");
    arguments.option("--columns", columns, "N", "Pictures in a row (chosen)");
    arguments.option("--width", width, "PX", "Width of a picture [pixels] (320)");
    arguments.option("--azimuth", azimuth, "DEG", "View around the up axis, 0 from the front (35)");
    arguments.option("--elevation", elevation, "DEG", "View above the horizon (18)");
    arguments.option("--up", up, "AXIS", "y or z (y)");
    arguments.flag("--own-scale", own_scale, "Let each mesh fill its picture instead of one scale for all");
    arguments.flag("--no-ground", no_ground, "No shadow on the ground");
  }

  ExitCode run(const Session& session) const {
    auto options = sheetOptions();
    if (files.empty() && scans.empty())
      throw InvalidInput("MESH", "nothing to draw; name meshes, or scans after --scans");
    if (!reference.empty() && !scans.empty())
      throw InvalidInput("--error-against", "colours meshes; draw the scans without it");
    auto items = RenderSource{files, template_file, frames, scans}.items();
    std::vector<ItemErrors> errors;
    if (!reference.empty()) errors = errorsAgainst(items, {{reference}, template_file, frames, {}});
    if (!errors.empty()) colorByError(items, errors, options);
    const Image image = renderContactSheet(items, options, session.stop);
    if (session.stop.stop_requested()) return ExitCode::kCancelled;
    writeFile(out, encodePng(image));
    print(items, errors, image, session);
    return ExitCode::kSuccess;
  }

 private:
  RenderOptions sheetOptions() const {
    if (up != "y" && up != "z") throw InvalidInput("--up", "is \"" + up + "\", want y or z");
    RenderOptions options;
    options.columns = static_cast<int>(countOf("--columns", columns));
    options.tile_width = static_cast<int>(countOf("--width", width));
    options.azimuth = azimuth;
    options.elevation = elevation;
    options.up = up == "z" ? UpAxis::kZ : UpAxis::kY;
    options.common_scale = !own_scale;
    options.ground = !no_ground;
    if (const auto problem = options.firstViolation()) throw InvalidInput("options", *problem);
    return options;
  }

  /// One colour scale for all pictures; their captions say the mean.
  void colorByError(std::vector<RenderItem>& items, const std::vector<ItemErrors>& errors,
                    RenderOptions& options) const {
    double largest = 0;
    for (const auto& error : errors) largest = std::max(largest, kMillimetres * error.largest());
    const double shown = limit ? *limit : roundedLimit(largest);
    for (std::size_t i = 0; i < items.size(); ++i) {
      items[i].colors = errorColors(kMillimetres * errors[i].distances, shown);
      char mean[32];
      std::snprintf(mean, sizeof mean, "  %.1f mm", kMillimetres * errors[i].mean());
      items[i].caption += mean;
    }
    options.legend = ColorLegend{shown, "mm", "distance"};
  }

  void print(const std::vector<RenderItem>& items, const std::vector<ItemErrors>& errors, const Image& image,
             const Session& session) const {
    if (!session.json) {
      std::cout << out << ": " << items.size() << " pictures, " << image.width() << " x " << image.height()
                << " pixels\n";
      for (std::size_t i = 0; i < errors.size(); ++i)
        std::cout << "  " << items[i].caption << " on average, " << kMillimetres * errors[i].largest()
                  << " mm at most\n";
      return;
    }
    nlohmann::json document{{"image", out}, {"width", image.width()}, {"height", image.height()}};
    auto& list = document["pictures"] = nlohmann::json::array();
    for (std::size_t i = 0; i < items.size(); ++i) {
      list.push_back({{"caption", items[i].caption}});
      if (errors.empty()) continue;
      list.back()["mean_distance"] = errors[i].mean();
      list.back()["largest_distance"] = errors[i].largest();
    }
    printJson(document);
  }
};

}  // namespace

Verb renderVerb() { return makeVerb<Render>("render", "Draw meshes as a contact sheet, coloured by error if asked"); }

}  // namespace shaped::shapectl
