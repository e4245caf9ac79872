#include "core/io/marker_file.h"

#include <catch2/catch.hpp>
#include <cmath>

#include "core/io/marker_csv.h"
#include "core/io/trc.h"
#include "core/numerics/error.h"
#include "tests/support/c3d_writer.h"
#include "tests/support/temporary_folder.h"

using namespace shaped;
using Catch::Contains;

namespace {

const double nan_value = std::nan("");

MarkerTrial smallTrial() {
  MarkerTrial trial{{"Anna:LFWT", "RFWT"}, 100, {Vertices(2, 3), Vertices(2, 3)}};
  trial.frames[0] << 0.1, -1.0 / 3, 1e-3, nan_value, nan_value, nan_value;
  trial.frames[1] << nan_value, nan_value, nan_value, 1, 2, 3;
  return trial;
}

void checkSame(const MarkerTrial& a, const MarkerTrial& b, double tolerance) {
  REQUIRE(a.frames.size() == b.frames.size());
  for (std::size_t f = 0; f < a.frames.size(); ++f) {
    REQUIRE(a.frames[f].rows() == b.frames[f].rows());
    CHECK((a.frames[f].array().isNaN() == b.frames[f].array().isNaN()).all());
    CHECK((a.frames[f] - b.frames[f]).unaryExpr([](double x) { return std::isnan(x) ? 0 : std::abs(x); }).maxCoeff() <=
          tolerance);
  }
}

const std::string trc_head =
    "PathFileType\t4\t(X/Y/Z)\twalk.trc\r\nDataRate\tCameraRate\tNumFrames\tNumMarkers\tUnits\tOrigDataRate\r\n"
    "60.00\t60\t2\t2\tcm\t60\r\nFrame#\tTime\tA b\t\t\tB\t\t\r\n\t\tX1\tY1\tZ1\tX2\tY2\tZ2\r\n\r\n";

}  // namespace

TEST_CASE("marker files read back what was written") {
  const test::TemporaryFolder folder;
  const auto trial = smallTrial();
  for (const auto& [name, tolerance] : {std::pair{"a.csv", 0.0}, {"a.trc", 1e-15}, {"a.npy", 1e-7}, {"A.CSV", 0.0}}) {
    INFO(name);
    writeMarkers(folder / name, trial);
    const auto back = readMarkers(folder / name, trial.labels);
    checkSame(back, trial, tolerance);
    CHECK(back.labels == trial.labels);
    CHECK(back.rate_hz == (std::string(name) == "a.npy" ? 0 : 100));
  }
  checkSame(readMarkers(folder.file("a.c3d", test::formatC3d(trial))), trial, 1e-7);
  CHECK_THROWS_WITH(readMarkers(folder / "a.bvh"), Contains("a.bvh: holds no markers by its extension '.bvh'"));
  CHECK_THROWS_WITH(writeMarkers(folder / "a.c3d", trial), Contains("a.c3d: cannot be written as '.c3d'"));
}

TEST_CASE("an npy trial needs as many labels as it has markers") {
  const test::TemporaryFolder folder;
  writeMarkers(folder / "a.npy", smallTrial());
  CHECK_THROWS_WITH(readMarkers(folder / "a.npy"), Contains("a.npy: has 2 markers a frame, but 0 labels are given"));
}

TEST_CASE("markers that a file could not hold are not written") {
  const test::TemporaryFolder folder;
  auto trial = smallTrial();
  trial.labels[1] = "a,b";
  CHECK_THROWS_WITH(writeMarkers(folder / "a.csv", trial), Contains("a.csv: cannot hold the label 'a,b'"));
  trial = smallTrial();
  for (const char* label : {"", "a\tb", "a\n", "\fa", "a\x7f", " a", "a ", "#a", "a\"b"}) {
    trial.labels[0] = label;
    for (const char* name : {"a.csv", "a.trc"})
      CHECK_THROWS_WITH(writeMarkers(folder / name, trial), Contains("cannot hold the label"));
  }
  trial = smallTrial();
  trial.frames[1] = Vertices::Zero(3, 3);
  CHECK_THROWS_WITH(writeMarkers(folder / "a.csv", trial), Contains("frames[1]: has 3 markers, want 2"));
  CHECK_THROWS_WITH(writeMarkers(folder / "a.csv", {}), Contains("a.csv: no markers to write"));
  CHECK(std::filesystem::is_empty(folder.path()));
}

