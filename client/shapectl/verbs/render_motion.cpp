#include <algorithm>
#include <filesystem>
#include <iostream>

#include "client/shapectl/frame_range.h"
#include "client/shapectl/numbers.h"
#include "client/shapectl/output.h"
#include "client/shapectl/verbs/verbs.h"
#include "core/io/file.h"
#include "core/io/frames.h"
#include "core/io/mesh_file.h"
#include "core/numerics/error.h"
#include "core/rendering/contact_sheet.h"
#include "core/rendering/gif.h"
#include "core/rendering/png.h"

namespace shaped::shapectl {
namespace {

struct RenderMotion {
  std::string in, out, template_file, frames, up = "y";
  std::int64_t width = 0, count = 0;
  double azimuth = 35, elevation = 18, rate = 30;
  bool own_view = false, no_ground = false;

  void declare(Arguments& arguments) {
    arguments.positional("FRAMES", in, "The motion: n x V x 3 .npy, metres");
    arguments.option("--template", template_file, "T.ply", "A mesh of its connectivity");
    arguments.required();
    arguments.option("-o,--out", out, "OUT", "OUT.png: a strip of pictures; OUT.gif: an animated picture");
    arguments.required();
    arguments.option("--frames", frames, "a:b:step", "Which frames, as a Python slice");
    arguments.option("--count", count, "N", "At most so many of them, evenly spaced (8 in a strip, 240 animated)");
    arguments.option("--rate", rate, "FPS", "Frames of the motion in a second (30)");
    arguments.option("--width", width, "PX", "Width of a picture [pixels] (240 in a strip, 360 animated)");
    arguments.option("--azimuth", azimuth, "DEG", "View around the up axis, 0 from the front (35)");
    arguments.option("--elevation", elevation, "DEG", "View above the horizon (18)");
    arguments.option("--up", up, "AXIS", "y or z (y)");
    arguments.flag("--own-view", own_view, "Put each frame in the middle of its picture instead of where it is");
    arguments.flag("--no-ground", no_ground, "No shadow on the ground");
  }

  ExitCode run(const Session& session) const {
    const auto kind = std::filesystem::path(out).extension();
    if (kind != ".png" && kind != ".gif") throw InvalidInput("--out", "is \"" + out + "\", want OUT.png or OUT.gif");
    if (!(rate > 0 && rate <= 1000))
      throw InvalidInput("--rate", "= " + std::to_string(rate) + ", want above 0, at most 1000");
    const bool animated = kind == ".gif";
    const FrameReader motion(in);
    const auto chosen = chosenFrames(motion.frameCount(), animated ? kAnimated : kStrip);
    const auto items = itemsFrom(motion, chosen, !animated);
    const auto options = optionsFor(animated, static_cast<int>(items.size()));
    const Image picture = animated ? animate(items, chosen, options, session) : strip(items, options, session);
    if (session.stop.stop_requested()) return ExitCode::kCancelled;
    print(items.size(), picture, session);
    return ExitCode::kSuccess;
  }

 private:
  static constexpr std::int64_t kStrip = 8, kAnimated = 240;

  std::vector<std::int64_t> chosenFrames(std::int64_t total, std::int64_t otherwise) const {
    if (count < 0 || count == 1) throw InvalidInput("--count", "= " + std::to_string(count) + ", want 2 or more");
    const auto all = framesOf(frames, total);
    const auto most = count > 0 ? count : frames.empty() ? otherwise : std::max<std::int64_t>(total, 2);
    return thinned(all, most);
  }

  std::vector<RenderItem> itemsFrom(const FrameReader& motion, const std::vector<std::int64_t>& chosen,
                                    bool captions) const {
    const auto mesh = readMesh(template_file);
    if (mesh.vertices.rows() != motion.vertexCount())
      throw InvalidInput(in, "has " + std::to_string(motion.vertexCount()) + " vertices a frame, " + template_file +
                                 " has " + std::to_string(mesh.vertices.rows()));
    std::vector<RenderItem> items;
    for (const auto frame : chosen)
      items.push_back({motion.frame(frame), mesh.faces, captions ? std::to_string(frame) : "", {}});
    return items;
  }

  RenderOptions optionsFor(bool animated, int pictures) const {
    if (up != "y" && up != "z") throw InvalidInput("--up", "is \"" + up + "\", want y or z");
    RenderOptions options;
    options.columns = pictures;
    options.tile_width = width > 0 ? static_cast<int>(countOf("--width", width)) : animated ? 360 : 240;
    options.azimuth = azimuth;
    options.elevation = elevation;
    options.up = up == "z" ? UpAxis::kZ : UpAxis::kY;
    options.common_view = animated && !own_view;
    options.ground = !no_ground;
    options.samples = animated ? 2 : 3;
    if (const auto problem = options.firstViolation()) throw InvalidInput("options", *problem);
    return options;
  }

  Image strip(const std::vector<RenderItem>& items, const RenderOptions& options, const Session& session) const {
    auto image = renderContactSheet(items, options, session.stop);
    if (!session.stop.stop_requested()) writeFile(out, encodePng(image));
    return image;
  }

  /// Returns the first picture.
  Image animate(const std::vector<RenderItem>& items, const std::vector<std::int64_t>& chosen,
                const RenderOptions& options, const Session& session) const {
    auto images = renderSeparately(items, options, session.stop);
    if (session.stop.stop_requested()) return {};
    // Frames that were left out take their time all the same.
    const auto span = static_cast<double>(chosen.back() - chosen.front());
    const double each = chosen.size() > 1 ? span / static_cast<double>(chosen.size() - 1) : 1;
    writeFile(out, encodeGif(images, each / rate));
    return std::move(images.front());
  }

  void print(std::size_t pictures, const Image& image, const Session& session) const {
    if (session.json)
      return printJson({{"image", out}, {"pictures", pictures}, {"width", image.width()}, {"height", image.height()}});
    std::cout << out << ": " << pictures << " pictures, " << image.width() << " x " << image.height() << " pixels\n";
  }
};

}  // namespace

Verb renderMotionVerb() {
  return makeVerb<RenderMotion>("render-motion", "Draw a motion as a strip of pictures or an animated one");
}

}  // namespace shaped::shapectl
