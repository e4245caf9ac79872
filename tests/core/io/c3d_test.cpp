#include "core/io/c3d.h"

#include <catch2/catch.hpp>
#include <cmath>

#include "core/io/file.h"
#include "core/io/marker_file.h"
#include "core/numerics/error.h"
#include "tests/support/c3d_writer.h"
#include "tests/support/real_data.h"
#include "tests/support/temporary_folder.h"

using namespace shaped;
using Catch::Contains;

namespace {

/// Points of up to two metres, every seventh missing.
MarkerTrial someTrial(Eigen::Index markers, std::size_t frames) {
  MarkerTrial trial;
  trial.rate_hz = 120;
  for (Eigen::Index m = 0; m < markers; ++m) trial.labels.push_back("Anna:M" + std::to_string(m));
  for (std::size_t f = 0; f < frames; ++f) {
    auto& frame = trial.frames.emplace_back(2 * Vertices::Random(markers, 3));
    for (Eigen::Index m = 0; m < markers; ++m)
      if ((m + static_cast<Eigen::Index>(f)) % 7 == 3) frame.row(m).setConstant(std::nan(""));
  }
  return trial;
}

/// The largest coordinate difference; infinite where one trial has a point that the other lacks.
double difference(const MarkerTrial& a, const MarkerTrial& b) {
  if (a.frames.size() != b.frames.size()) return INFINITY;
  double largest = 0;
  for (std::size_t f = 0; f < a.frames.size(); ++f) {
    if (a.frames[f].rows() != b.frames[f].rows()) return INFINITY;
    for (Eigen::Index m = 0; m < a.frames[f].rows(); ++m) {
      const bool seen = a.frames[f].row(m).allFinite();
      if (seen != b.frames[f].row(m).allFinite()) return INFINITY;
      if (seen) largest = std::max(largest, (a.frames[f].row(m) - b.frames[f].row(m)).cwiseAbs().maxCoeff());
    }
  }
  return largest;
}

double missingShare(const MarkerTrial& trial) {
  double missing = 0;
  for (const auto& frame : trial.frames) missing += static_cast<double>(frame.col(0).array().isNaN().count());
  return missing / static_cast<double>(trial.frames.size() * trial.labels.size());
}

}  // namespace

TEST_CASE("C3D reads the numbers of every processor, as floats and as scaled integers") {
  const auto trial = someTrial(9, 20);
  for (const auto processor : {C3dProcessor::kIntel, C3dProcessor::kDec, C3dProcessor::kMips})
    for (const double scale : {-0.1, 0.1})
      for (const int analog : {0, 5})
        for (const bool zeros : {false, true}) {
          INFO(int(processor) << ", scale " << scale << ", analog " << analog << ", zeros " << zeros);
          test::C3dOptions options;
          options.processor = processor;
          options.scale = scale;
          options.analog_values = analog;
          options.missing_by_zero = zeros;
          const auto read = parseC3d("a.c3d", test::formatC3d(trial, options));
          CHECK(read.labels == trial.labels);
          CHECK(read.rate_hz == 120);
          CHECK(difference(read, trial) < (scale > 0 ? 0.0501e-3 : 1.3e-7));
        }
}

TEST_CASE("VAX numbers are sign, exponent and fraction with the words swapped") {
  const C3dNumbers numbers(C3dProcessor::kDec);
  const auto real = [&](std::initializer_list<int> bytes) {
    std::string raw;
    for (const int byte : bytes) raw += static_cast<char>(byte);
    return numbers.real(raw.data());
  };
  CHECK(real({0x80, 0x40, 0, 0}) == 1);  // DEC's own manual
  CHECK(real({0x60, 0xc1, 0, 0}) == -3.5);
  CHECK(real({0x49, 0x41, 0xd0, 0x0f}) == Approx(3.14159).epsilon(1e-5));
  CHECK(real({0, 0, 0, 0}) == 0);
  CHECK(real({0x80, 0, 0, 0}) == std::ldexp(1, -128));  // the smallest: no float could hold a quarter of it
  CHECK(real({0xff, 0x7f, 0xff, 0xff}) == std::ldexp(1 - std::ldexp(1, -24), 127));
  CHECK(std::isnan(real({0, 0x80, 0, 0})));
}

TEST_CASE("C3D units become metres") {
  const auto trial = someTrial(4, 3);
  for (const auto& [units, per_metre] :
       {std::pair{"mm", 1000.0}, {"cm", 100}, {"m", 1}, {"M  ", 1}, {"in", 1 / 0.0254}, {"", 1000}}) {
    test::C3dOptions options;
    options.units = units;
    options.units_per_metre = per_metre;
    CHECK(difference(parseC3d("a.c3d", test::formatC3d(trial, options)), trial) < 3e-7);
  }
  test::C3dOptions options;
  options.units = "furlong";
  CHECK_THROWS_WITH(parseC3d("a.c3d", test::formatC3d(trial, options)), Contains("a.c3d: has POINT:UNITS 'furlong'"));
}

