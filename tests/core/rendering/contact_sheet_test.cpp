#include "core/rendering/contact_sheet.h"

#include <png.h>

#include <catch2/catch.hpp>
#include <cmath>
#include <cstring>
#include <limits>

#include "core/numerics/error.h"
#include "core/rendering/color_map.h"
#include "core/rendering/png.h"

using namespace shaped;

namespace {

/// A sphere of latitude and longitude, closed, radius 1 around the origin.
RenderItem sphere(double radius = 1) {
  const int rings = 16, around = 32;
  RenderItem item{Vertices(rings * around + 2, 3), Faces(2 * rings * around, 3), "", {}};
  for (int i = 0; i < rings; ++i)
    for (int j = 0; j < around; ++j) {
      const double latitude = M_PI * (i + 1.0) / (rings + 1), longitude = 2 * M_PI * j / around;
      item.vertices.row(i * around + j) << std::sin(latitude) * std::sin(longitude), std::cos(latitude),
          std::sin(latitude) * std::cos(longitude);
    }
  const int top = rings * around, bottom = top + 1;
  item.vertices.row(top) << 0, 1, 0;
  item.vertices.row(bottom) << 0, -1, 0;
  item.vertices *= radius;
  int f = 0;
  for (int j = 0; j < around; ++j) {
    const int next = (j + 1) % around, last = (rings - 1) * around;
    item.faces.row(f++) << top, j, next;
    item.faces.row(f++) << bottom, last + next, last + j;
    for (int i = 0; i + 1 < rings; ++i) {
      item.faces.row(f++) << i * around + j, (i + 1) * around + j, (i + 1) * around + next;
      item.faces.row(f++) << i * around + j, (i + 1) * around + next, i * around + next;
    }
  }
  return item;
}

RenderOptions plainOptions() {
  RenderOptions options;
  options.tile_width = 96;
  options.ground = false;
  options.color = Color(0.5f, 0.5f, 0.5f);
  return options;
}

bool isWhite(const std::uint8_t* pixel) { return pixel[0] == 255 && pixel[1] == 255 && pixel[2] == 255; }

int inkedPixels(const Image& image, int left, int right) {
  int count = 0;
  for (int y = 0; y < image.height(); ++y)
    for (int x = left; x < right; ++x) count += !isWhite(image.at(x, y));
  return count;
}

bool samePixels(const Image& a, const Image& b) {
  return a.width() == b.width() && a.height() == b.height() &&
         std::memcmp(a.at(0, 0), b.at(0, 0), static_cast<std::size_t>(a.width()) * a.height() * 3) == 0;
}

}  // namespace

TEST_CASE("a sphere is drawn as a disc that fills its tile but for the margin") {
  const Image image = renderContactSheet({sphere()}, plainOptions());
  REQUIRE(image.width() == 96);
  REQUIRE(image.height() == 96);
  const double radius = 0.44 * 96;
  CHECK(inkedPixels(image, 0, 96) == Approx(M_PI * radius * radius).epsilon(0.04));
  CHECK(isWhite(image.at(0, 0)));
  CHECK_FALSE(isWhite(image.at(48, 48)));
  CHECK(image.at(48, 48)[0] == image.at(48, 48)[1]);  // a grey surface stays grey
}

TEST_CASE("light comes from the upper left") {
  const Image image = renderContactSheet({sphere()}, plainOptions());
  CHECK(image.at(35, 30)[0] > image.at(61, 66)[0] + 30);
}

TEST_CASE("an inverted mesh shows the warning colour everywhere, a right one nowhere") {
  auto inverted = sphere();
  inverted.faces.col(1).swap(inverted.faces.col(2));
  const auto magenta = [](const std::uint8_t* p) { return p[0] > p[1] + 40 && p[2] > p[1] + 20; };
  const Image wrong = renderContactSheet({inverted}, plainOptions()),
              right = renderContactSheet({sphere()}, plainOptions());
  for (int offset = -20; offset <= 20; offset += 10) {
    CHECK(magenta(wrong.at(48 + offset, 48 - offset)));
    CHECK_FALSE(magenta(right.at(48 + offset, 48 - offset)));
  }
}

