#include "isp/output/report.h"

#include <cmath>
#include <cstdio>

#include "isp/base/number_text.h"

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

Result<void> write_text(const std::string& path, std::string_view text, Overwrite overwrite) {
  Result<AtomicFile> file = AtomicFile::create(path, overwrite);
  if (!file) return tl::make_unexpected(file.error());
  if (std::fwrite(text.data(), 1, text.size(), file->file()) != text.size()) {
    return fail(ErrorCode::unwritable, "the file cannot be written whole; is the disk full?", path);
  }
  return file->commit();
}

}  // namespace lowlux::isp
