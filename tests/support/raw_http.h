#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <string>

#include "base/file_descriptor.h"

namespace opaline::testing {

/// A response, as far as a test looks at it.
struct HttpReply {
  int status = 0;                              ///< 0: the server closed without an answer
  std::map<std::string, std::string> headers;  ///< names in lower case
  std::string body;                            ///< not de-chunked
  nlohmann::json json() const { return nlohmann::json::parse(body, nullptr, false); }
};

FileDescriptor connect_tcp(std::uint16_t port);

/// Sends the bytes as they are, and reads until the server closes or ten seconds pass.
std::string converse(const FileDescriptor& connection, const std::string& bytes);

HttpReply parse_reply(const std::string& text);

/// One request with "Connection: close".
std::string request_text(const std::string& method,
                         const std::string& target,
                         const std::string& body = "",
                         const std::string& extra_headers = "");

}  // namespace opaline::testing
