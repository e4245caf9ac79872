#include "server/telemetry/http_message.h"

#include <algorithm>
#include <cctype>
#include <optional>

namespace shaped::server {
namespace {

const char* reasonOf(int status) {
  switch (status) {
    case 200:
      return "OK";
    case 400:
      return "Bad Request";
    case 404:
      return "Not Found";
    case 405:
      return "Method Not Allowed";
    case 431:
      return "Request Header Fields Too Large";
    case 500:
      return "Internal Server Error";
    case 503:
      return "Service Unavailable";
    case 505:
      return "HTTP Version Not Supported";
    default:
      return "Unknown";
  }
}

bool isPrintable(std::string_view text) {
  return std::all_of(text.begin(), text.end(), [](unsigned char c) { return c > 0x20 && c < 0x7f; });
}

/// Takes the text up to a separator, and the separator, off the front; nothing when there is none.
std::optional<std::string_view> take(std::string_view& text, std::string_view separator) {
  const auto at = text.find(separator);
  if (at == text.npos) return std::nullopt;
  const auto taken = text.substr(0, at);
  text.remove_prefix(at + separator.size());
  return taken;
}

bool equalIgnoringCase(std::string_view a, std::string_view b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(),
                    [](unsigned char x, unsigned char y) { return std::tolower(x) == std::tolower(y); });
}

/// Whether every line is "name: value", and there is a Host where HTTP/1.1 wants one.
bool fieldsAreSound(std::string_view fields, bool wants_host) {
  bool has_host = false;
  while (const auto line = take(fields, "\r\n")) {
    if (line->empty()) break;
    const auto colon = line->find(':');
    if (colon == line->npos || colon == 0 || !isPrintable(line->substr(0, colon))) return false;
    has_host |= equalIgnoringCase(line->substr(0, colon), "host");
  }
  return has_host || !wants_host;
}

HttpResponse plain(int status, const std::string& text) { return {status, "text/plain; charset=utf-8", text + "\n"}; }

/// What stands in the head, or the answer that refuses it.
std::optional<HttpResponse> refusalOf(std::string_view head, HttpRequest& request) {
  const auto method = take(head, " "), target = take(head, " "), version = take(head, "\r\n");
  if (!method || !target || !version || method->empty() || !isPrintable(*method) || !isPrintable(*target) ||
      !target->starts_with('/'))
    return plain(400, "the request line is not \"GET /path HTTP/1.1\"");
  if (*version != "HTTP/1.1" && *version != "HTTP/1.0")
    return plain(version->starts_with("HTTP/") ? 505 : 400, "want HTTP/1.1");
  if (!fieldsAreSound(head, *version == "HTTP/1.1"))
    return plain(400, "a header field is malformed, or Host is missing");
  request = {std::string(*method), std::string(target->substr(0, target->find('?')))};
  if (request.method != "GET" && request.method != "HEAD") return plain(405, "want GET or HEAD");
  return std::nullopt;
}

HttpResponse guarded(const HttpRequest& request, const HttpHandler& handler) {
  try {
    return handler(request);
  } catch (const std::exception& error) {
    return plain(500, error.what());
  }
}

}  // namespace

std::size_t endOfHead(std::string_view received) {
  const auto at = received.find("\r\n\r\n");
  return at == received.npos ? at : at + 4;
}

std::string answerTo(std::string_view head, const HttpHandler& handler) {
  HttpRequest request;
  if (const auto refusal = refusalOf(head, request)) return wireText(*refusal, true);
  return wireText(guarded(request, handler), request.method != "HEAD");
}

std::string wireText(const HttpResponse& response, bool with_body) {
  std::string text = "HTTP/1.1 " + std::to_string(response.status) + " " + reasonOf(response.status) + "\r\n";
  if (response.status == 405) text += "Allow: GET, HEAD\r\n";
  text += "Content-Type: " + response.content_type + "\r\nContent-Length: " + std::to_string(response.body.size()) +
          "\r\nConnection: close\r\n\r\n";
  return with_body ? text + response.body : text;
}

}  // namespace shaped::server
