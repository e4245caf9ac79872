#include "server/telemetry/http_listener.h"

#include <netdb.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/eventfd.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <memory>
#include <system_error>
#include <vector>

#include "core/numerics/error.h"

namespace shaped::server {
namespace {

struct HostAndPort {
  std::string host, port;
};

HostAndPort split(const std::string& option, const std::string& address) {
  const auto colon = address.rfind(':');
  const bool bracketed = address.starts_with('[') && colon != address.npos && colon > 0 && address[colon - 1] == ']';
  if (colon == address.npos || colon == 0 || colon + 1 == address.size())
    throw InvalidInput(option, "\"" + address + "\", want HOST:PORT, for example 127.0.0.1:9464");
  const auto host = bracketed ? address.substr(1, colon - 2) : address.substr(0, colon);
  return {host, address.substr(colon + 1)};
}

using Addresses = std::unique_ptr<addrinfo, decltype(&freeaddrinfo)>;

Addresses resolve(const std::string& option, const HostAndPort& where) {
  addrinfo hints{};
  hints.ai_socktype = SOCK_STREAM;
  hints.ai_flags = AI_PASSIVE | AI_NUMERICSERV;
  addrinfo* found = nullptr;
  const int problem = getaddrinfo(where.host.c_str(), where.port.c_str(), &hints, &found);
  if (problem != 0)
    throw InvalidInput(option, "cannot listen on " + where.host + ":" + where.port + ": " + gai_strerror(problem));
  return {found, &freeaddrinfo};
}

/// The port that the system chose.
int portOf(int socket) {
  sockaddr_storage name{};
  socklen_t size = sizeof name;
  getsockname(socket, reinterpret_cast<sockaddr*>(&name), &size);
  return ntohs(name.ss_family == AF_INET6 ? reinterpret_cast<sockaddr_in6&>(name).sin6_port
                                          : reinterpret_cast<sockaddr_in&>(name).sin_port);
}

bool wouldBlock() { return errno == EAGAIN || errno == EWOULDBLOCK || errno == EINTR; }

}  // namespace

HttpListener::Descriptor& HttpListener::Descriptor::operator=(Descriptor&& other) noexcept {
  std::swap(number_, other.number_);
  return *this;
}

HttpListener::Descriptor::~Descriptor() {
  if (number_ >= 0) close(number_);
}

HttpListener::HttpListener(const std::string& option, const std::string& address, HttpHandler handler,
                           HttpLimits limits)
    : handler_(std::move(handler)), limits_(limits), wake_(eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC)) {
  const auto where = split(option, address);
  listen(option, where.host, where.port);
  address_ = address.substr(0, address.rfind(':')) + ":" + std::to_string(portOf(listening_.get()));
  thread_ = std::thread([this] { serve(); });
}

void HttpListener::listen(const std::string& option, const std::string& host, const std::string& port) {
  int problem = 0;
  const auto addresses = resolve(option, {host, port});
  for (const auto* each = addresses.get(); each; each = each->ai_next) {
    listening_ = Descriptor(socket(each->ai_family, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, each->ai_protocol));
    const int yes = 1;
    setsockopt(listening_.get(), SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes);
    if (bind(listening_.get(), each->ai_addr, each->ai_addrlen) == 0 && ::listen(listening_.get(), 128) == 0) return;
    problem = errno;
  }
  throw InvalidInput(option, "cannot listen on " + host + ":" + port + ": " + std::generic_category().message(problem));
}

HttpListener::~HttpListener() {
  stopping_ = true;
  const std::uint64_t one = 1;
  [[maybe_unused]] const auto written = ::write(wake_.get(), &one, sizeof one);
  thread_.join();
}

