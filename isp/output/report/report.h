#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "isp/base/result.h"
#include "isp/output/atomic_file.h"

namespace lowlux::isp {

enum class AxisScale : std::uint8_t { linear, logarithmic };
enum class Mark : std::uint8_t { line, dashed, points };

/// Numbers to draw: y over x, as many. A y that is not finite interrupts a line.
struct Series {
  std::string name;
  std::vector<double> x;
  std::vector<double> y;
  Mark mark = Mark::line;
};

struct Plot {
  std::string id;  // letters, digits, - and _: it names the CSV file
  std::string title;
  std::string x_label;  // with unit
  std::string y_label;
  AxisScale x_scale = AxisScale::linear;
  AxisScale y_scale = AxisScale::linear;
  bool equal_scales = false;  // one unit is as long on both axes: chromaticity diagrams
  std::vector<Series> series;
  std::string caption;
  bool name_points =
      false;  // names of series of one point stand beside it, in bold where a line goes through; no legend
};

struct Table {
  std::vector<std::string> columns;
  std::vector<std::vector<std::string>> rows;  // each as long as columns
  std::vector<std::size_t> marked;             // rows on a tinted ground; the section's text says why
};

/// One side of a comparison.
struct ComparedPicture {
  std::string label;
  std::vector<std::byte> png;  // a file's bytes
};

/// Two pictures of the same size, one over the other, and a slider that moves the edge between them.
struct Comparison {
  std::string title;
  ComparedPicture before;  // left of the edge
  ComparedPicture after;
};

struct ReportSection {
  std::string title;
  std::string text;  // a paragraph for each line
  Table table;       // left out if it has no columns
  std::vector<Plot> plots;
  std::vector<Comparison> comparisons = {};
  bool is_part = false;  // of the section before it: a smaller heading, not in the contents
};

struct Report {
  std::string title;
  std::string text;  // a paragraph for each line
  std::vector<ReportSection> sections;
};

/// One self-contained HTML page: contents where there are three sections and more, tables as text, plots drawn by
/// Chart.js and pictures, which are in the page. Nothing is fetched: the page's own policy forbids it. Any text is
/// shown as it is: it cannot become markup or script. Bytes of plots that are no UTF-8 become replacement characters.
std::string html_of(const Report& report);

/// Comma-separated values (RFC 4180, lines end with \n): the header, then the rows.
std::string csv_of(const Table& table);

/// One line for each point: series, x, y, with all digits; y is empty where it is not finite.
std::string csv_of(const Plot& plot);

/// A text file whole or not at all. Errors: those of AtomicFile; a full disk.
Result<void> write_text(const std::string& path, std::string_view text, Overwrite overwrite);

/// The text of Chart.js (MIT licence, its banner included), compiled in from the file found at configuration.
std::string_view chart_js();

/// The text of report_page.js: draws the page's plots, moves its sliders.
std::string_view report_page_js();

/// The text of report_page.css.
std::string_view report_page_css();

}  // namespace lowlux::isp
