#include "server/telemetry/http_message.h"

#include <catch2/catch.hpp>

using namespace shaped::server;
using Catch::Contains;
using Catch::EndsWith;
using Catch::StartsWith;

namespace {

HttpResponse handle(const HttpRequest& request) {
  if (request.path == "/throws") throw std::runtime_error("broken");
  return {200, "text/plain", request.method + " " + request.path};
}

std::string answer(const std::string& head) { return answerTo(head, handle); }

}  // namespace

TEST_CASE("requests get the status that they deserve") {
  const std::string host = "Host: x\r\n\r\n";
  const struct {
    const char* name;
    std::string head;
    int status;
  } table[] = {
      {"a scrape", "GET /metrics HTTP/1.1\r\n" + host, 200},
      {"with fields", "GET /metrics HTTP/1.1\r\nAccept: */*\r\nhOST: x\r\nEmpty:\r\n\r\n", 200},
      {"HTTP/1.0 needs no host", "GET /metrics HTTP/1.0\r\n\r\n", 200},
      {"HTTP/1.1 does", "GET /metrics HTTP/1.1\r\n\r\n", 400},
      {"another method", "POST /metrics HTTP/1.1\r\n" + host, 405},
      {"HTTP/2's preface", "PRI * HTTP/2.0\r\n\r\n", 400},
      {"another version", "GET / HTTP/2.0\r\n" + host, 505},
      {"no version", "GET /\r\n\r\n", 400},
      {"no path", "GET http://x/ HTTP/1.1\r\n" + host, 400},
      {"two spaces", "GET  / HTTP/1.1\r\n" + host, 400},
      {"a control character", "GET /\x01 HTTP/1.1\r\n" + host, 400},
      {"a field without a colon", "GET / HTTP/1.1\r\nHost x\r\n\r\n", 400},
      {"a folded field", "GET / HTTP/1.1\r\nHost: x\r\n folded: y\r\n\r\n", 400},
      {"TLS", "\x16\x03\x01\r\n\r\n", 400},
      {"nothing", "\r\n\r\n", 400},
      {"the handler fails", "GET /throws HTTP/1.1\r\n" + host, 500},
  };
  for (const auto& row : table) {
    INFO(row.name);
    CHECK_THAT(answer(row.head), StartsWith("HTTP/1.1 " + std::to_string(row.status) + " "));
  }
}

TEST_CASE("an answer says how long it is, and HEAD gets it without its body") {
  const auto get = answer("GET /a?b=c HTTP/1.1\r\nHost: x\r\n\r\n");
  CHECK_THAT(get, Contains("\r\nContent-Length: 6\r\n") && Contains("\r\nConnection: close\r\n"));
  CHECK_THAT(get, EndsWith("\r\n\r\nGET /a"));
  CHECK_THAT(answer("HEAD /a HTTP/1.1\r\nHost: x\r\n\r\n"), Contains("Content-Length: 7\r\n") && EndsWith("\r\n\r\n"));
  CHECK_THAT(answer("PUT / HTTP/1.1\r\nHost: x\r\n\r\n"), Contains("\r\nAllow: GET, HEAD\r\n"));
}

TEST_CASE("a head ends with an empty line") {
  CHECK(endOfHead("GET / HTTP/1.1\r\nHost: x\r\n") == std::string::npos);
  CHECK(endOfHead("GET / HTTP/1.1\r\n\r\nbody") == 18);
}
