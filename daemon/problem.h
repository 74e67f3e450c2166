#pragma once

#include <string_view>

#include "base/result.h"
#include "daemon/http_message.h"

namespace opaline::daemon {

/// The one table from codes to HTTP: invalid 400, not found 404, busy 409, unavailable 503,
/// timeout 504, internal 500.
int http_status(ErrorCode code);

/// An error as application/problem+json (RFC 9457): {"title","status","code","detail"}; `code` is
/// stable and for programs, `detail` is for people.
HttpResponse problem(const Error& error);
HttpResponse problem(int status, std::string_view code, std::string_view detail);

}  // namespace opaline::daemon