TEST_CASE("z up turns to y up by a rotation") {
  MarkerTrial trial{{"A", "B", "C"}, 0, {Vertices(3, 3)}};
  trial.frames[0] << 1, 2, 3, nan_value, nan_value, nan_value, 0, 0, 1;
  turnZUpToYUp(trial);
  CHECK(trial.frames[0].row(0) == Eigen::RowVector3d(1, 3, -2));
  CHECK(std::isnan(trial.frames[0](1, 2)));
  CHECK(trial.frames[0].row(2) == Eigen::RowVector3d(0, 1, 0));
}

TEST_CASE("TRC reads units, blanks, zeros and labels with blanks") {
  const auto trial = parseTrc("a.trc", trc_head + "1\t0.0\t100\t200\t300\t\t\t\r\n2\t0.016\t0\t0\t0\t4\t5\t6\t\r\n");
  CHECK(trial.labels == std::vector<std::string>{"A b", "B"});
  CHECK(trial.rate_hz == 60);
  REQUIRE(trial.frames.size() == 2);
  CHECK(trial.frames[0].row(0) == Eigen::RowVector3d(1, 2, 3));
  CHECK(trial.frames[0].row(1).array().isNaN().all());
  CHECK(trial.frames[1].row(0).array().isNaN().all());
  CHECK(trial.frames[1](1, 2) == Approx(0.06));
}

TEST_CASE("faulty TRC files are refused with file and line") {
  struct Case {
    std::string text, error;
  };
  const auto replaced = [](std::string text, const std::string& what, const std::string& with) {
    return text.replace(text.find(what), what.size(), with);
  };
  const std::string rows = "1\t0\t1\t2\t3\t4\t5\t6\n2\t0\t1\t2\t3\t4\t5\t6\n", whole = trc_head + rows;
  REQUIRE(parseTrc("a.trc", whole).frames.size() == 2);
  const std::vector<Case> cases{
      {"frame,x\n", "a.trc:1: a TRC file begins with 'PathFileType'"},
      {"PathFileType\n", "a.trc: is truncated: ends before the names of its header"},
      {replaced(whole, "\tcm\t", "\tell\t"), "a.trc:3: Units is 'ell'"},
      {replaced(whole, "NumFrames", "Frames"), "a.trc:3: the header has no value for NumFrames"},
      {replaced(whole, "60\t2\t2", "60\ttwo\t2"), "a.trc:3: 'two' is not a whole number"},
      {replaced(whole, "60\t2\t2", "60\t2\t0"), "a.trc:3: NumFrames and NumMarkers must be"},
      {replaced(whole, "60\t2\t2", "60\t2\t3"), "a.trc:4: has 2 labels"},
      {replaced(whole, "60\t2\t2", "60\t9\t2"), "a.trc: promises 9 frames (NumFrames), but 2"},
      {replaced(whole, "60\t2\t2", "60\t1\t2"), "a.trc: promises 1 frames (NumFrames), but 2"},
      {replaced(whole, "Frame#", "Bild"), "a.trc:4: the line of the labels begins with"},
      {replaced(whole, "2\t0\t1", "x\t0\t1"), "a.trc:8: 'x' is not a whole number"},
      {replaced(whole, "5\t6\n2", "5\ts\n2"), "a.trc:7: 's' is not a number; want a coordinate of 'B'"},
      {replaced(whole, "5\t6\n2", "5\n2"), "a.trc:7: marker 'B' has finite and missing"},
      {replaced(whole, "5\t6\n2", "5\tinf\n2"), "a.trc:7: marker 'B' has finite and missing"},
      {replaced(whole, "5\t6\n2", "5\t6\t7\n2"), "a.trc:7: has 7 coordinates, want 6 for 2 markers"}};
  for (const auto& [text, error] : cases) {
    INFO(text);
    CHECK_THROWS_AS(parseTrc("a.trc", text), InvalidInput);
    CHECK_THROWS_WITH(parseTrc("a.trc", text), Contains(error));
  }
}

