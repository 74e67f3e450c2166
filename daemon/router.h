#pragma once

#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "daemon/http_message.h"

namespace opaline::daemon {

/// Finds the handler of a request by method and path.
class Router {
 public:
  /// What the pattern's braces stood for, in order.
  using Parameters = std::vector<std::string>;
  using Handler = std::function<HttpResponse(const HttpRequest&, const Parameters&)>;

  /// `pattern`: "/v1/sessions/{id}/artefacts/{name...}"; the dots take the rest of the path.
  void add(std::string method, std::string_view pattern, Handler handler);
  /// The handler's response, for HEAD that of GET; 404 for an unknown path, 405 with Allow for another method.
  HttpResponse handle(const HttpRequest& request) const;

 private:
  struct Route {
    std::string method;
    std::vector<std::string> pattern;
    Handler handler;
  };
  std::vector<Route> routes_;
};

/// A path's pieces, percent-decoded; nothing when an escape is broken or hides a slash or a NUL.
std::optional<std::vector<std::string>> split_path(std::string_view path);
/// "a=1&b=x%20y"; what cannot be decoded is left out.
std::map<std::string, std::string> split_query(std::string_view query);

}  // namespace opaline::daemon
