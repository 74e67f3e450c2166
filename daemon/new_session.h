#pragma once

#include <string>

namespace opaline::daemon {

/// A wish for a session, as it came in.
struct NewSession {
  std::string name;  ///< for people; empty: the configuration's
  std::string session_toml;
  std::string rig_toml;
  std::string resolved_toml;  ///< both with every default filled in; empty: to be worked out
  bool same_user = false;     ///< of this user's own socket, who may name any file
};

}  // namespace opaline::daemon
