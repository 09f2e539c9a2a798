#pragma once

#include <span>
#include <string_view>

namespace lowlux::isp {

/// One table of isp/model/data, compiled in. `cells` holds rows of columns.size() numbers, the wavelength [nm] first.
struct CieTable {
  std::span<const std::string_view> columns;
  std::span<const double> cells;
};

CieTable cie1931_2deg_cmf_1nm_table();
CieTable illuminants_cie_5nm_table();
CieTable street_lamps_5nm_table();

}  // namespace lowlux::isp
