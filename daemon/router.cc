#include "daemon/router.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <charconv>
#include <utility>

#include "daemon/problem.h"

namespace opaline::daemon {
namespace {

std::optional<std::string> decoded(std::string_view text) {
  std::string result;
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (text[i] != '%') {
      result += text[i];
      continue;
    }
    if (i + 2 >= text.size()) return std::nullopt;
    unsigned value = 0;
    const char* begin = text.data() + i + 1;
    const auto [end, error] = std::from_chars(begin, begin + 2, value, 16);
    if (error != std::errc() || end != begin + 2) return std::nullopt;
    result += static_cast<char>(value);
    i += 2;
  }
  return result;
}

std::vector<std::string_view> split(std::string_view text, char separator) {
  std::vector<std::string_view> pieces;
  for (;;) {
    const std::size_t end = text.find(separator);
    pieces.push_back(text.substr(0, end));
    if (end == std::string_view::npos) return pieces;
    text.remove_prefix(end + 1);
  }
}

// What the braces stand for; nothing when the path does not fit.
std::optional<Router::Parameters> match(const std::vector<std::string>& pattern,
                                        const std::vector<std::string>& path) {
  Router::Parameters parameters;
  for (std::size_t i = 0; i < pattern.size(); ++i) {
    if (i >= path.size()) return std::nullopt;
    if (pattern[i].ends_with("...}")) {
      parameters.push_back(fmt::format(
          "{}", fmt::join(path.begin() + static_cast<std::ptrdiff_t>(i), path.end(), "/")));
      return parameters;
    }
    if (pattern[i].starts_with('{')) {
      parameters.push_back(path[i]);
    } else if (pattern[i] != path[i]) {
      return std::nullopt;
    }
  }
  return pattern.size() == path.size() ? std::optional(std::move(parameters)) : std::nullopt;
}

}  // namespace

void Router::add(std::string method, std::string_view pattern, Handler handler) {
  routes_.push_back({std::move(method), *split_path(pattern), std::move(handler)});
}

HttpResponse Router::handle(const HttpRequest& request) const {
  std::vector<std::string> allowed;
  for (const Route& route : routes_) {
    const std::optional<Parameters> parameters = match(route.pattern, request.path);
    if (!parameters) continue;
    const bool is_head = route.method == "GET" && request.method == "HEAD";
    if (is_head || route.method == request.method) return route.handler(request, *parameters);
    allowed.push_back(route.method == "GET" ? "GET, HEAD" : route.method);
  }
  if (allowed.empty()) return problem(404, "not_found", "there is no such resource");
  const std::string list = fmt::format("{}", fmt::join(allowed, ", "));
  HttpResponse response = problem(405, "method_not_allowed", "this resource takes " + list);
  response.headers.emplace_back("Allow", list);
  return response;
}

std::optional<std::vector<std::string>> split_path(std::string_view path) {
  if (!path.starts_with('/')) return std::nullopt;
  std::vector<std::string> pieces;
  for (const std::string_view raw : split(path.substr(1), '/')) {
    std::optional<std::string> piece = decoded(raw);
    if (!piece || piece->find('/') != std::string::npos || piece->find('\0') != std::string::npos) {
      return std::nullopt;
    }
    pieces.push_back(*std::move(piece));
  }
  return pieces;
}

std::map<std::string, std::string> split_query(std::string_view query) {
  std::map<std::string, std::string> result;
  for (const std::string_view pair : split(query, '&')) {
    const std::size_t equals = pair.find('=');
    const auto name = decoded(pair.substr(0, equals));
    const auto value =
        decoded(equals == std::string_view::npos ? std::string_view() : pair.substr(equals + 1));
    if (name && value && !name->empty()) result[*name] = *value;
  }
  return result;
}

}  // namespace opaline::daemon