TEST_CASE("C3D labels go on in LABELS2 and LABELS3, and points without one get a name") {
  auto trial = someTrial(300, 2);
  test::C3dOptions options;
  for (const std::size_t per_parameter : {255, 120}) {
    options.labels_per_parameter = per_parameter;
    CHECK(parseC3d("a.c3d", test::formatC3d(trial, options)).labels == trial.labels);
  }
  trial.labels[7] = "";
  CHECK(parseC3d("a.c3d", test::formatC3d(trial, options)).labels[7] == "unlabelled_8");
  CHECK(withoutSubject("Anna:M7") == "M7");
  CHECK(withoutSubject("M7") == "M7");
}

TEST_CASE("C3D counts frames beyond 65535") {
  const auto trial = someTrial(1, 70000);
  for (const int way : {0, 1, 2}) {
    test::C3dOptions options;
    options.scale = 0.1;
    options.trial_group = way == 0;
    options.long_frames = way >= 1;
    options.first_frame = way == 2 ? 100000 : 1;
    CHECK(difference(parseC3d("a.c3d", test::formatC3d(trial, options)), trial) < 0.0501e-3);
  }
  const auto longest_word = someTrial(1, 65535);
  CHECK(parseC3d("a.c3d", test::formatC3d(longest_word)).frames.size() == 65535);
  test::C3dOptions late;  // frame numbers beyond a word, few frames
  late.first_frame = 65530;
  CHECK(parseC3d("a.c3d", test::formatC3d(someTrial(3, 10), late)).frames.size() == 10);
}

TEST_CASE("a C3D header that lies about its length is refused, with the frames that are there") {
  const auto trial = someTrial(5, 100);  // 80 bytes a frame; 100 frames fill 15.6 blocks, so 102 could stand there
  test::C3dOptions options;
  options.header_last_frame = 400;
  CHECK_THROWS_AS(parseC3d("a.c3d", test::formatC3d(trial, options)), InvalidInput);
  CHECK_THROWS_WITH(
      parseC3d("a.c3d", test::formatC3d(trial, options)),
      Contains("a.c3d: contradicts itself: POINT:FRAMES promises 100 frames, the header 400; there are data for 102"));
  options.point_frames = 400;
  CHECK_THROWS_WITH(parseC3d("a.c3d", test::formatC3d(trial, options)),
                    Contains("a.c3d: is truncated: POINT:FRAMES promises 400 frames, 102 are there"));
  options.header_last_frame = options.point_frames = 20;
  CHECK_THROWS_WITH(parseC3d("a.c3d", test::formatC3d(trial, options)),
                    Contains("a.c3d: POINT:FRAMES promises 20 frames, but 102 are there"));
  options.header_last_frame = options.point_frames = 0;
  CHECK_THROWS_WITH(parseC3d("a.c3d", test::formatC3d(trial, options)), Contains("promises 0 frames; want at least 1"));
  options = {};
  options.point_used = 6;
  CHECK_THROWS_WITH(parseC3d("a.c3d", test::formatC3d(trial, options)),
                    Contains("the header promises 5 points, POINT:USED 6"));
  options = {};
  options.scale = 0;
  CHECK_THROWS_WITH(parseC3d("a.c3d", test::formatC3d(trial, options)), Contains("has the scale"));
  CHECK_THROWS_WITH(parseC3d("a.c3d", test::formatC3d(someTrial(0, 1))), Contains("has no points"));
}

TEST_CASE("bytes that are no C3D file are refused") {
  auto bytes = test::formatC3d(someTrial(5, 10));
  CHECK_THROWS_WITH(parseC3d("a.c3d", "C3D"), Contains("a.c3d: is truncated: a C3D header has 512 bytes"));
  auto other = bytes;
  other[1] = 0x51;
  CHECK_THROWS_WITH(parseC3d("a.c3d", other), Contains("is no C3D file"));
  other = bytes;
  other[0] = 0;
  CHECK_THROWS_WITH(parseC3d("a.c3d", other), Contains("is no C3D file"));
  other[0] = 100;
  CHECK_THROWS_WITH(parseC3d("a.c3d", other), Contains("is truncated: ends before its parameters"));
  other = bytes;
  other[515] = 83;
  CHECK_THROWS_WITH(parseC3d("a.c3d", other), Contains("unknown processor type 83"));
}

