#include "tests/support/file_size_limit.h"

#include <catch2/catch.hpp>
#include <csignal>

namespace shaped::test {

FileSizeLimit::FileSizeLimit(std::uint64_t bytes) : handler_before_(std::signal(SIGXFSZ, SIG_IGN)) {
  REQUIRE(::getrlimit(RLIMIT_FSIZE, &before_) == 0);
  const rlimit limit{bytes, before_.rlim_max};
  REQUIRE(::setrlimit(RLIMIT_FSIZE, &limit) == 0);
}

FileSizeLimit::~FileSizeLimit() {
  ::setrlimit(RLIMIT_FSIZE, &before_);
  std::signal(SIGXFSZ, handler_before_);
}

}  // namespace shaped::test
