#include "isp/output/report/report.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <span>
#include <utility>

#include <nlohmann/json.hpp>

#include "isp/base/json_text.h"
#include "isp/base/text.h"

namespace lowlux::isp {
namespace {

std::string csv_cell(const std::string& text) {
  if (text.find_first_of(",\"\r\n") == std::string::npos) return text;
  std::string out = "\"";
  for (const char c : text) out += c == '"' ? std::string("\"\"") : std::string(1, c);
  return out + '"';
}

std::string csv_line(const std::vector<std::string>& cells) {
  std::string out;
  for (const std::string& cell : cells) {
    if (&cell != &cells.front()) out += ',';
    out += csv_cell(cell);
  }
  return out + '\n';
}

std::string number(double value) { return std::isfinite(value) ? number_text(value, 17) : std::string(); }

}  // namespace

std::string csv_of(const Table& table) {
  std::string out = csv_line(table.columns);
  for (const auto& row : table.rows) out += csv_line(row);
  return out;
}

std::string csv_of(const Plot& plot) {
  std::string out = "series,x,y\n";
  for (const Series& s : plot.series) {
    for (std::size_t i = 0; i < s.x.size(); ++i) out += csv_line({s.name, number(s.x[i]), number(s.y[i])});
  }
  return out;
}

Result<std::vector<AtomicFile>> prepare_texts(std::span<const TextFile> files, Overwrite overwrite) {
  std::vector<AtomicFile> written;
  for (const TextFile& file : files) {
    auto created = AtomicFile::create(file.path, overwrite);
    if (!created) return fail(created.error().code, created.error().message, file.path);
    const AtomicFile& now = written.emplace_back(*std::move(created));
    if (std::fwrite(file.text.data(), 1, file.text.size(), now.file()) != file.text.size() ||
        std::fflush(now.file()) != 0) {
      return fail(ErrorCode::unwritable, "the file cannot be written completely; is the disk full?", file.path);
    }
  }
  return written;
}

Result<void> write_texts(std::span<const TextFile> files, Overwrite overwrite) {
  return prepare_texts(files, overwrite).and_then([](std::vector<AtomicFile> written) {
    return AtomicFile::commit_all(written);
  });
}

Result<void> write_text(const std::string& path, std::string_view text, Overwrite overwrite) {
  return write_texts(std::array{TextFile{path, text}}, overwrite);
}

namespace {

using Json = nlohmann::json;
constexpr std::size_t min_sections_with_contents = 3;
constexpr std::size_t short_cell = 20, long_cell = 40;  // characters

// The policy keeps the browser from fetching anything, whatever the text of the page.
constexpr std::string_view head = R"html(<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<meta http-equiv="Content-Security-Policy"
      content="default-src 'none'; img-src data:; style-src 'unsafe-inline'; script-src 'unsafe-inline'">
<title>)html";

std::string escaped(std::string_view text) {
  std::string out;
  out.reserve(text.size());
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

std::string paragraphs(std::string_view text) {
  std::string out;
  while (!text.empty()) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    if (end > 0) out += "<p>" + escaped(text.substr(0, end)) + "</p>\n";
    text.remove_prefix(std::min(end + 1, text.size()));
  }
  return out;
}

bool is_number(std::string_view cell) {
  double value = 0;
  const auto [end, error] = std::from_chars(cell.data(), cell.data() + cell.size(), value);
  return error == std::errc() && end == cell.data() + cell.size();
}

/// Returns the style of a column: figures right-aligned, names unbroken, sentences wide enough to be read.
std::string_view class_of_column(const Table& table, std::size_t column) {
  bool any = false, numbers = true;
  std::size_t longest = 0;
  for (const auto& row : table.rows) {
    const std::string& cell = row[column];
    if (cell.empty()) continue;
    any = true;
    numbers = numbers && is_number(cell);
    longest = std::max(longest, cell.size());
  }
  if (any && numbers) return "number";
  if (longest <= short_cell) return "short";
  return longest >= long_cell ? "long" : "text";
}

std::string html_of(const Table& table, std::string_view title) {
  if (table.columns.empty()) return {};
  std::vector<std::string> opening;  // opening of each column's cells, without the tag's name
  opening.reserve(table.columns.size());
  std::string out = R"(<div class="scroll" role="region" tabindex="0" aria-label="Table: )" + escaped(title) +
                    "\">\n<table>\n<thead><tr>";
  for (std::size_t c = 0; c < table.columns.size(); ++c) {
    opening.push_back(R"( class=")" + std::string(class_of_column(table, c)) + "\">");
    out += R"(<th scope="col")" + opening[c] + escaped(table.columns[c]) + "</th>";
  }
  out += "</tr></thead>\n<tbody>\n";
  for (std::size_t r = 0; r < table.rows.size(); ++r) {
    const bool is_marked = std::find(table.marked.begin(), table.marked.end(), r) != table.marked.end();
    out += is_marked ? R"(<tr class="marked">)" : "<tr>";
    assert(table.rows[r].size() == table.columns.size());
    for (std::size_t c = 0; c < table.columns.size(); ++c) {
      out += "<td" + opening[c] + escaped(table.rows[r][c]) + "</td>";
    }
    out += "</tr>\n";
  }
  return out + "</tbody>\n</table>\n</div>\n";
}

