#include "core/io/npy.h"

#include <catch2/catch.hpp>
#include <cmath>

#include "core/io/byte_reader.h"
#include "core/io/frames.h"
#include "core/numerics/error.h"
#include "tests/support/real_data.h"
#include "tests/support/temporary_folder.h"

using namespace shaped;
using Catch::Contains;

namespace {

/// A .npy file as NumPy would write it, with any dictionary text.
std::string npy(const std::string& dictionary, const std::string& data, int version = 1) {
  std::string bytes("\x93NUMPY", 6);
  bytes += static_cast<char>(version);
  bytes += '\0';
  if (version == 1)
    appendNumber(bytes, static_cast<std::uint16_t>(dictionary.size()), std::endian::little);
  else
    appendNumber(bytes, static_cast<std::uint32_t>(dictionary.size()), std::endian::little);
  return bytes + dictionary + data;
}

std::string dictionary(const std::string& type, const std::string& shape) {
  return "{'descr': '" + type + "', 'fortran_order': False, 'shape': " + shape + ", }      \n";
}

template <class Number>
std::string data(std::initializer_list<double> values, std::endian order = std::endian::little) {
  std::string bytes;
  for (const double value : values) appendNumber(bytes, static_cast<Number>(value), order);
  return bytes;
}

std::vector<Vertices> someFrames() {
  std::vector<Vertices> frames;
  for (int i = 0; i < 5; ++i) frames.push_back(Eigen::MatrixXf::Random(7, 3).cast<double>());
  return frames;
}

}  // namespace

TEST_CASE("npy numbers of every type and byte order come back as doubles") {
  const test::TemporaryFolder folder;
  const std::vector<double> expected{1, -2, 3};
  const auto read = [&](const std::string& bytes) { return readNpy(folder.file("a.npy", bytes)).values; };
  CHECK(read(npy(dictionary("<f8", "(3,)"), data<double>({1, -2, 3}))) == expected);
  CHECK(read(npy(dictionary(">f8", "(3,)"), data<double>({1, -2, 3}, std::endian::big))) == expected);
  CHECK(read(npy(dictionary("<f4", "(3,)"), data<float>({1, -2, 3}), 2)) == expected);
  CHECK(read(npy(dictionary(">f4", "(3,)"), data<float>({1, -2, 3}, std::endian::big), 3)) == expected);
  CHECK(read(npy(dictionary("|i1", "(3,)"), data<std::int8_t>({1, -2, 3}))) == expected);
  CHECK(read(npy(dictionary("<i2", "(3,)"), data<std::int16_t>({1, -2, 3}))) == expected);
  CHECK(read(npy(dictionary(">i4", "(3, 1)"), data<std::int32_t>({1, -2, 3}, std::endian::big))) == expected);
  CHECK(read(npy(dictionary("<i8", "(1, 3)"), data<std::int64_t>({1, -2, 3}))) == expected);
  CHECK(read(npy(dictionary("<u2", "()"), data<std::uint16_t>({65535}))) == std::vector<double>{65535});
  CHECK(read(npy(dictionary("|u1", "(0, 3)"), "")).empty());
}

TEST_CASE("npy keys may stand in any order and layout") {
  const test::TemporaryFolder folder;
  const auto text = "{\"shape\":(2,1),'fortran_order':False ,  'descr': '<f4'}";
  CHECK(readNpy(folder.file("a.npy", npy(text, data<float>({4, 5})))).shape == std::vector<std::int64_t>{2, 1});
}

TEST_CASE("npy arrays read back exactly what was written") {
  const test::TemporaryFolder folder;
  const std::vector<double> doubles{0.1, -1e300, 3, 4, 5, 6};
  writeNpy(folder / "a.npy", {2, 3}, std::span<const double>(doubles));
  CHECK(readNpy(folder / "a.npy").values == doubles);
  CHECK(readNpy(folder / "a.npy").shape == std::vector<std::int64_t>{2, 3});
  const std::vector<std::int32_t> integers{-5, 7};
  writeNpy(folder / "b.npy", {2}, std::span<const std::int32_t>(integers));
  CHECK(readNpy(folder / "b.npy").values == std::vector<double>{-5, 7});
  const std::vector<float> floats{0.5F};
  writeNpy(folder / "c.npy", {}, std::span<const float>(floats));
  CHECK(readNpy(folder / "c.npy").values == std::vector<double>{0.5});
  CHECK_THROWS_WITH(writeNpy(folder / "d.npy", {3}, std::span<const float>(floats)),
                    Contains("needs 3 values, 1 are given"));
  CHECK(test::bytesOf(folder / "a.npy").size() % 64 == 48);  // the numbers begin at a multiple of 64
}

TEST_CASE("a wanted npy shape is checked") {
  const test::TemporaryFolder folder;
  const auto path = folder.file("a.npy", npy(dictionary("<f4", "(1, 2)"), data<float>({1, 2})));
  CHECK_NOTHROW(readNpy(path, std::array<std::int64_t, 2>{-1, 2}));
  CHECK_THROWS_WITH(readNpy(path, std::array<std::int64_t, 2>{-1, 3}), Contains("a.npy: is 1 x 2; want n x 3"));
  CHECK_THROWS_WITH(readNpy(path, std::array<std::int64_t, 1>{2}), Contains("a.npy: is 1 x 2; want 2"));
}

