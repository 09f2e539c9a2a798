#include "isp/output/report.h"

#include <cassert>
#include <cmath>
#include <cstdio>

#include <nlohmann/json.hpp>

#include "isp/output/chart_js.h"

namespace lowlux::isp {
namespace {

using Json = nlohmann::json;

// What the page does with the plots it carries: one chart each, into the canvas of the same number.
constexpr std::string_view draw_script = R"js(
const colours = ['#0072b2', '#d55e00', '#009e73', '#cc79a7', '#e69f00', '#56b4e9', '#000000', '#8c6d31', '#7b4173',
                 '#637939', '#393b79', '#843c39'];
function dataset(series, i) {
  const colour = colours[i % colours.length];
  const points = series.mark === 'points';
  return {
    label: series.name, data: series.x.map((x, k) => ({x: x, y: series.y[k]})), showLine: !points,
    borderColor: colour, backgroundColor: colour, borderWidth: 1.5, pointRadius: points ? 2 : 0,
    borderDash: series.mark === 'dashed' ? [5, 4] : [], tension: 0
  };
}
function axis(label, logarithmic, range) {
  return {type: logarithmic ? 'logarithmic' : 'linear', title: {display: true, text: label}, ...range};
}
function equalRanges(plot) {
  const all = key => plot.series.flatMap(s => s[key]).filter(v => v !== null);
  const bounds = key => all(key).reduce(([a, b], v) => [Math.min(a, v), Math.max(b, v)], [Infinity, -Infinity]);
  const [x0, x1] = bounds('x'), [y0, y1] = bounds('y');
  const half = 0.55 * Math.max(x1 - x0, y1 - y0);
  const range = (a, b) => ({min: (a + b) / 2 - half, max: (a + b) / 2 + half});
  return [range(x0, x1), range(y0, y1)];
}
plots.forEach((plot, i) => {
  const [xRange, yRange] = plot.equal ? equalRanges(plot) : [{}, {}];
  new Chart(document.getElementById('plot' + i), {
    type: 'scatter', data: {datasets: plot.series.map(dataset)},
    options: {
      animation: false, aspectRatio: plot.equal ? 1 : 1.6,
      scales: {x: axis(plot.xLabel, plot.xLog, xRange), y: axis(plot.yLabel, plot.yLog, yRange)},
      plugins: {title: {display: true, text: plot.title},
                legend: {position: plot.equal ? 'bottom' : 'right', labels: {boxWidth: 12}}}
    }
  });
});
)js";

constexpr std::string_view style = R"css(
body { font: 15px/1.45 sans-serif; max-width: 68rem; margin: 2rem auto; padding: 0 1rem; color: #222; background: #fff; }
table { border-collapse: collapse; margin: 1rem 0; }
th, td { border: 1px solid #bbb; padding: .25rem .5rem; text-align: left; vertical-align: top; }
th { background: #eee; }
figure { margin: 1.5rem 0; max-width: 52rem; }
figcaption { color: #555; }
)css";

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

std::string paragraph(std::string_view text) { return text.empty() ? "" : "<p>" + escaped(text) + "</p>\n"; }

std::string html_of(const Table& table) {
  if (table.columns.empty()) return {};
  std::string out = "<table>\n<tr>";
  for (const std::string& column : table.columns) out += "<th>" + escaped(column) + "</th>";
  out += "</tr>\n";
  for (const auto& row : table.rows) {
    out += "<tr>";
    for (const std::string& cell : row) out += "<td>" + escaped(cell) + "</td>";
    out += "</tr>\n";
  }
  return out + "</table>\n";
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
          {"series", series}};
}

// JSON that is safe inside a script element: no "</script>" or "<!--" can appear in it.
std::string script_text(const Json& json) {
  std::string out;
  for (const char c : json.dump(-1, ' ', false, Json::error_handler_t::replace)) {
    if (c == '<') {
      out += "\\u003c";
    } else {
      out += c;
    }
  }
  return out;
}

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

std::string number(double value) {
  if (!std::isfinite(value)) return {};
  char text[32];
  std::snprintf(text, sizeof text, "%.17g", value);
  return text;
}

}  // namespace

std::string html_of(const Report& report) {
  std::string body = "<h1>" + escaped(report.title) + "</h1>\n" + paragraph(report.text);
  Json plots = Json::array();
  for (const ReportSection& section : report.sections) {
    body += "<h2>" + escaped(section.title) + "</h2>\n" + paragraph(section.text) + html_of(section.table);
    for (const Plot& plot : section.plots) {
      body += R"(<figure><canvas id="plot)" + std::to_string(plots.size()) + R"(" role="img" aria-label=")" +
              escaped(plot.title) + "\"></canvas><figcaption>" + escaped(plot.caption) + "</figcaption></figure>\n";
      plots.push_back(json_of(plot));
    }
  }
  std::string page = "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n<title>";
  page += escaped(report.title) + "</title>\n<style>" + std::string(style) + "</style>\n</head>\n<body>\n" + body;
  page += "<script>" + std::string(chart_js()) + "</script>\n<script>\nconst plots = " + script_text(plots) + ";\n";
  return page + std::string(draw_script) + "</script>\n</body>\n</html>\n";
}

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

Result<void> write_text(const std::string& path, std::string_view text, Overwrite overwrite) {
  Result<AtomicFile> file = AtomicFile::create(path, overwrite);
  if (!file) return tl::make_unexpected(file.error());
  if (std::fwrite(text.data(), 1, text.size(), file->file()) != text.size()) {
    return fail(ErrorCode::unwritable, "the file cannot be written whole; is the disk full?", path);
  }
  return file->commit();
}

}  // namespace lowlux::isp
