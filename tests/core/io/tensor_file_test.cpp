#include "core/io/tensor_file.h"

#include <catch2/catch.hpp>

#include "core/io/byte_reader.h"
#include "core/io/file.h"
#include "core/io/sha256.h"
#include "core/numerics/error.h"
#include "tests/support/temporary_folder.h"

using namespace shaped;
using Catch::Contains;

namespace {

/// A safetensors file with any header.
std::string tensors(const std::string& header, const std::string& data) {
  std::string bytes;
  appendNumber(bytes, static_cast<std::uint64_t>(header.size()), std::endian::little);
  return bytes + header + data;
}

/// Blanks so that the data begin at a multiple of eight.
std::string padded(std::string header) {
  header.resize((header.size() + 7) / 8 * 8, ' ');
  return header;
}

}  // namespace

TEST_CASE("SHA-256 equals the published digests, in one piece and in many") {
  CHECK(sha256("") == "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855");
  CHECK(sha256("abc") == "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
  Sha256 hash;
  for (int i = 0; i < 1000; ++i) hash.update(std::string(1000, 'a'));
  CHECK(hash.finish() == "cdc76e5c9914fb9281a1c7e284d73e67f1809a48a497200e046d39ccc7112cd0");
}

TEST_CASE("tensors of every type read back exactly, as views into the file") {
  const test::TemporaryFolder folder;
  const std::vector<double> doubles{0.1, -2, 1e300, 4, 5, 6};
  const std::vector<float> floats{0.5F};
  const std::vector<std::int32_t> ints{-7, 8, 9};
  const std::vector<std::int64_t> longs{std::int64_t{1} << 60};
  Eigen::MatrixXd columns(2, 3);  // stored column by column
  columns << 1, 2, 3, 4, 5, 6;
  TensorWriter writer;
  writer.add("ints", {3}, std::span<const std::int32_t>(ints));
  writer.add("doubles", {2, 3}, std::span<const double>(doubles));
  writer.add("floats", {}, std::span<const float>(floats));
  writer.add("longs", {1, 1}, std::span<const std::int64_t>(longs));
  writer.add("nothing", {0, 3}, std::span<const double>());
  writer.addMatrix("columns", columns);
  writer.write(folder / "a.safetensors");
  const TensorFile file(folder / "a.safetensors");
  CHECK(file.names() == std::vector<std::string>{"columns", "doubles", "floats", "ints", "longs", "nothing"});
  CHECK(std::ranges::equal(file.values<double>("doubles"), doubles));
  CHECK(std::ranges::equal(file.values<float>("floats"), floats));
  CHECK(std::ranges::equal(file.values<std::int32_t>("ints"), ints));
  CHECK(std::ranges::equal(file.values<std::int64_t>("longs"), longs));
  CHECK(file.values<double>("nothing").empty());
  CHECK(file.matrix<double>("columns", 2, -1) == columns);
  CHECK(file.shape("doubles") == std::vector<std::int64_t>{2, 3});
  CHECK(file.type("longs") == TensorType::kInt64);
  const auto* view = reinterpret_cast<const char*>(file.values<double>("doubles").data());
  CHECK(view > file.bytes().data());
  CHECK(view < file.bytes().data() + file.bytes().size());
}

TEST_CASE("a tensor asked for by another name, type or shape is an error that says so") {
  const test::TemporaryFolder folder;
  TensorWriter writer;
  writer.addMatrix("mean", Eigen::MatrixXd::Zero(2, 3));
  writer.write(folder / "a");
  const TensorFile file(folder / "a");
  CHECK_THROWS_WITH(file.values<double>("median"), Contains("a: has no tensor 'median'"));
  CHECK_THROWS_WITH(file.values<float>("mean"), Contains("a: tensor 'mean' holds F64, want F32"));
  CHECK_THROWS_WITH(file.matrix<double>("mean", 3), Contains("a: tensor 'mean' is 2 x 3, want 3 x n"));
  CHECK_THROWS_WITH(file.requireShape("mean", {6}), Contains("a: tensor 'mean' is 2 x 3, want 6"));
}

TEST_CASE("what would be no tensor file is not written") {
  TensorWriter writer;
  const std::vector<double> two{1, 2};
  const std::span<const double> values(two);
  writer.add("a", {2}, values);
  CHECK_THROWS_WITH(writer.add("a", {2}, values), Contains("tensors: two are called 'a'"));
  CHECK_THROWS_WITH(writer.add("", {2}, values), Contains("no tensor can be called ''"));
  CHECK_THROWS_WITH(writer.add("\xff", {2}, values), Contains("no tensor can be called"));
  CHECK_THROWS_WITH(writer.add("__metadata__", {2}, values), Contains("no tensor can be called '__metadata__'"));
  CHECK_THROWS_WITH(writer.add("b", {3}, values), Contains("'b' has 2 numbers, which is not 3"));
  CHECK_THROWS_WITH(writer.add("b", {-1, -2}, values), Contains("'b' has 2 numbers, which is not n x n"));
}

TEST_CASE("files of other safetensors writers are read, with metadata and blanks") {
  const test::TemporaryFolder folder;
  std::string data;
  appendNumber(data, 2.5F, std::endian::little);
  const auto header =
      padded(R"( {"__metadata__": {"format": "np"}, "x": {"shape": [1], "dtype": "F32", "data_offsets": [0, 4]}})");
  const TensorFile file(folder.file("a", tensors(header, data)));
  CHECK(file.values<float>("x")[0] == 2.5F);
  CHECK(file.metadata().at("format") == "np");
  CHECK(TensorFile(folder.file("b", tensors("{}", ""))).names().empty());
}

TEST_CASE("faulty tensor files are refused with the file and the reason") {
  const test::TemporaryFolder folder;
  const auto one = [](const std::string& description) {
    return tensors(padded("{\"x\": " + description + "}"), std::string(8, '\1'));
  };
  const std::string x = R"("x": {"dtype": "F32", "shape": [1], "data_offsets": [0, 4]})";
  struct Case {
    std::string bytes, error;
  };
  const std::vector<Case> cases{
      {"", "is empty"},
      {"1234", "is truncated: 8 bytes wanted"},
      {tensors("{}", "").substr(0, 9), "its header should have 2 bytes, 1 are there"},
      {std::string(16, '\xff'), "its header should have 18446744073709551615 bytes"},
      {tensors("[]", ""), "has a header that is no JSON object"},
      {tensors("{", ""), "has a header that is no JSON"},
      {tensors("{\"a\": \"\xff\"}", ""), "has a header that is no JSON"},
      {tensors(std::string(100000, '['), ""), "has a header that is no JSON"},
      {tensors("{\"__metadata__\": 3}", ""), "has metadata that are no object"},
      {tensors("{\"__metadata__\": {\"a\": 3}}", ""), "has metadata 'a' that are no text"},
      {tensors(padded("{" + x + "," + x + "}"), "1234"), "has 'x' twice in its header"},
      {tensors("{}", "1234"), "has 4 bytes that belong to no tensor"},
      {one("3"), "tensor 'x' is not described by dtype, shape and data_offsets alone"},
      {one(R"({"dtype": "F32", "shape": [2]})"), "is not described"},
      {one(R"({"dtype": "F32", "shape": [2], "data_offsets": [0, 8], "more": 1})"), "is not described"},
      {one(R"({"dtype": 4, "shape": [2], "data_offsets": [0, 8]})"), "is not described"},
      {one(R"({"dtype": "F32", "shape": [2.0], "data_offsets": [0, 8]})"), "is not described"},
      {one(R"({"dtype": "F32", "shape": [-2], "data_offsets": [0, 8]})"), "is not described"},
      {one(R"({"dtype": "F32", "shape": [2], "data_offsets": [0]})"), "is not described"},
      {one(R"({"dtype": "F32", "shape": [2], "data_offsets": [0, 18446744073709551615]})"), "is not described"},
      {one(R"({"dtype": "BF16", "shape": [4], "data_offsets": [0, 8]})"),
       "has dtype 'BF16'; want F64, F32, I64 or I32"},
      {one(R"({"dtype": "F32", "shape": [2], "data_offsets": [8, 0]})"), "reaches from byte 8 to 0 of 8"},
      {one(R"({"dtype": "F32", "shape": [3], "data_offsets": [0, 12]})"), "reaches from byte 0 to 12 of 8"},
      {one(R"({"dtype": "F32", "shape": [3], "data_offsets": [0, 8]})"), "has 8 bytes, which is not 3 of F32"},
      {one(R"({"dtype": "F32", "shape": [4611686018427387905, 4], "data_offsets": [0, 4]})"),
       "has 4 bytes, which is not"},
      {one(R"({"dtype": "F32", "shape": [1], "data_offsets": [4, 8]})"), "has a hole at byte 0"},
      {one(R"({"dtype": "F32", "shape": [1], "data_offsets": [0, 4]})"), "has 4 bytes that belong to no tensor"},
      {one(R"({"dtype": "F32", "shape": [1], "data_offsets": [2, 6]})"), "is not aligned to its numbers"},
      {one(x.substr(5) + R"(, "y": {"dtype": "F32", "shape": [2], "data_offsets": [0, 8]})"), "overlap at byte 0"},
      {tensors(R"({"x": {"dtype": "F32", "shape": [1], "data_offsets": [0, 4]}})", "1234"), "is not aligned"}};
  for (const auto& [bytes, error] : cases) {
    INFO(bytes.substr(0, 200));
    const auto path = folder.file("a", bytes);
    CHECK_THROWS_AS(TensorFile(path), InvalidInput);
    CHECK_THROWS_WITH(TensorFile(path), Contains("a: ") && Contains(error));
  }
  CHECK_THROWS_WITH(TensorFile(folder / "none"), Contains("none: cannot be opened"));
  CHECK_THROWS_WITH(TensorFile(folder.path()), Contains("is not a regular file"));
}

TEST_CASE("a tensor file cut or damaged anywhere never crashes, and a cut one is refused") {
  const test::TemporaryFolder folder;
  TensorWriter writer;
  writer.addMatrix("mean", Eigen::MatrixXd::Random(4, 3));
  writer.addMatrix("faces", Eigen::MatrixXi::Zero(4, 3));
  writer.write(folder / "whole");
  const auto whole = readFile(folder / "whole");
  for (std::size_t size = 1; size < whole.size(); ++size)
    CHECK_THROWS_AS(TensorFile(folder.file("cut", whole.substr(0, size))), InvalidInput);
  for (std::size_t at = 0; at < whole.size() - 100; ++at)
    for (const char byte : {'\0', '9', '\xff', '"'}) {
      auto damaged = whole;
      damaged[at] = byte;
      const auto path = folder.file("damaged", damaged);
      try {
        const TensorFile file(path);
        for (const auto& name : file.names()) REQUIRE(file.shape(name).size() <= 3);
      } catch (const InvalidInput&) {
      }
    }
}

TEST_CASE("a tensor file is read through in pieces that make up the whole, and one that was cut is an error") {
  const test::TemporaryFolder folder;
  const auto path = folder.path() / "large.safetensors";
  TensorWriter writer;
  std::vector<double> numbers(20 * (std::size_t{1} << 17) + 77);  // 20 MiB and a bit
  for (std::size_t i = 0; i < numbers.size(); ++i) numbers[i] = static_cast<double>(i);
  writer.add("numbers", {std::ssize(numbers)}, std::span<const double>(numbers));
  writer.write(path);
  const TensorFile file(path);
  std::string all;
  std::size_t pieces = 0;
  file.readThrough([&](std::string_view piece) { all += piece, ++pieces; });
  CHECK(all == file.bytes());
  CHECK(pieces == 11);

  // Kernels before 5.14 would end us here by a signal.
  std::size_t read = 0;
  std::filesystem::resize_file(path, std::size_t{6} << 20);
  CHECK_THROWS_WITH(file.readThrough([&](std::string_view piece) { read += piece.size(); }),
                    Catch::Contains("cannot be read from the disk at byte 6291456"));
  CHECK(read == std::size_t{6} << 20);
}
