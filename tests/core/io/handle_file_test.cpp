#include "core/io/handle_file.h"

#include <catch2/catch.hpp>

#include "core/numerics/error.h"
#include "tests/support/temporary_folder.h"

using namespace shaped;
using Catch::Contains;

TEST_CASE("handles read with and without a header, comments and blanks") {
  const test::TemporaryFolder folder;
  const auto handles =
      readHandles(folder.file("h.csv", "# feet\r\nvertex,x,y,z\r\n12, 0.5,-1e-3,2 # left\r\n\r\n7,1,2,3\r\n"));
  REQUIRE(handles.size() == 2);
  CHECK(handles[0].first == 12);
  CHECK(handles[0].second == Eigen::Vector3d(0.5, -1e-3, 2));
  CHECK(handles[1].first == 7);
  CHECK(parseHandles("h.csv", "0,1,2,3").size() == 1);
}

TEST_CASE("faulty handles are refused with file and line") {
  struct Case {
    std::string text, error;
  };
  const std::vector<Case> cases{{"# nothing\n", "h.csv: has no handles"},
                                {"vertex,x,y,z\n", "h.csv: has no handles"},
                                {"1,2,3\n", "h.csv:1: has 3 fields; want vertex,x,y,z"},
                                {"1,2,3,4,5\n", "h.csv:1: has 5 fields"},
                                {"\nx,1,2,3\n", "h.csv:2: 'x' is not a whole number; want the vertex"},
                                {"-1,1,2,3\n", "h.csv:1: vertex -1 is no index"},
                                {"4294967296,1,2,3\n", "h.csv:1: vertex 4294967296 is no index"},
                                {"1,1,,3\n", "h.csv:1: nothing stands where y should"},
                                {"1,1,b,3\n", "h.csv:1: 'b' is not a number; want y"},
                                {"1,1,nan,3\n", "h.csv:1: the position is not finite"},
                                {"1,1,2,3\n2,0,0,0\n1,0,0,0\n", "h.csv:3: vertex 1 already has a position in line 1"},
                                {"1,1,2,3\nvertex,x,y,z\n", "h.csv:2: 'vertex' is not a whole number"}};
  for (const auto& [text, error] : cases) {
    INFO(text);
    CHECK_THROWS_AS(parseHandles("h.csv", text), InvalidInput);
    CHECK_THROWS_WITH(parseHandles("h.csv", text), Contains(error));
  }
}
