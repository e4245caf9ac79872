#include "server/telemetry/http_listener.h"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <catch2/catch.hpp>
#include <deque>

#include "core/numerics/error.h"

using namespace shaped::server;
using namespace std::chrono_literals;
using Catch::Contains;
using Catch::EndsWith;
using Catch::StartsWith;

namespace {

using Clock = std::chrono::steady_clock;

constexpr char kGet[] = "GET /metrics HTTP/1.1\r\nHost: x\r\n\r\n";

HttpResponse hello(const HttpRequest&) { return {200, "text/plain", "hello"}; }

/// A client that does only what it is told.
class Client {
 public:
  explicit Client(const HttpListener& listener, int receive_buffer = 0) : socket_(::socket(AF_INET, SOCK_STREAM, 0)) {
    if (receive_buffer > 0) setsockopt(socket_, SOL_SOCKET, SO_RCVBUF, &receive_buffer, sizeof receive_buffer);
    sockaddr_in to{};
    to.sin_family = AF_INET;
    to.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    to.sin_port =
        htons(static_cast<std::uint16_t>(std::stoi(listener.address().substr(listener.address().rfind(':') + 1))));
    REQUIRE(connect(socket_, reinterpret_cast<sockaddr*>(&to), sizeof to) == 0);
  }
  ~Client() { close(socket_); }
  Client(const Client&) = delete;
  Client& operator=(const Client&) = delete;

  /// False once the other side has closed.
  bool send(const std::string& text) {
    return ::send(socket_, text.data(), text.size(), MSG_NOSIGNAL) == static_cast<ssize_t>(text.size());
  }
  void endSending() { shutdown(socket_, SHUT_WR); }
  int socket() const { return socket_; }
  /// What comes until the other side closes, or the time is up.
  std::string receive(std::chrono::milliseconds limit = 5s) {
    std::string text;
    char piece[4096];
    const auto until = Clock::now() + limit;
    while (Clock::now() < until) {
      pollfd wanted{socket_, POLLIN, 0};
      if (poll(&wanted, 1, 20) <= 0) continue;
      const auto count = recv(socket_, piece, sizeof piece, 0);
      if (count <= 0) break;
      text.append(piece, static_cast<std::size_t>(count));
    }
    return text;
  }

 private:
  int socket_;
};

/// An ordinary scrape, which must work whatever others do; its answer, empty when none comes in the time of receive().
std::string scrape(const HttpListener& listener) {
  Client client(listener);
  client.send(kGet);
  return client.receive();
}

/// For seeing that a client loses its connection.
HttpLimits quick() {
  return {.head_bytes = 1024, .connections = 8, .read_time = 300ms, .write_time = 300ms, .linger_time = 200ms};
}

/// For seeing that nobody waits for a client: a listener that did would do so for longer than any scrape here does.
HttpLimits patient() {
  return {.head_bytes = 1024, .connections = 8, .read_time = 60s, .write_time = 60s, .linger_time = 60s};
}

}  // namespace

TEST_CASE("the listener answers, one request a connection") {
  const HttpListener listener("--metrics", "127.0.0.1:0", hello);
  CHECK_THAT(listener.address(), StartsWith("127.0.0.1:"));
  CHECK(listener.address() != "127.0.0.1:0");
  for (int i = 0; i < 3; ++i)
    CHECK_THAT(scrape(listener), StartsWith("HTTP/1.1 200 OK\r\n") && EndsWith("\r\n\r\nhello"));
}

TEST_CASE("a request may come in pieces, and its sender may close his side at once") {
  const HttpListener listener("--metrics", "127.0.0.1:0", hello);
  Client slow(listener);
  for (const char c : std::string(kGet)) REQUIRE(slow.send({c}));
  slow.endSending();
  CHECK_THAT(slow.receive(), EndsWith("hello"));
  Client leaves(listener);
  leaves.send("GET /metr");
  leaves.endSending();
  const auto begin = Clock::now();
  CHECK(leaves.receive(5s).empty());
  CHECK(Clock::now() - begin < 5s);  // at once, not when its time was up
}

TEST_CASE("who never finishes a request loses the connection") {
  const HttpListener listener("--metrics", "127.0.0.1:0", hello, quick());
  Client silent(listener), slow(listener);
  const auto begin = Clock::now();
  bool open = true;
  while (open && Clock::now() - begin < 20s) {  // a field a moment, for ever
    open = slow.send("X-A: b\r\n");
    std::this_thread::sleep_for(5ms);
  }
  CHECK_FALSE(open);
  CHECK(silent.receive(20s).empty());
  CHECK(Clock::now() - begin < 20s);
}