TEST_CASE("a C3D file cut or damaged anywhere never crashes, and a cut one is refused") {
  const auto trial = someTrial(5, 30);
  const auto bytes = test::formatC3d(trial);
  const auto data_end = bytes.size() - bytes.size() % 512 - 512;
  for (std::size_t size = 0; size < data_end; size += size < 1600 ? 1 : 37)
    CHECK_THROWS_AS(parseC3d("cut.c3d", bytes.substr(0, size)), InvalidInput);
  std::uint32_t random = 1;
  for (int round = 0; round < 20000; ++round) {
    auto damaged = bytes;
    for (int hits = 0; hits < 3; ++hits) {
      random = random * 1664525 + 1013904223;
      damaged[(random >> 8) % 1200] = static_cast<char>(random >> 24);
    }
    try {
      const auto read = parseC3d("damaged.c3d", damaged);
      if (read.frames.empty() || read.frames.front().rows() != static_cast<Eigen::Index>(read.labels.size()))
        FAIL("a damaged file gave a trial that contradicts itself");
    } catch (const InvalidInput&) {
    }
  }
}

TEST_CASE("one real trial in four byte orders and number formats is the same trial") {
  const auto folder = test::realData("c3d_markers/c3d_org_byteorders");
  if (!folder) return;
  const auto reference = readC3d(*folder / "Eb015pr.c3d");
  REQUIRE(reference.frames.size() == 450);
  REQUIRE(reference.labels.size() == 26);
  CHECK(reference.labels[0] == "RFT1");
  CHECK(reference.rate_hz == 50);
  for (const char* name : {"Eb015pi.c3d", "Eb015si.c3d", "Eb015vr.c3d"}) {
    const auto other = readC3d(*folder / name);
    INFO(name);
    CHECK(other.labels == reference.labels);
    CHECK(difference(other, reference) < 0.0834e-3 / 2 + 1e-6);  // half of POINT:SCALE, in metres
  }
}

TEST_CASE("real C3D trials read with the counts, rates and gaps that an independent reader found") {
  struct Case {
    const char* path;
    std::size_t markers, frames;
    double rate, missing;
  };
  for (const auto& [path, markers, frames, rate, missing] :
       {Case{"c3d_markers/btkdata_bsd/mocap36.c3d", 36, 1380, 100, 0.1659},
        Case{"c3d_markers/btkdata_bsd/FunctionalWalk.c3d", 146, 438, 120, 0.2607},
        Case{"c3d_markers/btkdata_bsd/shd01.c3d", 27, 237, 250, 0},
        Case{"c3d_markers/pycgm_mit/Movement_trial.c3d", 239, 323, 120, 0.0354},
        Case{"c3d_markers/pycgm_mit/Static_trial.c3d", 179, 498, 120, 0.0055},
        Case{"cmu_mocap/c3d/85_02.c3d", 41, 810, 120, 0}}) {
    const auto found = test::realData(path);
    if (!found) continue;
    const auto trial = readC3d(*found);
    INFO(path);
    CHECK(trial.labels.size() == markers);
    CHECK(trial.frames.size() == frames);
    CHECK(trial.rate_hz == rate);
    CHECK(missingShare(trial) == Approx(missing).margin(1e-4));
  }
}

TEST_CASE("the real 41-marker trial stands upright in metres once turned") {
  const auto found = test::realData("cmu_mocap/c3d/85_02.c3d");
  if (!found) return;
  auto trial = readC3d(*found);
  CHECK(withoutSubject(trial.labels[0]) == "LFWT");
  turnZUpToYUp(trial);
  const auto& frame = trial.frames.front();
  double lowest = INFINITY, highest = -INFINITY;
  for (Eigen::Index m = 0; m < frame.rows(); ++m)
    if (frame.row(m).allFinite()) lowest = std::min(lowest, frame(m, 1)), highest = std::max(highest, frame(m, 1));
  CHECK(lowest > -0.05);
  CHECK(highest - lowest > 1.4);
  CHECK(highest - lowest < 2);
}

TEST_CASE("a real C3D file cut anywhere is refused") {
  const auto found = test::realData("cmu_mocap/c3d/85_02.c3d");
  if (!found) return;
  const auto bytes = readFile(*found);
  for (std::size_t size = 1; size < bytes.size(); size += 1 + size / 40)
    CHECK_THROWS_AS(parseC3d("cut.c3d", std::string_view(bytes).substr(0, size)), InvalidInput);
  CHECK_THROWS_WITH(parseC3d("cut.c3d", std::string_view(bytes).substr(0, 9216 + 656 * 300 + 5)),
                    Contains("cut.c3d: is truncated") && Contains("promises 810 frames, 300 are there"));
}
