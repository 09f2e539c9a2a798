#pragma once

#include <map>
#include <string>

#include "isp/base/result.h"
#include "isp/base/spectrum.h"

namespace lowlux::test {

/// The columns of a table of testdata/spectra by name: '#' comments, one header row, wavelength first.
Result<std::map<std::string, Spectrum>> read_spectra(const std::string& file_name);

/// As above for the camera table, whose rows start with the camera's name: "<camera>/R", "<camera>/G", "<camera>/B".
Result<std::map<std::string, Spectrum>> read_camera_sensitivities();

}  // namespace lowlux::test