TEST_CASE("who never finishes a request disturbs nobody") {
  const HttpListener listener("--metrics", "127.0.0.1:0", hello, patient());
  Client silent(listener), slow(listener);
  for (int i = 0; i < 20; ++i) {
    CHECK(slow.send("X-A: b\r\n"));
    CHECK_THAT(scrape(listener), EndsWith("hello"));
  }
}

TEST_CASE("a head without end is refused") {
  const HttpListener listener("--metrics", "127.0.0.1:0", hello, quick());
  Client giant(listener);
  giant.send("GET / HTTP/1.1\r\n" + std::string(1 << 20, 'x'));
  CHECK_THAT(giant.receive(), StartsWith("HTTP/1.1 431 "));
  Client large(listener);  // complete, and too large
  large.send("GET / HTTP/1.1\r\nHost: x\r\nA: " + std::string(2000, 'x') + "\r\n\r\n");
  CHECK_THAT(large.receive(), StartsWith("HTTP/1.1 431 "));
  CHECK_THAT(scrape(listener), EndsWith("hello"));
}

TEST_CASE("who does not read his answer loses the connection") {
  const std::string large(8 << 20, 'x');  // more than sockets hold
  const auto handler = [&](const HttpRequest&) { return HttpResponse{200, "text/plain", large}; };
  const HttpListener listener("--metrics", "127.0.0.1:0", handler, quick());
  // That the listener has given up cannot be seen before one reads, and then it must have; on a busy machine late.
  std::string received;
  for (auto pause = 500ms; pause <= 16s; pause *= 2) {
    Client stuck(listener, 4096);
    stuck.send(kGet);
    std::this_thread::sleep_for(pause);
    received = stuck.receive(20s);
    if (received.size() < large.size()) break;
  }
  CHECK(received.size() > 0);
  CHECK(received.size() < large.size());
}

TEST_CASE("who does not read his answer disturbs nobody, and gets it when he does") {
  const std::string large(8 << 20, 'x');
  const auto handler = [&](const HttpRequest& request) {
    return HttpResponse{200, "text/plain", request.path == "/large" ? large : "hello"};
  };
  const HttpListener listener("--metrics", "127.0.0.1:0", handler, patient());
  Client stuck(listener, 4096);
  stuck.send("GET /large HTTP/1.1\r\nHost: x\r\n\r\n");
  pollfd begun{stuck.socket(), POLLIN, 0};
  REQUIRE(poll(&begun, 1, 20000) == 1);
  CHECK_THAT(scrape(listener), EndsWith("hello"));
  CHECK(stuck.receive(60s).size() > large.size());
}

TEST_CASE("more connections than there may be: the oldest makes room") {
  const HttpListener listener("--metrics", "127.0.0.1:0", hello, patient());
  std::deque<Client> idle;
  for (int i = 0; i < 200; ++i) {
    idle.emplace_back(listener);
    if (i % 20 == 0) CHECK_THAT(scrape(listener), EndsWith("hello"));
  }
  CHECK_THAT(scrape(listener), EndsWith("hello"));
  CHECK(idle.front().receive().empty());  // closed long before its time
  idle.back().send(kGet);
  CHECK_THAT(idle.back().receive(), EndsWith("hello"));
}

TEST_CASE("the end of the listener waits for nobody") {
  auto listener = std::make_unique<HttpListener>("--metrics", "127.0.0.1:0", hello);
  Client silent(*listener), half(*listener);
  half.send("GET /");
  std::this_thread::sleep_for(50ms);
  const auto begin = Clock::now();
  listener.reset();
  CHECK(Clock::now() - begin < 4s);  // they had 5 s
  CHECK(silent.receive(1s).empty());
}

TEST_CASE("addresses that cannot be listened on are refused by name") {
  const HttpListener taken("--metrics", "127.0.0.1:0", hello);
  const auto refused = [](const std::string& address, const std::string& text) {
    CHECK_THROWS_WITH(HttpListener("--metrics", address, hello), StartsWith("--metrics: ") && Contains(text));
  };
  refused(taken.address(), "Address already in use");
  refused("9464", "want HOST:PORT");
  refused("127.0.0.1:", "want HOST:PORT");
  refused(":9464", "want HOST:PORT");
  refused("127.0.0.1:port", "cannot listen");
  refused("192.0.2.1:9464", "Cannot assign requested address");
}
