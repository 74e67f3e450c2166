#pragma once

#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "daemon/artefacts.h"

namespace opaline::daemon {

/// A request as the routes see it; its size is bounded by the server.
struct HttpRequest {
  std::string method;
  std::vector<std::string> path;               ///< pieces between slashes, percent-decoded
  std::map<std::string, std::string> query;    ///< decoded
  std::map<std::string, std::string> headers;  ///< names in lower case
  std::string body;
  bool same_user = false;  ///< came over the Unix socket, which only this user can open
};

/// A response that goes on as things happen.
class TextStream {
 public:
  virtual ~TextStream() = default;
  /// What has come since the last call; asked a few times a second.
  virtual std::string next() = 0;
  /// Nothing will come any more.
  virtual bool is_over() const = 0;
};

struct HttpResponse {
  int status = 200;
  std::string content_type = "application/json";
  std::string body;
  std::vector<std::pair<std::string, std::string>> headers;
  std::optional<OpenArtefact> file;    ///< sent in place of the body
  std::unique_ptr<TextStream> stream;  ///< sent in place of the body, until it is over
};

}  // namespace opaline::daemon