void HttpListener::serve() {
  std::vector<pollfd> polled;
  while (!stopping_) {
    polled.assign({{wake_.get(), POLLIN, 0}, {listening_.get(), POLLIN, 0}});
    for (const auto& connection : connections_)
      polled.push_back(
          {connection.socket.get(), static_cast<short>(connection.phase == Phase::kWriting ? POLLOUT : POLLIN), 0});
    poll(polled.data(), polled.size(), timeout());
    const auto now = Clock::now();
    auto event = polled.begin() + 2;
    for (auto& connection : connections_) {
      if ((event++)->revents != 0) react(connection);
      if (connection.deadline <= now) connection.phase = Phase::kOver;
    }
    connections_.remove_if([](const Connection& connection) { return connection.phase == Phase::kOver; });
    if (polled[1].revents != 0) acceptAll();
  }
}

/// Until the next deadline [ms]; without connections, for ever.
int HttpListener::timeout() const {
  if (connections_.empty()) return -1;
  const auto next = std::min_element(connections_.begin(), connections_.end(),
                                     [](const auto& a, const auto& b) { return a.deadline < b.deadline; });
  const auto left = std::chrono::ceil<std::chrono::milliseconds>(next->deadline - Clock::now()).count();
  return static_cast<int>(std::max<std::int64_t>(left, 0));
}

void HttpListener::acceptAll() {
  while (true) {
    Descriptor socket(accept4(listening_.get(), nullptr, nullptr, SOCK_NONBLOCK | SOCK_CLOEXEC));
    if (socket.get() < 0) {
      // Out of descriptors: the oldest makes room. Without any of ours, a pause keeps the loop from spinning.
      if (errno != EMFILE && errno != ENFILE) return;
      if (!connections_.empty()) return connections_.pop_front();
      std::this_thread::sleep_for(std::chrono::milliseconds(50));
      return;
    }
    if (connections_.size() >= limits_.connections) connections_.pop_front();
    connections_.push_back({std::move(socket), Phase::kReading, Clock::now() + limits_.read_time, {}, {}, 0});
  }
}

void HttpListener::react(Connection& connection) {
  switch (connection.phase) {
    case Phase::kReading:
      return read(connection);
    case Phase::kWriting:
      return write(connection);
    case Phase::kLingering:
      return linger(connection);
    case Phase::kOver:
      return;
  }
}

void HttpListener::read(Connection& connection) {
  std::array<char, 4096> piece;
  const auto count = recv(connection.socket.get(), piece.data(), piece.size(), 0);
  if (count < 0 && wouldBlock()) return;
  if (count <= 0) {
    connection.phase = Phase::kOver;
    return;
  }
  connection.received.append(piece.data(), static_cast<std::size_t>(count));
  const auto end = endOfHead(connection.received);
  if (std::min(end, connection.received.size()) > limits_.head_bytes)
    beginAnswer(connection, wireText({.status = 431, .body = "the request's head is too large\n"}, true));
  else if (end != std::string::npos)
    beginAnswer(connection, answerTo(std::string_view(connection.received).substr(0, end), handler_));
}

void HttpListener::beginAnswer(Connection& connection, std::string answer) {
  connection.answer = std::move(answer);
  connection.phase = Phase::kWriting;
  connection.deadline = Clock::now() + limits_.write_time;
  write(connection);
}

void HttpListener::write(Connection& connection) {
  const auto& answer = connection.answer;
  while (connection.sent < answer.size()) {
    const auto count =
        send(connection.socket.get(), answer.data() + connection.sent, answer.size() - connection.sent, MSG_NOSIGNAL);
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) {
      if (!wouldBlock()) connection.phase = Phase::kOver;
      return;
    }
    connection.sent += static_cast<std::size_t>(count);
  }
  // Closing at once with something unread would reset the connection, and the client might lose the answer.
  shutdown(connection.socket.get(), SHUT_WR);
  connection.phase = Phase::kLingering;
  connection.deadline = Clock::now() + limits_.linger_time;
}

/// Reads and forgets until the client has closed its side.
void HttpListener::linger(Connection& connection) {
  std::array<char, 4096> piece;
  const auto count = recv(connection.socket.get(), piece.data(), piece.size(), 0);
  if (count == 0 || (count < 0 && !wouldBlock())) connection.phase = Phase::kOver;
}

}  // namespace shaped::server
