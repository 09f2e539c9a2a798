#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string_view>

#include "isp/base/spectrum.h"

namespace lowlux::isp {

/// One table of isp/model/data, compiled in. `cells` holds rows of columns.size() numbers, the wavelength [nm] first
/// (except macadam1942, whose rows are ellipses).
struct CieTable {
  std::span<const std::string_view> columns;
  std::span<const double> cells;
};

/// Column 1, 2... of a table as a spectrum, by its place or its name; nullopt for a name it has not.
Spectrum column_of(const CieTable& table, std::size_t column);
std::optional<Spectrum> column_named(const CieTable& table, std::string_view name);

CieTable camera_ssf_5nm_table();
CieTable cie1931_2deg_cmf_1nm_table();
CieTable cie1951_scotopic_1nm_table();
CieTable colorchecker_ohta_reflectance_5nm_table();
CieTable cones_smith_pokorny_1975_5nm_table();
CieTable cones_stockman_sharpe_2deg_1nm_table();
CieTable illuminants_cie_5nm_table();
CieTable macadam1942_table();
CieTable munsell_ten_chips_1nm_table();
CieTable sfu_laboratory_lamps_4nm_table();
CieTable sfu_macbeth_reflectance_4nm_table();
CieTable sony_dxc930_sensitivity_4nm_table();
CieTable street_lamps_5nm_table();

}  // namespace lowlux::isp