TEST_CASE("the azimuth turns from the front (+z) towards +x, the elevation looks from above") {
  auto item = sphere();
  item.colors = Vertices::Zero(item.vertices.rows(), 3);
  item.colors.col(0) = (item.vertices.col(0).array() > 0.5).cast<double>();
  item.colors.col(1) = (item.vertices.col(1).array() > 0.5).cast<double>();
  item.colors.col(2) = (item.vertices.col(2).array() > 0.5).cast<double>();
  auto options = plainOptions();
  const auto strongest = [&](double azimuth, double elevation) {
    options.azimuth = azimuth;
    options.elevation = elevation;
    const Image image = renderContactSheet({item}, options);
    const auto* pixel = image.at(48, 48);
    return std::max_element(pixel, pixel + 3) - pixel;
  };
  CHECK(strongest(90, 0) == 0);
  CHECK(strongest(0, 80) == 1);
  CHECK(strongest(0, 0) == 2);
  options.up = UpAxis::kZ;
  CHECK(strongest(0, 80) == 2);
  CHECK(strongest(90, 0) == 0);
}

TEST_CASE("all meshes have one scale unless asked otherwise") {
  auto options = plainOptions();
  options.columns = 2;
  const Image common = renderContactSheet({sphere(1), sphere(0.5)}, options);
  CHECK(inkedPixels(common, 96, 192) == Approx(0.25 * inkedPixels(common, 0, 96)).epsilon(0.06));
  options.common_scale = false;
  const Image own = renderContactSheet({sphere(1), sphere(0.5)}, options);
  CHECK(inkedPixels(own, 96, 192) == Approx(inkedPixels(own, 0, 96)).epsilon(0.02));
}

TEST_CASE("tiles fill a grid of the asked columns, or few empty places by default") {
  auto options = plainOptions();
  options.samples = 1;
  const std::vector<RenderItem> five(5, sphere()), six(6, sphere());
  options.columns = 2;
  CHECK(renderContactSheet(five, options).width() == 192);
  CHECK(renderContactSheet(five, options).height() == 288);
  options.columns = 0;
  CHECK(renderContactSheet(six, options).width() == 288);
  options.legend = ColorLegend{10, "mm", "error"};
  CHECK(renderContactSheet(six, options).height() > 192);
}

TEST_CASE("a crease is darker than an open surface of the same slope: ambient occlusion") {
  // A floor with a wall at its far end, both facing the viewer; sky only reaches half of the floor next to the wall.
  RenderItem room{Vertices(6, 3), Faces(4, 3), "", {}};
  room.vertices << -1, 0, 0, 1, 0, 0, 1, 0, 4, -1, 0, 4, -1, 2, 0, 1, 2, 0;
  room.faces << 0, 3, 2, 0, 2, 1, 0, 1, 5, 0, 5, 4;
  auto options = plainOptions();
  options.azimuth = 0;
  options.elevation = 60;
  const Image image = renderContactSheet({room}, options);
  int darkest_row = 0, front_row = 0;
  for (int y = 0; y < image.height(); ++y)
    if (!isWhite(image.at(image.width() / 2, y))) front_row = y;
  for (int y = 0; y < front_row - 3; ++y)
    if (image.at(image.width() / 2, y)[0] < image.at(image.width() / 2, darkest_row)[0]) darkest_row = y;
  CHECK(darkest_row < front_row - image.height() / 5);
  CHECK(image.at(image.width() / 2, darkest_row)[0] + 20 < image.at(image.width() / 2, front_row - 4)[0]);
}

TEST_CASE("the ground carries a shadow, and the tile's border stays white") {
  auto options = plainOptions();
  options.ground = true;
  const Image shadowed = renderContactSheet({sphere()}, options);
  options.ground = false;
  const Image plain = renderContactSheet({sphere()}, options);
  CHECK(inkedPixels(shadowed, 0, 96) > inkedPixels(plain, 0, 96) + 100);
  for (int x = 0; x < 96; ++x) CHECK(isWhite(shadowed.at(x, 95)));
}

TEST_CASE("the same input gives the same pixels, and a caption adds some below") {
  auto item = sphere();
  const Image bare = renderContactSheet({item}, plainOptions());
  CHECK(samePixels(bare, renderContactSheet({item}, plainOptions())));
  item.caption = "sphere";
  const Image named = renderContactSheet({item}, plainOptions());
  CHECK(named.height() > bare.height());
  CHECK(inkedPixels(named, 0, 96) > inkedPixels(bare, 0, 96) + 50);
}

