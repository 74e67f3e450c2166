#pragma once

#include <condition_variable>
#include <functional>
#include <mutex>
#include <nlohmann/json.hpp>
#include <stop_token>
#include <string>
#include <vector>

#include "base/files.h"
#include "base/result.h"
#include "render/scene/scene.h"

namespace opaline::daemon {

/// What is wished of an object that is shown live (live_object.h), over its socket or in its scene file, until it is drawn.
/// The file has what is wished before it is answered.
///
/// Threads: answer() on the socket's, the rest on the one that draws.
class ObjectWishes {
 public:
  struct Step {
    enum class Kind : std::uint8_t { kEdit, kUndo, kRedo };
    Kind kind = Kind::kEdit;
    render::EditOptions stroke{};  ///< of kEdit
  };
  /// What has changed since the last one was taken.
  struct Batch {
    bool is_changed = false;    ///< false: there is a message alone
    bool is_new_scene = false;  ///< the file was changed by somebody else: `steps` come after that
    std::vector<Step> steps;
    render::Scene scene;  ///< as it is now, camera and lights as wished
    std::size_t undoable = 0;
    std::size_t redoable = 0;
    std::string message;  ///< what is wrong with the file; empty: nothing
  };

  /// Reads the scene file. `files` outlives us. Errors: those of load_scene().
  static Result<std::unique_ptr<ObjectWishes>> create(FileOperations& files,
                                                      std::filesystem::path file);

  /// Answers a request: edit, undo, redo, look, shine.
  nlohmann::json answer(const nlohmann::json& request);
  /// Waits, not much longer than `patience`, for something to draw; none: nothing was wished.
  std::optional<Batch> take(std::chrono::milliseconds patience, const std::stop_token& stop);

 private:
  ObjectWishes(FileOperations& files, std::filesystem::path file)
      : files_(files), file_(std::move(file)) {}
  // Under mutex_.
  Result<render::Scene> parsed(const std::string& text) const;
  Result<void> read_file();
  Result<void> perform(const std::string& command, const nlohmann::json& request);
  Result<void> edit(const nlohmann::json& stroke);
  Result<void> undo();
  Result<void> redo();
  Result<void> look(const nlohmann::json& request);
  Result<void> shine(const nlohmann::json& request);
  Result<void> become(const std::string& text);

  FileOperations& files_;
  std::filesystem::path file_;
  std::mutex mutex_;
  std::condition_variable_any wished_;
  std::string text_;               // guarded by mutex_, as all that follows: what the file says
  std::string refused_;            // what it says with a mistake, told once
  std::vector<std::string> done_;  // strokes at the end of text_, from the socket
  std::vector<std::string> undone_;
  Batch next_;
  bool is_wished_ = true;  // the first picture
};

}  // namespace opaline::daemon
