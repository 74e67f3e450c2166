#pragma once

#include <span>
#include <string>
#include <variant>
#include <vector>

#include "base/result.h"

namespace opaline::daemon {

/// One thing that `opaline view --do` does, in place of a hand:
///
///   orbit RIGHT UP | zoom FACTOR | pan RIGHT UP | light NUMBER RIGHT UP | exposure STOPS      degrees; shares of the height
///   paint X Y | stroke X Y X Y | brush NAME VALUE | undo | redo | save OBJECT FILE.vdb           X, Y 0 to 1 in the window
///   bend OBJECT AMOUNT | tolerance VALUE
///   resize WIDTH HEIGHT | minimise | restore | lose | wait FRAMES | screenshot FILE.png
struct ViewAction {
  std::string verb;
  std::vector<std::string> words;
  double number(std::size_t word) const;  ///< of a word that is one
};

/// Errors: kInvalidArgument for an unknown verb, a wrong number of words, or a word that is no number where one is due.
Result<ViewAction> parse_view_action(const std::string& text);

}  // namespace opaline::daemon
