#pragma once

#include <functional>
#include <string>
#include <string_view>

namespace shaped::server {

/// What a request asks for: as much of HTTP/1.1 as a scrape needs.
struct HttpRequest {
  std::string method;  ///< "GET"
  std::string path;    ///< "/metrics", without the query
};

struct HttpResponse {
  int status = 200;
  std::string content_type = "text/plain; charset=utf-8";
  std::string body;
};

using HttpHandler = std::function<HttpResponse(const HttpRequest&)>;

/// Where the head ends, behind its empty line; npos while it is incomplete.
std::size_t endOfHead(std::string_view received);

/// The answer to a complete head, as it goes over the wire: the handler's for a sound GET or HEAD; else 400, 405 or
/// 505. One answer a connection.
std::string answerTo(std::string_view head, const HttpHandler& handler);

/// An answer without a question: 431 for a head that is too large.
std::string wireText(const HttpResponse& response, bool with_body);

}  // namespace shaped::server