TEST_CASE("marker CSV reads units, rate, time and missing markers") {
  const auto trial =
      parseMarkerCsv("a.csv",
                     "\xef\xbb\xbf# walk, second take\n# units: mm\n\nframe,time,A_x,A_y,A_z,B_x,B_y,B_z\n"
                     "7,0.5,1000,2000,3000,,,\n# pause\n8,0.75,nan,nan,nan,4, 5 ,6\n");
  CHECK(trial.labels == std::vector<std::string>{"A", "B"});
  CHECK(trial.rate_hz == 4);
  REQUIRE(trial.frames.size() == 2);
  CHECK(trial.frames[0].row(0) == Eigen::RowVector3d(1, 2, 3));
  CHECK(trial.frames[0].row(1).array().isNaN().all());
  CHECK(trial.frames[1].row(0).array().isNaN().all());
  CHECK(trial.frames[1](1, 1) == Approx(0.005));
  CHECK(parseMarkerCsv("a.csv", "# rate: 30\nframe,A_x,A_y,A_z\n1,0,0,0\n").rate_hz == 30);
}

TEST_CASE("short rows under many labels do not make gigabytes of a small file") {
  constexpr int labels = 2000, rows = 10000;
  std::string trc_labels, csv = "frame", trc_rows;
  for (int l = 0; l < labels; ++l) trc_labels += "\ta\t\t", csv += ",a_x,a_y,a_z";
  csv += "\n";
  for (int r = 0; r < rows; ++r) csv += std::to_string(r) + "\n", trc_rows += "1\n";
  const std::string trc = "PathFileType\nDataRate\tNumFrames\tNumMarkers\tUnits\n1\t10000\t2000\tmm\nFrame#\tTime" +
                          trc_labels + "\n\n" + trc_rows;
  CHECK_THROWS_WITH(parseMarkerCsv("a.csv", csv), Contains("leave out more than 16777216 fields"));
  CHECK_THROWS_WITH(parseTrc("a.trc", trc), Contains("leave out more than 16777216 fields"));
}

TEST_CASE("a rate that the times of a marker CSV do not determine is unknown") {
  CHECK(parseMarkerCsv("a.csv", "frame,time,A_x,A_y,A_z\n1,0,1,2,3\n2,5e-324,1,2,3\n").rate_hz == 0);
  CHECK(parseMarkerCsv("a.csv", "frame,time,A_x,A_y,A_z\n1,0,1,2,3\n").rate_hz == 0);
}

TEST_CASE("faulty marker CSV files are refused with file and line") {
  struct Case {
    std::string text, error;
  };
  const std::string head = "frame,A_x,A_y,A_z\n";
  const std::vector<Case> cases{{"# nothing\n", "a.csv: has no header line"},
                                {head, "a.csv: has no frames"},
                                {"A_x,A_y,A_z\n", "a.csv:1: the first column is 'A_x'; want 'frame'"},
                                {"frame\n", "a.csv:1: want label_x, label_y, label_z columns"},
                                {"frame,A_x,A_z,A_y\n", "a.csv:1: column 3 is 'A_z'"},
                                {"frame,A_x,B_y,A_z\n", "a.csv:1: column 3 is 'B_y'"},
                                {"frame,_x,_y,_z\n", "a.csv:1: column 2 is '_x'"},
                                {"frame,A_x,A_y\n", "a.csv:1: want label_x"},
                                {"# units: ells\n" + head, "a.csv:1: units are 'ells'"},
                                {"# rate: -3\n" + head, "a.csv:1: the rate must be a positive number"},
                                {"# rate: fast\n" + head, "a.csv:1: 'fast' is not a number"},
                                {head + "1,0,0,0\n3,0,0,0\n", "a.csv:3: frame 3 follows frame 1"},
                                {head + "one,0,0,0\n", "a.csv:2: 'one' is not a whole number"},
                                {head + "1,0,zero,0\n", "a.csv:2: 'zero' is not a number; want a coordinate of 'A'"},
                                {head + "1,0,0\n", "a.csv:2: marker 'A' has finite and missing"},
                                {head + "1,0,0,0,0\n", "a.csv:2: has 4 coordinates, want 3"},
                                {"frame,time,A_x,A_y,A_z\n1\n", "a.csv:2: nothing stands where the time in seconds"}};
  for (const auto& [text, error] : cases) {
    INFO(text);
    CHECK_THROWS_AS(parseMarkerCsv("a.csv", text), InvalidInput);
    CHECK_THROWS_WITH(parseMarkerCsv("a.csv", text), Contains(error));
  }
}
