#include "daemon/http_access.h"

#include <algorithm>
#include <array>
#include <string_view>

#include "daemon/problem.h"

namespace opaline::daemon {
namespace {

std::string_view header(const HttpRequest& request, const char* name) {
  const auto it = request.headers.find(name);
  return it == request.headers.end() ? std::string_view() : std::string_view(it->second);
}

bool is_loopback_host(std::string_view host) {
  const std::size_t colon = host.starts_with('[') ? host.find("]:") : host.rfind(':');
  if (colon != std::string_view::npos)
    host = host.substr(0, host.starts_with('[') ? colon + 1 : colon);
  constexpr std::array<std::string_view, 3> kNames{"localhost", "127.0.0.1", "[::1]"};
  return std::ranges::find(kNames, host) != kNames.end();
}

// Takes as long wherever they differ.
bool same_secret(std::string_view a, std::string_view b) {
  unsigned difference = a.size() == b.size() ? 0 : 1;
  for (std::size_t i = 0; i < a.size(); ++i) {
    difference |= static_cast<unsigned char>(a[i]) ^
                  static_cast<unsigned char>(b.empty() ? '\0' : b[i % b.size()]);
  }
  return difference == 0;
}

}  // namespace

std::optional<HttpResponse> refuse(const HttpRequest& request, const std::string& token) {
  if (request.same_user) return std::nullopt;
  const std::string_view host = header(request, "host");
  if (!token.empty()) {
    if (!same_secret(header(request, "authorization"), "Bearer " + token)) {
      HttpResponse response = problem(401, "unauthorized", "expected the daemon's token");
      response.headers.emplace_back("WWW-Authenticate", "Bearer");
      return response;
    }
  } else if (!is_loopback_host(host)) {
    return problem(403, "forbidden", "this host name is not served");
  }
  const std::string_view origin = header(request, "origin");
  if (!origin.empty() && origin != "http://" + std::string(host)) {
    return problem(403, "forbidden", "requests of other sites are not served");
  }
  return std::nullopt;
}

}  // namespace opaline::daemon
