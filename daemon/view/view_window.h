#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "base/image.h"
#include "base/result.h"

namespace opaline::daemon {

struct ViewWindowOptions {
  std::string title = "Opaline";
  int width = 1280;
  int height = 800;
  std::string device;       ///< part of a Vulkan device's name; empty: the best that can present
  bool validation = false;  ///< Khronos' validation layer
  std::function<void(std::string_view)>
      on_validation_message;  ///< nobody there: they go to the log
};

/// A window on Vulkan, by GLFW, with Dear ImGui over a picture. The only file that sees GLFW's and Vulkan's headers for it is
/// its source; Dear ImGui's calls may be made between begin() and present().
///
///   (begin, present)*    present() makes the swapchain anew when the window's size has changed
///
/// Threads: the main thread only. One window a process.
/// Errors:  kUnavailable without a display, a driver or a device that presents, or when it is lost: make another window then;
///          kTimeout when the device does not answer within ten seconds.
class ViewWindow {
 public:
  static Result<std::unique_ptr<ViewWindow>> create(const ViewWindowOptions& options);
  ~ViewWindow();
  ViewWindow(const ViewWindow&) = delete;
  ViewWindow& operator=(const ViewWindow&) = delete;

  bool wants_to_close() const;
  /// Hears what the window system has to say; waits up to so many seconds for it.
  void listen(double seconds);
  /// In pixels; nothing while the window is minimised.
  struct Size {
    int width = 0;
    int height = 0;
  };
  std::optional<Size> size() const;
  void resize(int width, int height);
  void minimise();
  void restore();
  std::string device() const;

  /// Starts a frame of the user interface.
  void begin();
  /// Shows a picture of 4 channels, stretched over the window, and the user interface above it; `seen`, where given, gets what
  /// the window shows, red green blue. False: the window is minimised, or its size changes: nothing was shown.
  Result<bool> present(const Image<std::uint8_t>& picture, Image<std::uint8_t>* seen);

 private:
  struct State;
  explicit ViewWindow(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace opaline::daemon