std::string_view name_of(Mark mark) {
  switch (mark) {
    case Mark::line:
      return "line";
    case Mark::dashed:
      return "dashed";
    case Mark::points:
      break;
  }
  return "points";
}

Json json_of(const Plot& plot) {
  Json series = Json::array();
  for (const Series& s : plot.series) {
    assert(s.x.size() == s.y.size());
    series.push_back({{"name", s.name}, {"x", s.x}, {"y", s.y}, {"mark", name_of(s.mark)}});
  }
  return {{"title", plot.title},
          {"xLabel", plot.x_label},
          {"yLabel", plot.y_label},
          {"xLog", plot.x_scale == AxisScale::logarithmic},
          {"yLog", plot.y_scale == AxisScale::logarithmic},
          {"equal", plot.equal_scales},
          {"named", plot.name_points},
          {"series", series}};
}

// Returns JSON that is safe inside a script element: no "</script>" or "<!--" can appear in it.
std::string script_text(const Json& json) {
  std::string out;
  for (const char c : json_text(json)) {
    if (c == '<') {
      out += "\\u003c";
    } else {
      out += c;
    }
  }
  return out;
}

/// Returns the base64 encoding of RFC 4648, section 4.
std::string base64(std::span<const std::byte> bytes) {
  constexpr std::string_view digits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string out;
  out.reserve((bytes.size() + 2) / 3 * 4);
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    const std::size_t count = std::min<std::size_t>(3, bytes.size() - i);
    unsigned group = 0;
    for (std::size_t k = 0; k < 3; ++k) group = group << 8 | (k < count ? std::to_integer<unsigned>(bytes[i + k]) : 0);
    for (std::size_t k = 0; k < 4; ++k) out += k <= count ? digits[group >> (18 - 6 * k) & 63] : '=';
  }
  return out;
}

std::string picture(const ComparedPicture& side, std::string_view name) {
  return R"(<img class=")" + std::string(name) + R"(" alt=")" + escaped(side.label) +
         R"(" src="data:image/png;base64,)" + base64(side.png) + "\">";
}

std::string html_of(const Comparison& comparison) {
  const std::string before = escaped(comparison.before.label), after = escaped(comparison.after.label);
  return R"(<figure class="comparison"><div class="sides"><span>)" + before + "</span><span>" + after +
         "</span></div>\n<div class=\"pair\">" + picture(comparison.before, "before") +
         picture(comparison.after, "after") +
         R"(<input type="range" min="0" max="100" value="50" autocomplete="off" aria-label="How much is shown of )" +
         before + ", the rest of " + after + ": " + escaped(comparison.title) + "\"></div>\n<figcaption>" +
         escaped(comparison.title) + "</figcaption></figure>\n";
}

std::string figure(const Plot& plot, std::size_t number) {
  const std::string title = escaped(plot.title);
  return std::string(R"(<figure><div class="plot)") + (plot.equal_scales ? " equal" : "") + R"("><canvas id="plot)" +
         std::to_string(number) + R"(" role="img" aria-label=")" + title + "\"></canvas></div><figcaption>" +
         escaped(plot.caption) + "</figcaption></figure>\n";
}

/// Returns the HTML of a section. The page's plots are numbered in order: they are appended to `plots` for the script.
std::string html_of(const ReportSection& section, std::size_t number, Json& plots) {
  const std::string heading = section.is_part ? "h3" : "h2";
  std::string out = "<" + heading + R"( id="section)" + std::to_string(number) + "\">" + escaped(section.title) + "</" +
                    heading + ">\n" + paragraphs(section.text) + html_of(section.table, section.title);
  if (!section.plots.empty()) out += "<div class=\"plots\">\n";
  for (const Plot& plot : section.plots) {
    out += figure(plot, plots.size());
    plots.push_back(json_of(plot));
  }
  if (!section.plots.empty()) out += "</div>\n";
  if (!section.comparisons.empty()) out += "<div class=\"comparisons\">\n";
  for (const Comparison& comparison : section.comparisons) out += html_of(comparison);
  if (!section.comparisons.empty()) out += "</div>\n";
  return out;
}

std::string contents_of(const std::vector<ReportSection>& sections) {
  std::string lines;
  std::size_t listed = 0;
  for (std::size_t i = 0; i < sections.size(); ++i) {
    if (sections[i].is_part) continue;
    lines += R"(<li><a href="#section)" + std::to_string(i) + "\">" + escaped(sections[i].title) + "</a></li>\n";
    ++listed;
  }
  if (listed < min_sections_with_contents) return {};
  return "<nav aria-label=\"Contents\"><p>Contents</p>\n<ol>\n" + lines + "</ol></nav>\n";
}

}  // namespace

std::string html_of(const Report& report) {
  std::string body = "<h1>" + escaped(report.title) + "</h1>\n" + paragraphs(report.text);
  body += contents_of(report.sections);
  Json plots = Json::array();
  for (std::size_t i = 0; i < report.sections.size(); ++i) body += html_of(report.sections[i], i, plots);
  std::string page(head);
  page += escaped(report.title) + "</title>\n<style>\n";
  page += report_page_css();
  page += "</style>\n</head>\n<body>\n" + body + "<script>";
  page += chart_js();
  page += "</script>\n<script>\nconst plots = " + script_text(plots) + ";\n";
  page += report_page_js();
  return page + "</script>\n</body>\n</html>\n";
}

}  // namespace lowlux::isp
