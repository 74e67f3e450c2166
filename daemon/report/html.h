#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace opaline::daemon::html {

/// Text as it may stand between tags and in attributes.
std::string escaped(std::string_view text);

/// RFC 4648.
std::string base64(std::span<const std::byte> bytes);

/// <figure> with a picture inside the page (PNG) and a caption; `pixelated` keeps cells square.
std::string picture(std::span<const std::byte> png,
                    std::string_view caption,
                    bool pixelated = false);

/// <figure> with an SVG element and a caption; `caption` is text.
std::string drawing(std::string_view svg, std::string_view caption);

/// A table of names and values, both text.
std::string facts(const std::vector<std::pair<std::string, std::string>>& rows);

/// A table with a header; the first column is text, the others are numbers, or the last is text too.
std::string table(const std::vector<std::string>& header,
                  const std::vector<std::vector<std::string>>& rows,
                  bool last_is_text = false);

/// <section> with a heading; `body` is HTML.
std::string section(std::string_view id, std::string_view title, std::string_view body);

std::string paragraph(std::string_view text);
/// A paragraph that stands out: something is missing.
std::string warning(std::string_view text);

/// A whole page with its style; `body` is HTML.
std::string page(std::string_view title, std::string_view body);

}  // namespace opaline::daemon::html
