#include "report/html.h"

#include <cctype>
#include <chrono>
#include <stdexcept>

#include <fmt/chrono.h>
#include <fmt/format.h>

#include "files/whole_file.h"
#include "report/base64.h"

namespace selvedge::report {

namespace {

constexpr const char* style_sheet = R"(
body { font-family: sans-serif; font-size: 15px; line-height: 1.45; color: #111; background: #fff;
       max-width: 980px; margin: 2em auto; padding: 0 1em; }
h1 { font-size: 1.7em; border-bottom: 2px solid #111; padding-bottom: .2em; }
h2 { font-size: 1.25em; margin-top: 1.8em; }
table { border-collapse: collapse; margin: .8em 0; font-size: .93em; }
th, td { border-bottom: 1px solid #bbb; padding: .22em .8em; text-align: left; vertical-align: top; }
th { border-bottom: 2px solid #111; }
td.number { text-align: right; font-variant-numeric: tabular-nums; }
figure { margin: 1em 0; break-inside: avoid; }
figure img, figure svg { max-width: 100%; height: auto; }
figcaption { font-size: .9em; color: #333; }
.row { display: flex; flex-wrap: wrap; gap: 10px; }
.row figure { flex: 1 1 0; min-width: 150px; margin: 0; }
.row img { width: 100%; image-rendering: pixelated; }
.row img.plot { image-rendering: auto; }
footer { margin-top: 2.5em; border-top: 1px solid #bbb; font-size: .85em; color: #555; }
.verdict { border-left: .5em solid; padding: .5em 1em; background: #f6f6f6; }
.verdict strong { display: block; }
.verdict.full { border-color: #2a7a3a; }
.verdict.limited { border-color: #c78a00; }
.verdict.none { border-color: #b3261e; }
@media (max-width: 700px) { body { margin: .5em auto; } table { display: block; overflow-x: auto; } }
@media print { body { margin: 0; max-width: none; font-size: 11pt; } }
)";

std::string& command() {
  static std::string line;
  return line;
}

// Who made it, when and how.
std::string foot() {
  const auto now = std::chrono::time_point_cast<std::chrono::seconds>(std::chrono::system_clock::now());
  const std::string by = command().empty() ? "" : ", by " + escape_html(command());
  return fmt::format("<footer>Selvedge {}, {:%Y-%m-%d %H:%M} UTC{}</footer>\n", SELVEDGE_VERSION, fmt::gmtime(now), by);
}

std::string figure(const std::string& content, const std::string& caption) {
  return fmt::format("<figure>{}<figcaption>{}</figcaption></figure>\n", content, escape_html(caption));
}

std::string image(const std::string& png, const std::string& caption, int width_px) {
  const std::string width = width_px > 0 ? fmt::format(" width=\"{}\"", width_px) : "";
  return fmt::format("<img{} alt=\"{}\" src=\"data:image/png;base64,{}\">", width, escape_html(caption), base64(png));
}

bool starts_like_a_number(const std::string& cell) {
  const size_t sign = !cell.empty() && (cell[0] == '-' || cell[0] == '+') ? 1 : 0;
  return cell.size() > sign && cell[sign] >= '0' && cell[sign] <= '9';
}

}  // namespace

void set_command(const std::string& command_line) { command() = command_line; }

std::string escape_html(const std::string& text) {
  std::string escaped;
  escaped.reserve(text.size());
  for (const char c : text) {
    switch (c) {
      case '&': escaped += "&amp;"; break;
      case '<': escaped += "&lt;"; break;
      case '>': escaped += "&gt;"; break;
      case '"': escaped += "&quot;"; break;
      default: escaped += c;
    }
  }
  return escaped;
}

HtmlReport::HtmlReport(std::string title) : title_(std::move(title)) {}

void HtmlReport::verdict(const Verdict& verdict) {
  constexpr const char* classes[] = {"full", "limited", "none"};
  std::string text = to_text(verdict.trust), reasons;
  text[0] = static_cast<char>(std::toupper(static_cast<unsigned char>(text[0])));
  for (const std::string& why : verdict.because) reasons += "<li>" + escape_html(why) + "</li>";
  if (!reasons.empty()) reasons = "<ul>" + reasons + "</ul>";
  body_ += fmt::format("<div class=\"verdict {}\"><strong>{}</strong>{}{}</div>\n",
                       classes[static_cast<size_t>(verdict.trust)], text, escape_html(verdict.sentence), reasons);
}

void HtmlReport::heading(const std::string& text) { body_ += "<h2>" + escape_html(text) + "</h2>\n"; }

void HtmlReport::paragraph(const std::string& text) { body_ += "<p>" + escape_html(text) + "</p>\n"; }

void HtmlReport::table(const std::vector<std::string>& header, const std::vector<std::vector<std::string>>& rows) {
  body_ += "<table>\n<tr>";
  for (const std::string& cell : header) body_ += "<th>" + escape_html(cell) + "</th>";
  body_ += "</tr>\n";
  for (const auto& row : rows) {
    body_ += "<tr>";
    for (const std::string& cell : row)
      body_ += (starts_like_a_number(cell) ? "<td class=\"number\">" : "<td>") + escape_html(cell) + "</td>";
    body_ += "</tr>\n";
  }
  body_ += "</table>\n";
}

void HtmlReport::links(const std::vector<std::pair<std::string, std::string>>& to) {
  body_ += "<p>";
  for (size_t i = 0; i < to.size(); ++i)
    body_ += fmt::format("{}<a href=\"{}\">{}</a>", i == 0 ? "" : " · ", escape_html(to[i].second),
                         escape_html(to[i].first));
  body_ += "</p>\n";
}

void HtmlReport::svg(const std::string& svg_text, const std::string& caption) { body_ += figure(svg_text, caption); }

void HtmlReport::interactive(const std::string& markup, const std::string& caption) {
  body_ += figure(markup, caption);
}

void HtmlReport::picture(const std::string& png, const std::string& caption, int width_px) {
  body_ += figure(image(png, caption, width_px), caption);
}

void HtmlReport::picture_row(const std::vector<std::string>& pngs, const std::vector<std::string>& captions) {
  if (pngs.size() != captions.size())
    throw std::invalid_argument(fmt::format("picture_row: {} pictures and {} captions", pngs.size(), captions.size()));
  body_ += "<div class=\"row\">\n";
  for (size_t i = 0; i < pngs.size(); ++i) picture(pngs[i], captions[i]);
  body_ += "</div>\n";
}

void HtmlReport::svg_row(const std::vector<std::string>& svg_texts, const std::vector<std::string>& captions) {
  if (svg_texts.size() != captions.size())
    throw std::invalid_argument(fmt::format("svg_row: {} plots and {} captions", svg_texts.size(), captions.size()));
  body_ += "<div class=\"row\">\n";
  for (size_t i = 0; i < svg_texts.size(); ++i)
    body_ += figure(fmt::format("<img class=\"plot\" alt=\"{}\" src=\"data:image/svg+xml;base64,{}\">",
                                escape_html(captions[i]), base64(svg_texts[i])),
                    captions[i]);
  body_ += "</div>\n";
}

void HtmlReport::write(const std::filesystem::path& path) const {
  const std::string title = escape_html(title_);
  files::write_whole(
      path, fmt::format("<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">\n"
                        "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n<title>{}</title>\n"
                        "<style>{}</style></head>\n<body>\n<h1>{}</h1>\n{}{}</body></html>\n",
                        title, style_sheet, title, body_, foot()));
}

}  // namespace selvedge::report
