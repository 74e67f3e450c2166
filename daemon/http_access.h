#pragma once

#include <optional>
#include <string>

#include "daemon/http_message.h"

namespace opaline::daemon {

/// Why a request is turned away (401, 403), or nothing. With a token every request over TCP needs
/// it. Without one the Host must be a loopback name, so that no foreign name that resolves to us
/// gets in (DNS rebinding). An Origin must be the Host itself: no other site's page may ask.
std::optional<HttpResponse> refuse(const HttpRequest& request, const std::string& token);

}  // namespace opaline::daemon
