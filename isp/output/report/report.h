#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "isp/base/result.h"
#include "isp/output/atomic_file.h"

namespace lowlux::isp {

enum class AxisScale : std::uint8_t { linear, logarithmic };
enum class Mark : std::uint8_t { line, dashed, points };

/// Holds a data series to draw: y over x, of equal length. A y that is not finite interrupts a line.
struct Series {
  std::string name;
  std::vector<double> x;
  std::vector<double> y;
  Mark mark = Mark::line;
};

/// Describes a plot of a report.
struct Plot {
  std::string id;  // letters, digits, - and _: name of the CSV file
  std::string title;
  std::string x_label;  // with unit
  std::string y_label;
  AxisScale x_scale = AxisScale::linear;
  AxisScale y_scale = AxisScale::linear;
  bool equal_scales = false;  // equal units have equal length on both axes: chromaticity diagrams
  std::vector<Series> series;
  std::string caption;
  bool name_points =
      false;  // names of series of one point are drawn next to it, in bold where a line passes through; no legend
};

/// Holds a table of a report.
struct Table {
  std::vector<std::string> columns;
  std::vector<std::vector<std::string>> rows;  // each as long as columns
  std::vector<std::size_t> marked;             // rows with a tinted background; the section's text states the reason
};

/// Holds one side of a comparison.
struct ComparedPicture {
  std::string label;
  std::vector<std::byte> png;  // bytes of the file
};

/// Holds two images of the same size, one over the other, with a slider that moves the edge between them.
struct Comparison {
  std::string title;
  ComparedPicture before;  // left of the edge
  ComparedPicture after;
};

/// Holds a section of a report.
struct ReportSection {
  std::string title;
  std::string text;  // one paragraph per line
  Table table;       // omitted if it has no columns
  std::vector<Plot> plots;
  std::vector<Comparison> comparisons = {};
  bool is_part = false;  // part of the previous section: a smaller heading, not in the contents
};

/// Holds a report: one page, or its tables and plots as CSV.
struct Report {
  std::string title;
  std::string text;  // one paragraph per line
  std::vector<ReportSection> sections;
};

/// Returns one self-contained HTML page: contents if there are three or more sections, tables as text, plots drawn by
/// Chart.js and images, all embedded. Nothing is fetched: the page's own policy forbids it. Any text is shown
/// literally: it cannot become markup or script. Bytes of plots that are not valid UTF-8 become replacement characters.
std::string html_of(const Report& report);

/// Returns comma-separated values (RFC 4180, lines end with \n): the header, then the rows.
std::string csv_of(const Table& table);

/// Returns one line for each point: series, x, y, with all digits; y is empty where it is not finite.
std::string csv_of(const Plot& plot);

/// Holds the name and the content of a file.
struct TextFile {
  std::string path;
  std::string_view text;
};

/// Writes texts to files that get their names by AtomicFile::commit_all. Errors, each with its path: those of
/// AtomicFile; a full disk.
Result<std::vector<AtomicFile>> prepare_texts(std::span<const TextFile> files, Overwrite overwrite);

/// Writes text files, all or none. Errors: those of prepare_texts and of AtomicFile::commit_all.
Result<void> write_texts(std::span<const TextFile> files, Overwrite overwrite);

/// Writes a text file completely or not at all. Errors: those of write_texts.
Result<void> write_text(const std::string& path, std::string_view text, Overwrite overwrite);

/// Returns the text of Chart.js (MIT licence, its banner included), compiled in from the file found at configuration.
std::string_view chart_js();

/// Returns the text of report_page.js, which draws the page's plots and moves its sliders.
std::string_view report_page_js();

/// Returns the text of report_page.css.
std::string_view report_page_css();

}  // namespace lowlux::isp
