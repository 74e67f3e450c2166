#include "tests/support/photograph_folder.h"

#include <fmt/format.h>

#include <span>

#include "base/ensure.h"
#include "base/files.h"
#include "base/io/image_io.h"
#include "base/sha256.h"

namespace opaline::support {
namespace {

ImageFile photograph(std::uint64_t pattern, bool long_exposure, bool as_float) {
  Image<std::uint16_t> codes(8, 6, 3);
  Image<float> light(8, 6, 3);
  for (int y = 0; y < 6; ++y) {
    for (int x = 0; x < 8; ++x) {
      for (int c = 0; c < 3; ++c) {
        const std::uint16_t code = photograph_code(pattern, long_exposure, x, y, c);
        codes.at(x, y, c) = code;
        light.at(x, y, c) = static_cast<float>(code) / 4095.0f;
      }
    }
  }
  if (as_float) return {light, {}, {}};
  return {codes, {}, {}};
}

}  // namespace

std::uint16_t photograph_code(
    std::uint64_t pattern, bool long_exposure, int x, int y, int channel) {
  const auto light = static_cast<int>(pattern) * (x + 2 * y + 3 * channel);
  return static_cast<std::uint16_t>(64 + light * (long_exposure ? 10 : 1));
}

void write_photographs(const std::filesystem::path& folder) {
  const char* const endings[] = {".png", ".tif", ".exr", ".png"};
  std::string index =
      "[camera]\nmodel = \"hand-made\"\nwidth = 8\nheight = 6\nbit_depth = 12\ncodes_per_unit = "
      "4095\n"
      "[projector]\nwidth = 80\nheight = 60\n";
  ENSURE(system_files().make_directories(folder));
  for (std::uint64_t pattern = 0; pattern < 4; ++pattern) {
    for (const bool long_exposure : {false, true}) {
      const std::string name = fmt::format(
          "pattern_{}_{}{}", pattern, long_exposure ? "long" : "short", endings[pattern]);
      const ImageFormat format = *image_format_of(name);
      const auto bytes =
          encode_image(photograph(pattern, long_exposure, format == ImageFormat::kExr), format);
      ENSURE(bytes.has_value() && system_files().write(folder / name, *bytes));
      index += fmt::format(
          "[[photograph]]\nfile = \"{}\"\npattern_id = {}\npattern = \"flat_{}\"\nexposure_s = "
          "{}\nsha256 = \"{}\"\n",
          name,
          pattern,
          pattern,
          long_exposure ? 1.0 : 0.1,
          sha256_hex(*bytes));
    }
  }
  ENSURE(system_files().write(folder / "index.toml", std::as_bytes(std::span(index))));
}

}  // namespace opaline::support
