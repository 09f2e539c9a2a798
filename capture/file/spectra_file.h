#pragma once

#include <string>
#include <vector>

#include "isp/base/result.h"
#include "isp/base/spectrum.h"

namespace lowlux::capture {

/// A named column of a table of spectra.
struct SpectrumColumn {
  std::string name;
  Spectrum spectrum;
};

/// Reads a table of spectra: lines starting with '#' are comments; then a row of names, the first column being the
/// wavelength [nm]; then rows of numbers separated by commas. At most 16 MB, 4096 columns and 100000 rows.
/// Errors name the line: a first row of numbers, a cell that is not a finite number, a row of another length,
/// wavelengths that do not rise.
Result<std::vector<SpectrumColumn>> read_spectra(const std::string& path);

/// Parses a table of spectra; errors refer to it as `name`.
Result<std::vector<SpectrumColumn>> parse_spectra(const std::string& text, const std::string& name);

}  // namespace lowlux::capture
