#include "report/html.h"

#include <cctype>
#include <chrono>
#include <stdexcept>

#include <fmt/chrono.h>
#include <fmt/format.h>

#include "files/whole_file.h"
#include "report/base64.h"
#include "report/page_style.h"

namespace selvedge::report {

namespace {

std::string& command() {
  static std::string line;
  return line;
}

// Who made it, when, how and of what.
std::string foot(const std::string& input) {
  const auto now = std::chrono::time_point_cast<std::chrono::seconds>(std::chrono::system_clock::now());
  const std::string by = command().empty() ? "" : ", by " + escape_html(command());
  const std::string of = input.empty() ? "" : "; input " + escape_html(input);
  return fmt::format("<footer>Selvedge {}, {:%Y-%m-%d %H:%M} UTC{}{}</footer>\n", SELVEDGE_VERSION, fmt::gmtime(now),
                     by, of);
}

std::string figure(const std::string& content, const std::string& caption) {
  return fmt::format("<figure>{}<figcaption>{}</figcaption></figure>\n", content, escape_html(caption));
}

std::string image(const std::string& png, const std::string& caption, int width_px) {
  const std::string width = width_px > 0 ? fmt::format(" width=\"{}\"", width_px) : "";
  return fmt::format("<img{} alt=\"{}\" src=\"data:image/png;base64,{}\">", width, escape_html(caption), base64(png));
}

// What a reader who does not see the drawing is told of it.
std::string named_svg(const std::string& svg, const std::string& name) {
  const size_t tag = svg.find("<svg"), tag_end = svg.find('>', tag);
  if (tag == std::string::npos || tag_end == std::string::npos) return svg;
  const bool has_role = svg.substr(tag, tag_end - tag).find("role=") != std::string::npos;
  const std::string text = escape_html(name), mark = fmt::format(" role=\"img\" aria-label=\"{}\"", text);
  const std::string title =
      svg.find("<title>") == std::string::npos ? fmt::format("<title>{}</title>", text) : std::string();
  return svg.substr(0, tag + 4) + (has_role ? "" : mark) + svg.substr(tag + 4, tag_end + 1 - tag - 4) + title +
         svg.substr(tag_end + 1);
}

// A box that scrolls by itself where its content is wider than the screen, reached by the keyboard.
std::string scrolling(const std::string& content, const std::string& name) {
  return fmt::format("<div class=\"scroll\" role=\"region\" tabindex=\"0\" aria-label=\"{}\">{}</div>",
                     escape_html(name), content);
}

// The id of a heading: its letters and digits, and its number, so that no two are alike.
std::string id_of(const std::string& heading, size_t number) {
  std::string id;
  for (const char c : heading)
    if (std::isalnum(static_cast<unsigned char>(c))) id += static_cast<char>(std::tolower(c));
    else if (!id.empty() && id.back() != '-') id += '-';
  return fmt::format("{}{}{}", id, id.empty() || id.back() != '-' ? "-" : "", number);
}

std::string contents(const std::vector<std::string>& headings) {
  if (headings.size() < 2) return "";
  std::string list;
  for (size_t i = 0; i < headings.size(); ++i)
    list += fmt::format("<li><a href=\"#{}\">{}</a></li>", id_of(headings[i], i + 1), escape_html(headings[i]));
  return "<nav aria-label=\"Contents\"><ul>" + list + "</ul></nav>\n";
}

// A list of things, each with its number, is text.
bool starts_like_a_number(const std::string& cell) {
  if (cell.find(", ") != std::string::npos) return false;
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

std::string unescape_html(std::string_view text) {
  std::string plain;
  for (size_t i = 0; i < text.size(); ++i) {
    bool named = false;
    for (const auto& [name, letter] : {std::pair{"&lt;", '<'}, {"&gt;", '>'}, {"&quot;", '"'}, {"&amp;", '&'}})
      if (!named && text.substr(i).starts_with(name)) {
        plain += letter;
        i += std::string_view(name).size() - 1;
        named = true;
      }
    if (!named) plain += text[i];
  }
  return plain;
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

void HtmlReport::heading(const std::string& text) {
  headings_.push_back(text);
  body_ += fmt::format("<h2 id=\"{}\">{}</h2>\n", id_of(text, headings_.size()), escape_html(text));
}

void HtmlReport::input(const std::string& hash) { input_ = hash; }

void HtmlReport::paragraph(const std::string& text) { body_ += "<p>" + escape_html(text) + "</p>\n"; }

void HtmlReport::table(const std::vector<std::string>& header, const std::vector<std::vector<std::string>>& rows) {
  std::string text = "<table>\n<tr>", name;
  for (const std::string& cell : header) {
    text += cell.empty() ? "<td></td>" : "<th scope=\"col\">" + escape_html(cell) + "</th>";
    if (!cell.empty()) name += (name.empty() ? "" : ", ") + cell;
  }
  text += "</tr>\n";
  for (const auto& row : rows) {
    text += "<tr>";
    for (const std::string& cell : row)
      text += (starts_like_a_number(cell) ? "<td class=\"number\">" : "<td>") + escape_html(cell) + "</td>";
    text += "</tr>\n";
  }
  body_ += scrolling(text + "</table>", fmt::format("Table {}: {}", ++tables_, name)) + "\n";
}

void HtmlReport::links(const std::vector<std::pair<std::string, std::string>>& to) {
  body_ += "<p>";
  for (size_t i = 0; i < to.size(); ++i)
    body_ += fmt::format("{}<a href=\"{}\">{}</a>", i == 0 ? "" : " · ", escape_html(to[i].second),
                         escape_html(to[i].first));
  body_ += "</p>\n";
}

void HtmlReport::svg(const std::string& svg_text, const std::string& caption) {
  const std::string name = fmt::format("Figure {}: {}", ++figures_, caption);
  body_ += figure(scrolling(named_svg(svg_text, caption), name), caption);
}

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
  for (size_t i = 0; i < svg_texts.size(); ++i) {
    const std::string plot = fmt::format("<img class=\"plot\" alt=\"{}\" src=\"data:image/svg+xml;base64,{}\">",
                                         escape_html(captions[i]), base64(svg_texts[i]));
    body_ += figure(scrolling(plot, fmt::format("Figure {}: {}", ++figures_, captions[i])), captions[i]);
  }
  body_ += "</div>\n";
}

void HtmlReport::write(const std::filesystem::path& path) const {
  const std::string title = escape_html(title_);
  files::write_whole(
      path,
      fmt::format("<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">\n"
                  "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n<title>{}</title>\n"
                  "<style>{}</style></head>\n<body>\n<a class=\"skip\" href=\"#main\">Skip to the content</a>\n"
                  "<header><h1>{}</h1></header>\n{}<main id=\"main\" tabindex=\"-1\">\n{}</main>\n{}</body></html>\n",
                  title, page_style, title, contents(headings_), body_, foot(input_)));
}

}  // namespace selvedge::report