TEST_CASE("a fired stop token leaves the sheet white") {
  std::stop_source source;
  source.request_stop();
  CHECK(inkedPixels(renderContactSheet({sphere()}, plainOptions(), source.get_token()), 0, 96) == 0);
}

TEST_CASE("a PNG decodes to the pixels it was made of") {
  const Image image = renderContactSheet({sphere()}, plainOptions());
  const std::string bytes = encodePng(image);
  png_image description{};
  description.version = PNG_IMAGE_VERSION;
  REQUIRE(png_image_begin_read_from_memory(&description, bytes.data(), bytes.size()));
  description.format = PNG_FORMAT_RGB;
  Image decoded(static_cast<int>(description.width), static_cast<int>(description.height));
  REQUIRE(png_image_finish_read(&description, nullptr, decoded.at(0, 0), 0, nullptr));
  CHECK(samePixels(image, decoded));
  CHECK_THROWS_AS(encodePng(Image()), InvalidInput);
}

TEST_CASE("error colours darken all the way and stop at the limit") {
  const auto luminance = [](double fraction) { return errorColor(fraction).dot(Color(0.21f, 0.72f, 0.07f)); };
  for (double t = 0.02; t <= 1; t += 0.02) CHECK(luminance(t) < luminance(t - 0.02));
  CHECK(errorColor(3) == errorColor(1));
  CHECK(errorColor(-1) == errorColor(0));
  const Vertices colors = errorColors(Eigen::Vector3d(0, 5, 10), 10);
  CHECK(colors.row(1).cast<float>().transpose().isApprox(errorColor(0.5)));
  CHECK_THROWS_AS(errorColors(Eigen::Vector3d(0, 5, 10), 0), InvalidInput);
  CHECK(roundedLimit(7.3) == 10);
  CHECK(roundedLimit(0.0021) == Approx(0.005));
  CHECK(roundedLimit(0) == 1);
}

TEST_CASE("a contact sheet refuses bad input by name") {
  const auto good = sphere();
  CHECK_THROWS_WITH(renderContactSheet({}), Catch::Contains("items"));
  auto bad = good;
  bad.caption = "tail.ply";
  bad.vertices(3, 1) = std::numeric_limits<double>::quiet_NaN();
  CHECK_THROWS_WITH(renderContactSheet({good, bad}), Catch::Contains("items[1]") && Catch::Contains("tail.ply"));
  bad = good;
  bad.faces(0, 0) = 100000;
  CHECK_THROWS_WITH(renderContactSheet({bad}), Catch::Contains("index"));
  bad = good;
  bad.colors = Vertices::Zero(3, 3);
  CHECK_THROWS_WITH(renderContactSheet({bad}), Catch::Contains("colours"));
  bad = good;
  bad.vertices.setZero();
  CHECK_THROWS_WITH(renderContactSheet({bad}), Catch::Contains("extent"));
  auto options = plainOptions();
  options.samples = 0;
  CHECK_THROWS_WITH(renderContactSheet({good}, options), Catch::Contains("samples = 0, want 1 to 8"));
}

TEST_CASE("frames that are seen from one place show where they are, and stand on one ground") {
  auto left = sphere(), right = sphere();
  left.vertices.col(0).array() -= 3;
  right.vertices.col(0).array() += 3;
  right.vertices.col(1).array() += 1;
  RenderOptions options;
  options.azimuth = options.elevation = 0;
  options.ground = false;
  options.common_view = true;
  options.tile_width = 120;
  const auto images = renderSeparately({left, right}, options);
  REQUIRE(images.size() == 2);
  CHECK(images[0].width() == images[1].width());
  CHECK(images[0].height() == images[1].height());
  const auto covered = [](const Image& image) {
    Eigen::Vector2d sum = Eigen::Vector2d::Zero();
    int count = 0;
    for (int y = 0; y < image.height(); ++y)
      for (int x = 0; x < image.width(); ++x)
        if (image.at(x, y)[2] < 250) sum += Eigen::Vector2d(x, y), ++count;
    return Eigen::Vector2d(sum / std::max(count, 1));
  };
  const auto a = covered(images[0]), b = covered(images[1]);
  CHECK(a.x() < 40);
  CHECK(b.x() > 80);
  CHECK(b.y() < a.y());
  options.common_view = false;
  const auto own = renderSeparately({left, right}, options);
  CHECK((covered(own[0]) - covered(own[1])).norm() < 1);
  CHECK_THROWS_AS(renderSeparately({}, options), InvalidInput);
}
