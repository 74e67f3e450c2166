#include "daemon/view/view_script.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <sstream>
#include <string_view>

namespace opaline::daemon {
namespace {

/// n: a number, w: a word.
struct Verb {
  std::string_view name;
  std::string_view words;
};
constexpr std::array<Verb, 19> kVerbs{{{"orbit", "nn"},
                                       {"zoom", "n"},
                                       {"pan", "nn"},
                                       {"light", "nnn"},
                                       {"exposure", "n"},
                                       {"paint", "nn"},
                                       {"stroke", "nnnn"},
                                       {"brush", "ww"},
                                       {"undo", ""},
                                       {"redo", ""},
                                       {"save", "ww"},
                                       {"bend", "wn"},
                                       {"tolerance", "n"},
                                       {"resize", "nn"},
                                       {"minimise", ""},
                                       {"restore", ""},
                                       {"lose", ""},
                                       {"wait", "n"},
                                       {"screenshot", "w"}}};

bool reads_as_number(const std::string& word, double& value) {
  const auto [end, problem] = std::from_chars(word.data(), word.data() + word.size(), value);
  return problem == std::errc() && end == word.data() + word.size();
}

}  // namespace

double ViewAction::number(std::size_t word) const {
  double value = 0.0;
  reads_as_number(words.at(word), value);
  return value;
}

Result<ViewAction> parse_view_action(const std::string& text) {
  std::istringstream stream(text);
  ViewAction action;
  stream >> action.verb;
  for (std::string word; stream >> word;) action.words.push_back(word);
  const auto verb = std::ranges::find(kVerbs, action.verb, &Verb::name);
  if (verb == kVerbs.end()) {
    std::string all;
    for (const Verb& known : kVerbs) all += fmt::format(" {}", known.name);
    return invalid_argument(fmt::format("\"{}\": unknown; there are:{}", text, all));
  }
  if (action.words.size() != verb->words.size()) {
    return invalid_argument(fmt::format("\"{}\": {} words follow {}; expected {}",
                                        text,
                                        action.words.size(),
                                        verb->name,
                                        verb->words.size()));
  }
  for (std::size_t w = 0; w < action.words.size(); ++w) {
    double value = 0.0;
    if (verb->words[w] == 'n' && !reads_as_number(action.words[w], value)) {
      return invalid_argument(fmt::format("\"{}\": \"{}\" is no number", text, action.words[w]));
    }
  }
  return action;
}

}  // namespace opaline::daemon
