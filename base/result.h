#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <tl/expected.hpp>
#include <utility>

namespace opaline {

/// What a caller can do about an error.
enum class ErrorCode : std::uint8_t {
  kInvalidArgument,  ///< the request is wrong; sending it again will not help
  kNotFound,         ///< a named thing does not exist
  kBusy,             ///< somebody else holds it; try later
  kTimeout,          ///< a deadline passed
  kCancelled,        ///< stopped because somebody asked
  kUnavailable,      ///< a device, disk or peer is not there (any more)
  kInternal,         ///< our fault
};

/// The code's stable lower-case name, as in logs and on the wire: "invalid_argument".
constexpr std::string_view to_string(ErrorCode code) {
  switch (code) {
    case ErrorCode::kInvalidArgument:
      return "invalid_argument";
    case ErrorCode::kNotFound:
      return "not_found";
    case ErrorCode::kBusy:
      return "busy";
    case ErrorCode::kTimeout:
      return "timeout";
    case ErrorCode::kCancelled:
      return "cancelled";
    case ErrorCode::kUnavailable:
      return "unavailable";
    case ErrorCode::kInternal:
      return "internal";
  }
  return "internal";
}

/// What happened, for people, and what can be done about it, for the caller.
struct [[nodiscard]] Error {
  ErrorCode code = ErrorCode::kInternal;
  std::string message;

  /// The same error with where it happened put in front: "exposure 3 of 7: frame not ready".
  Error in(std::string_view where) const {
    std::string text(where);
    text += ": ";
    text += message;
    return {code, std::move(text)};
  }
};

inline Error invalid_argument(std::string message) {
  return {ErrorCode::kInvalidArgument, std::move(message)};
}
inline Error not_found(std::string message) { return {ErrorCode::kNotFound, std::move(message)}; }
inline Error busy(std::string message) { return {ErrorCode::kBusy, std::move(message)}; }
inline Error timeout(std::string message) { return {ErrorCode::kTimeout, std::move(message)}; }
inline Error cancelled(std::string message) { return {ErrorCode::kCancelled, std::move(message)}; }
inline Error unavailable(std::string message) {
  return {ErrorCode::kUnavailable, std::move(message)};
}
inline Error internal_error(std::string message) {
  return {ErrorCode::kInternal, std::move(message)};
}

/// A value or an Error: what every call returns that can fail for reasons outside the program.
template <class T>
class [[nodiscard]] Result : public tl::expected<T, Error> {
  using Base = tl::expected<T, Error>;

 public:
  using Base::Base;
  // NOLINTNEXTLINE(google-explicit-constructor): `return timeout(...)` is the point of it
  Result(Error error) : Base(tl::unexpected<Error>(std::move(error))) {}
};

/// Success, for calls that return nothing: `return ok();`
inline Result<void> ok() { return {}; }

}  // namespace opaline
