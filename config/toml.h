#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "config/fields.h"

namespace opaline::config {

/// One thing wrong in a file, and what would be right.
struct Problem {
  std::string file;
  int line = 0;  ///< 0 when it is about the file as a whole
  int column = 0;
  std::string message;
  std::string table;  ///< "sim.camera"; empty: the top of the file, or all of it
  bool operator==(const Problem&) const = default;
};

/// Whether nothing is wrong in a table or in one within it, nor in those around it, where its name
/// may have been misspelt.
bool is_sound(const std::vector<Problem>& problems, std::string_view table);

/// "sim.toml:12:9: unknown key \"colour\"; did you mean \"color\"?"
std::string to_string(const Problem& problem);
/// All of them, one a line.
std::string to_string(const std::vector<Problem>& problems);

/// A TOML text and where it comes from.
struct Source {
  std::string file;                 ///< as problems name it
  std::string text;                 ///< of the whole file
  std::filesystem::path directory;  ///< relative paths start here; empty: they are a problem
};

/// Reads a document by visiting it, and returns all that is wrong with it, in the order of the
/// file: keys nobody asked for (with the nearest known one), missing keys, wrong types, units,
/// ranges and choices. A syntax error is the only problem returned.
std::vector<Problem> read_toml(const Source& source, const Fields::Visit& visit);

/// The keys and tables at the top of a document; none when it has a syntax error.
std::vector<std::string> top_level_keys(const Source& source);

/// Writes a document by visiting it; `help` puts each key's explanation beside it.
std::string write_toml(const Fields::Visit& visit, bool help);

}  // namespace opaline::config