TEST_CASE("faulty npy files are refused with the file and the reason") {
  const test::TemporaryFolder folder;
  struct Case {
    std::string bytes, error;
  };
  const std::string two = data<float>({1, 2});
  const std::vector<Case> cases{
      {"", "is empty"},
      {"PK\3\4", "is no .npy file"},
      {npy("", "", 9), "format version 9"},
      {npy(dictionary("<f4", "(3,)"), two), "has 8 bytes of numbers, but its shape (3,) of 4-byte numbers needs 12"},
      {npy(dictionary("<f4", "(1,)"), two), "has 8 bytes of numbers, but its shape (1,)"},
      {npy(dictionary("<f4", "(9223372036854775807, 9223372036854775807)"), two), "needs more than 2^63"},
      {npy(dictionary("<f4", "(4294967296, 4294967296)"), two), "needs more than 2^63"},
      {npy(dictionary("<f4", "(99999999999999999999,)"), two), "a shape that is no tuple of whole numbers"},
      {npy(dictionary("<f4", "(-2,)"), two), "a shape that is no tuple of whole numbers"},
      {npy(dictionary("<f4", "(2"), two), "a shape that is no tuple of whole numbers"},
      {npy(dictionary("<c8", "(1,)"), two), "holds numbers of type '<c8'"},
      {npy(dictionary("f4", "(2,)"), two), "holds numbers of type 'f4'"},
      {npy("{'descr': [('x', '<f4')], 'fortran_order': False, 'shape': (2,)}", two), "holds records"},
      {npy("{'descr': '<f4', 'fortran_order': True, 'shape': (2,)}", two), "is stored column by column"},
      {npy("{'descr': '<f4', 'fortran_order': 0, 'shape': (2,)}", two), "neither True nor False"},
      {npy("{'descr': '<f4', 'shape': (2,)}", two), "lacks descr, fortran_order or shape"},
      {npy("{'descr': '<f4', 'colour': 'red'}", two), "unknown key 'colour'"},
      {npy("{'descr': '<f4", two), "has a header with an open string"},
      {npy("", two), "has a header without '{'"},
      {npy("{", two), "has a header without a string"},
      {npy(dictionary("<f4", "(2,)") + "x", two), "has text after the dictionary"},
      {npy(dictionary("<f4", "(2,)"), two).substr(0, 40), "is truncated"}};
  for (const auto& [bytes, error] : cases) {
    INFO(error);
    const auto path = folder.file("a.npy", bytes);
    CHECK_THROWS_AS(readNpy(path), InvalidInput);
    CHECK_THROWS_WITH(readNpy(path), Contains("a.npy: ") && Contains(error));
  }
}

TEST_CASE("an npy file cut anywhere is refused") {
  const test::TemporaryFolder folder;
  const auto whole = npy(dictionary("<f4", "(1, 2, 3)"), data<float>({1, 2, 3, 4, 5, 6}));
  REQUIRE(readFrames(folder.file("whole.npy", whole)).size() == 1);
  for (std::size_t size = 0; size < whole.size(); ++size) {
    const auto path = folder.file("cut.npy", whole.substr(0, size));
    CHECK_THROWS_AS(readNpy(path), InvalidInput);
    CHECK_THROWS_AS(readFrames(path), InvalidInput);
  }
}

TEST_CASE("frames read back exactly what was written") {
  const test::TemporaryFolder folder;
  const auto frames = someFrames();
  writeFrames(folder / "f.npy", frames);
  CHECK(readFrames(folder / "f.npy") == frames);
  const FrameReader reader(folder / "f.npy");
  CHECK(reader.frameCount() == 5);
  CHECK(reader.vertexCount() == 7);
  CHECK(reader.frame(3) == frames[3]);
  CHECK_THROWS_WITH(reader.frame(5), Contains("f.npy: has no frame 5; it has 5"));
  CHECK(readNpy(folder / "f.npy").shape == std::vector<std::int64_t>{5, 7, 3});
}

TEST_CASE("a frame writer leaves nothing behind before it is closed, and keeps the older file") {
  const test::TemporaryFolder folder;
  const auto frames = someFrames();
  folder.file("f.npy", "older");
  {
    FrameWriter writer(folder / "f.npy");
    writer.append(frames[0]);
    CHECK_THROWS_WITH(writer.append(frames[1].topRows(3)), Contains("frames[1]: has 3 vertices, want 7"));
  }
  CHECK(test::bytesOf(folder / "f.npy") == "older");
  CHECK(std::distance(std::filesystem::directory_iterator(folder.path()), {}) == 1);
  CHECK_THROWS_WITH(writeFrames(folder / "f.npy", {}), Contains("f.npy: no frames to write"));
}

TEST_CASE("frames that are not finite are named, or kept where missing points are allowed") {
  const test::TemporaryFolder folder;
  auto frames = someFrames();
  frames[2](4, 1) = std::nan("");
  writeFrames(folder / "f.npy", frames);
  CHECK_THROWS_WITH(readFrames(folder / "f.npy"), Contains("f.npy: frame 2, vertex 4"));
  const FrameReader reader(folder / "f.npy");
  CHECK(std::isnan(reader.frame(2, true)(4, 1)));
}

TEST_CASE("arrays of another shape are no frames") {
  const test::TemporaryFolder folder;
  for (const auto& [shape, count] :
       {std::pair{"(6,)", 6}, {"(2, 3)", 6}, {"(3, 1, 2)", 6}, {"(0, 2, 3)", 0}, {"(2, 0, 3)", 0}})
    CHECK_THROWS_WITH(FrameReader(folder.file("a.npy", npy(dictionary("|i1", shape), std::string(count, '\1')))),
                      Contains("a.npy: is not of shape n x V x 3"));
}

TEST_CASE("real sequences read with the counts their READMEs give") {
  if (const auto path = test::realData("posed_body/coarse_1k/poses_f32.npy")) {
    const auto frames = readFrames(*path);
    CHECK(frames.size() == 72);
    CHECK(frames.front().rows() == 1250);
  }
}
