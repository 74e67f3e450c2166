#include "daemon/report/html.h"

#include <fmt/format.h>

namespace opaline::daemon::html {
namespace {

constexpr std::string_view kStyle = R"css(
:root { color-scheme: light dark; --ink: #1d2228; --paper: #ffffff; --card: #f4f5f7; --line: #d9dde2; --soft: #5b6570;
        --accent: #0b6e8f; }
@media (prefers-color-scheme: dark) {
  :root { --ink: #e4e7ea; --paper: #15181c; --card: #1e2227; --line: #343a41; --soft: #9aa4ae; --accent: #5cc3e4; } }
* { box-sizing: border-box; }
body { margin: 0; background: var(--paper); color: var(--ink); font: 16px/1.55 system-ui, "Segoe UI", Roboto, "DejaVu Sans",
       sans-serif; }
main { max-width: 1080px; margin: 0 auto; padding: 2.5rem 1.25rem 4rem; }
header p { color: var(--soft); margin: .2rem 0 0; }
h1 { font-size: 2rem; line-height: 1.2; margin: 0; letter-spacing: -.01em; }
h2 { font-size: 1.35rem; margin: 0 0 .6rem; padding-top: 2.4rem; }
h3 { font-size: 1rem; margin: 1.6rem 0 .4rem; }
nav { display: flex; flex-wrap: wrap; gap: 0 1.1rem; margin: 1.2rem 0 0; font-size: .92rem; }
nav a { color: var(--accent); text-decoration: none; }
nav a:hover { text-decoration: underline; }
.figures { display: grid; grid-template-columns: repeat(auto-fit, minmax(150px, 1fr)); gap: .8rem; margin: 1.4rem 0; }
.figure { background: var(--card); border-radius: 10px; padding: .9rem 1rem; }
.figure b { display: block; font-size: 1.7rem; line-height: 1.15; font-weight: 650; font-variant-numeric: tabular-nums; }
.figure span { color: var(--soft); font-size: .86rem; line-height: 1.35; display: block; margin-top: .25rem; }
figure { margin: 0; min-width: 0; }
figure img { display: block; width: 100%; height: auto; border-radius: 6px; }
figure img.cells { image-rendering: pixelated; }
figcaption { color: var(--soft); font-size: .85rem; line-height: 1.4; padding: .35rem 0 0; }
.trio { display: grid; grid-template-columns: repeat(3, 1fr); gap: .8rem; margin: .5rem 0 1.5rem; }
.sheet { display: grid; grid-template-columns: repeat(auto-fill, minmax(140px, 1fr)); gap: .7rem; }
.plot { overflow-x: auto; margin: .7rem 0 1.2rem; }
.plot svg { display: block; max-width: 100%; height: auto; }
svg [color="black"] { color: inherit; }
svg [stroke="black"] { stroke: currentColor; }
svg [fill="black"] { fill: currentColor; }
svg image { image-rendering: pixelated; }
svg text, svg tspan { font-family: inherit; }
table { border-collapse: collapse; font-size: .92rem; font-variant-numeric: tabular-nums; margin: .4rem 0 1rem; }
th, td { padding: .3rem 1.1rem .3rem 0; text-align: left; vertical-align: top; border-bottom: 1px solid var(--line); }
table.numbers td + td, table.numbers th + th { text-align: right; }
table.told td:last-child, table.told th:last-child { text-align: left; }
th { font-weight: 600; }
.wide { overflow-x: auto; }
pre { background: var(--card); border-radius: 8px; padding: 1rem; overflow-x: auto; font: .8rem/1.45 ui-monospace,
      "DejaVu Sans Mono", monospace; }
summary { cursor: pointer; color: var(--accent); }
.warn { border-left: 4px solid #c77700; padding: .1rem 0 .1rem .9rem; }
footer { color: var(--soft); font-size: .85rem; margin-top: 3rem; border-top: 1px solid var(--line); padding-top: .8rem; }
@media print { body { font-size: 11px; } main { max-width: none; padding: 0; } nav { display: none; }
  section, figure, .trio, .figure { break-inside: avoid; } h2 { padding-top: 1.2rem; } details { display: none; } }
)css";

std::string row(const std::vector<std::string>& cells, std::string_view tag) {
  std::string text = "<tr>";
  for (const std::string& cell : cells) text += fmt::format("<{0}>{1}</{0}>", tag, escaped(cell));
  return text + "</tr>\n";
}

}  // namespace

std::string escaped(std::string_view text) {
  std::string out;
  for (const char c : text) {
    switch (c) {
      case '&':
        out += "&amp;";
        break;
      case '<':
        out += "&lt;";
        break;
      case '>':
        out += "&gt;";
        break;
      case '"':
        out += "&quot;";
        break;
      default:
        out += c;
    }
  }
  return out;
}

std::string base64(std::span<const std::byte> bytes) {
  constexpr std::string_view kDigits =
      "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  text.reserve((bytes.size() + 2) / 3 * 4);
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    unsigned group = 0;
    for (std::size_t j = 0; j < 3; ++j) {
      group = group << 8 | (i + j < bytes.size() ? std::to_integer<unsigned>(bytes[i + j]) : 0U);
    }
    for (std::size_t j = 0; j < 4; ++j) {
      text += i + j <= bytes.size() ? kDigits[group >> (18 - 6 * j) & 63U] : '=';
    }
  }
  return text;
}

std::string picture(std::span<const std::byte> png, std::string_view caption, bool pixelated) {
  return fmt::format(
      "<figure><img{} alt=\"{}\" "
      "src=\"data:image/png;base64,{}\"><figcaption>{}</figcaption></figure>\n",
      pixelated ? " class=\"cells\"" : "",
      escaped(caption),
      base64(png),
      escaped(caption));
}

std::string drawing(std::string_view svg, std::string_view caption) {
  return fmt::format(
      "<figure class=\"plot\">{}<figcaption>{}</figcaption></figure>\n", svg, escaped(caption));
}

std::string facts(const std::vector<std::pair<std::string, std::string>>& rows) {
  std::string text = "<div class=\"wide\"><table>\n";
  for (const auto& [name, value] : rows) {
    text += fmt::format("<tr><th>{}</th><td>{}</td></tr>\n", escaped(name), escaped(value));
  }
  return text + "</table></div>\n";
}

std::string table(const std::vector<std::string>& header,
                  const std::vector<std::vector<std::string>>& rows,
                  bool last_is_text) {
  std::string text = fmt::format("<div class=\"wide\"><table class=\"numbers{}\">\n{}",
                                 last_is_text ? " told" : "",
                                 row(header, "th"));
  for (const auto& cells : rows) text += row(cells, "td");
  return text + "</table></div>\n";
}

std::string section(std::string_view id, std::string_view title, std::string_view body) {
  return fmt::format("<section id=\"{}\">\n<h2>{}</h2>\n{}</section>\n", id, escaped(title), body);
}

std::string paragraph(std::string_view text) { return fmt::format("<p>{}</p>\n", escaped(text)); }

std::string warning(std::string_view text) {
  return fmt::format("<p class=\"warn\">{}</p>\n", escaped(text));
}

std::string page(std::string_view title, std::string_view body) {
  return fmt::format(
      "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n"
      "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n"
      "<title>{}</title>\n<style>{}</style>\n</head>\n<body>\n<main>\n{}</main>\n</body>\n</"
      "html>\n",
      escaped(title),
      kStyle,
      body);
}

}  // namespace opaline::daemon::html
