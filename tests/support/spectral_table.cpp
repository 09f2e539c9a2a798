#include "tests/support/spectral_table.h"

#include <cstddef>
#include <cstdlib>
#include <fstream>
#include <sstream>
#include <utility>
#include <vector>

namespace lowlux::test {
namespace {

using Row = std::vector<std::string>;

Result<std::vector<Row>> read_rows(const std::string& file_name) {
  const std::string path = std::string(LOWLUX_TESTDATA) + "/spectra/" + file_name;
  std::ifstream file(path);
  if (!file) return fail(ErrorCode::not_found, "the table cannot be opened", path);
  std::vector<Row> rows;
  for (std::string line; std::getline(file, line);) {
    if (line.empty() || line[0] == '#') continue;
    Row row;
    std::istringstream cells(line);
    for (std::string cell; std::getline(cells, cell, ',');) row.push_back(cell);
    rows.push_back(std::move(row));
  }
  if (rows.size() < 2) return fail(ErrorCode::malformed, "the table has no rows", path);
  return rows;
}

struct Samples {
  std::vector<double> nm, value;
};

Result<std::map<std::string, Spectrum>> to_spectra(const std::map<std::string, Samples>& columns) {
  std::map<std::string, Spectrum> spectra;
  for (const auto& [name, samples] : columns) {
    auto spectrum = Spectrum::of(samples.nm, samples.value);
    if (!spectrum) return tl::make_unexpected(spectrum.error());
    spectra.emplace(name, *std::move(spectrum));
  }
  return spectra;
}

/// @param prefix  how many cells before the wavelength name the row
Result<std::map<std::string, Spectrum>> read_columns(const std::string& file_name, std::size_t prefix) {
  const auto rows = read_rows(file_name);
  if (!rows) return tl::make_unexpected(rows.error());
  const Row& header = rows->front();
  std::map<std::string, Samples> columns;
  for (std::size_t r = 1; r < rows->size(); ++r) {
    const Row& row = (*rows)[r];
    if (row.size() != header.size()) return fail(ErrorCode::malformed, "row with a missing cell", file_name);
    for (std::size_t c = prefix + 1; c < row.size(); ++c) {
      Samples& samples = columns[prefix == 0 ? header[c] : row[0] + "/" + header[c]];
      samples.nm.push_back(std::strtod(row[prefix].c_str(), nullptr));
      samples.value.push_back(std::strtod(row[c].c_str(), nullptr));
    }
  }
  return to_spectra(columns);
}

}  // namespace

Result<std::map<std::string, Spectrum>> read_spectra(const std::string& file_name) {
  return read_columns(file_name, 0);
}

Result<std::map<std::string, Spectrum>> read_camera_sensitivities() { return read_columns("camera_ssf_5nm.csv", 1); }

}  // namespace lowlux::test
