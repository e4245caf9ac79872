#pragma once

#include <atomic>
#include <chrono>
#include <list>
#include <string>
#include <thread>

#include "server/telemetry/http_message.h"

namespace shaped::server {

struct HttpLimits {
  std::size_t head_bytes = 8192;                ///< of a request, >= 1
  std::size_t connections = 64;                 ///< at a time, >= 1; one more takes the place of the oldest
  std::chrono::milliseconds read_time{5000};    ///< from accepting a connection to the end of its request
  std::chrono::milliseconds write_time{10000};  ///< for the answer
  std::chrono::milliseconds linger_time{1000};  ///< for the client to close after it
};

/// A small HTTP server for scrapes and health checks: one thread, which never waits for one client; one request a
/// connection. Clients that send nothing, too much or too slowly, or do not read, lose their connection and disturb
/// nobody. Destruction does not wait for clients.
class HttpListener {
 public:
  /// address: "HOST:PORT" or "[IPv6]:PORT", port 0 for any free one. handler: called on the listener's thread; must be
  /// quick. Throws InvalidInput naming `option` when it cannot listen there.
  HttpListener(const std::string& option, const std::string& address, HttpHandler handler, HttpLimits limits = {});
  ~HttpListener();
  HttpListener(const HttpListener&) = delete;
  HttpListener& operator=(const HttpListener&) = delete;

  /// The address in use, with the real port.
  const std::string& address() const { return address_; }

 private:
  using Clock = std::chrono::steady_clock;

  /// A descriptor that closes itself.
  class Descriptor {
   public:
    explicit Descriptor(int number = -1) : number_(number) {}
    Descriptor(Descriptor&& other) noexcept : number_(other.number_) { other.number_ = -1; }
    Descriptor& operator=(Descriptor&& other) noexcept;
    ~Descriptor();
    int get() const { return number_; }

   private:
    int number_;
  };

  enum class Phase { kReading, kWriting, kLingering, kOver };

  struct Connection {
    Descriptor socket;
    Phase phase = Phase::kReading;
    Clock::time_point deadline;
    std::string received;
    std::string answer;
    std::size_t sent = 0;
  };

  void listen(const std::string& option, const std::string& host, const std::string& port);
  void serve();
  int timeout() const;
  void acceptAll();
  void react(Connection& connection);
  void read(Connection& connection);
  void beginAnswer(Connection& connection, std::string answer);
  void write(Connection& connection);
  void linger(Connection& connection);

  const HttpHandler handler_;
  const HttpLimits limits_;
  std::string address_;
  Descriptor listening_, wake_;
  std::list<Connection> connections_;  // oldest first
  std::atomic<bool> stopping_{false};
  std::thread thread_;
};

}  // namespace shaped::server
