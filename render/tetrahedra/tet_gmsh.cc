#include <unordered_map>
#include <vector>

#include "render/tetrahedra/tet_formats.h"

namespace opaline::render {
namespace {

constexpr int kGmshTetrahedron = 4;

/// What a file has told so far; nodes are called by tags, which may leave numbers out.
class GmshReader {
 public:
  explicit GmshReader(std::string_view text) : scanner_(text), bytes_(text.size()) {}

  Result<TetMesh> read() {
    for (auto word = scanner_.next_word(); !word.empty(); word = scanner_.next_word()) {
      Result<void> done = ok();
      if (word == "$MeshFormat") done = format();
      if (word == "$Nodes") done = version_ < 4 ? nodes() : blocks_of_nodes();
      if (word == "$Elements") done = version_ < 4 ? elements() : blocks_of_elements();
      if (!done) return done.error();
    }
    return std::move(mesh_);
  }

 private:
  Result<void> format() {
    const auto version = scanner_.next_number<double>("a version");
    if (!version) return version.error();
    const auto binary = scanner_.next_number<int>("0 for text, 1 for binary");
    if (!binary) return binary.error();
    version_ = static_cast<int>(*version);
    if (*binary != 0) return invalid_argument("a binary file; write it as text (Mesh.Binary = 0)");
    if (*version != 2.2 && *version != 4.1) {
      return invalid_argument(fmt::format("version {}; 2.2 and 4.1 are read", *version));
    }
    scanner_.skip_words();
    return ok();
  }

  Result<void> node(long tag) {
    const auto point = scanner_.next_point();
    if (!point) return point.error();
    numbers_[tag] = static_cast<int>(mesh_.vertices.size());
    mesh_.vertices.push_back(*point);
    scanner_.skip_words();
    return ok();
  }

  Result<void> nodes() {
    const auto count = next_count(scanner_, "nodes", bytes_);
    if (!count) return count.error();
    for (long n = 0; n < *count; ++n) {
      const auto tag = scanner_.next_number<long>("a node's number");
      if (!tag) return tag.error();
      if (auto read = node(*tag); !read) return read;
    }
    return ok();
  }

  Result<void> blocks_of_nodes() {
    const auto blocks = next_count(scanner_, "blocks", bytes_);
    if (!blocks) return blocks.error();
    scanner_.skip_words();
    for (long b = 0; b < *blocks; ++b) {
      for (int k = 0; k < 3; ++k) scanner_.next_word();  // dimension, entity, parametric
      const auto count = next_count(scanner_, "nodes", bytes_);
      if (!count) return count.error();
      std::vector<long> tags;
      for (long n = 0; n < *count; ++n) {
        const auto tag = scanner_.next_number<long>("a node's number");
        if (!tag) return tag.error();
        tags.push_back(*tag);
      }
      for (const long tag : tags) {
        if (auto read = node(tag); !read) return read;
      }
    }
    return ok();
  }

  Result<void> tet() {
    std::array<int, 4> corners{};
    for (int& corner : corners) {
      const auto tag = scanner_.next_number<long>("a node's number");
      if (!tag) return tag.error();
      const auto found = numbers_.find(*tag);
      if (found == numbers_.end()) {
        return invalid_argument(fmt::format("line {}: no node {}", scanner_.line(), *tag));
      }
      corner = found->second;
    }
    mesh_.tets.push_back(corners);
    return ok();
  }

  Result<void> elements() {
    const auto count = next_count(scanner_, "elements", bytes_);
    if (!count) return count.error();
    for (long e = 0; e < *count; ++e) {
      scanner_.next_word();  // its number
      const auto type = scanner_.next_number<int>("an element's type");
      if (!type) return type.error();
      const auto tags = scanner_.next_number<int>("how many tags follow");
      if (!tags) return tags.error();
      for (int k = 0; k < *tags && *type == kGmshTetrahedron; ++k) scanner_.next_word();
      if (*type == kGmshTetrahedron) {
        if (auto read = tet(); !read) return read;
      }
      scanner_.skip_words();
    }
    return ok();
  }

  Result<void> blocks_of_elements() {
    const auto blocks = next_count(scanner_, "blocks", bytes_);
    if (!blocks) return blocks.error();
    scanner_.skip_words();
    for (long b = 0; b < *blocks; ++b) {
      for (int k = 0; k < 2; ++k) scanner_.next_word();  // dimension, entity
      const auto type = scanner_.next_number<int>("an element's type");
      if (!type) return type.error();
      const auto count = next_count(scanner_, "elements", bytes_);
      if (!count) return count.error();
      for (long e = 0; e < *count; ++e) {
        scanner_.next_word();  // its number
        if (*type == kGmshTetrahedron) {
          if (auto read = tet(); !read) return read;
        }
        scanner_.skip_words();
      }
    }
    return ok();
  }

  TextScanner scanner_;
  std::size_t bytes_;
  int version_ = 2;
  std::unordered_map<long, int> numbers_;
  TetMesh mesh_;
};

}  // namespace

Result<TetMesh> decode_gmsh(std::string_view text) { return GmshReader(text).read(); }

}  // namespace opaline::render
