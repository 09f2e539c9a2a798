#include "isp/model/spectrum/spectral_data.h"

#include <algorithm>
#include <cstddef>
#include <string>
#include <utility>

#include "isp/base/text.h"
#include "isp/model/spectrum/cie_data.h"

namespace lowlux::isp {
namespace {

constexpr std::string_view thesis_camera = "Sony_DXC-930";

CieTable table_of(SpectrumSet set) {
  switch (set) {
    case SpectrumSet::cie_illuminants:
      return illuminants_cie_5nm_table();
    case SpectrumSet::street_lamps:
      return street_lamps_5nm_table();
    case SpectrumSet::laboratory_lamps:
      return sfu_laboratory_lamps_4nm_table();
    case SpectrumSet::colorchecker:
      return colorchecker_ohta_reflectance_5nm_table();
    case SpectrumSet::macbeth:
      return sfu_macbeth_reflectance_4nm_table();
    case SpectrumSet::munsell_ten:
      break;
  }
  return munsell_ten_chips_1nm_table();
}

/// Scales the three spectra so that the largest value of all is 1.
std::array<Spectrum, 3> peak_one(std::array<Spectrum, 3> rgb) {
  double peak = 0;
  for (const Spectrum& channel : rgb) peak = std::max(peak, std::ranges::max(channel.values()));
  for (Spectrum& channel : rgb) channel = channel.mapped([&](double, double value) { return value / peak; });
  return rgb;
}

}  // namespace

std::vector<NamedSpectrum> spectra_of(SpectrumSet set) {
  const CieTable table = table_of(set);
  std::vector<NamedSpectrum> all;
  for (std::size_t column = 1; column < table.columns.size(); ++column) {
    all.push_back({table.columns[column], column_of(table, column)});
  }
  return all;
}

std::optional<Spectrum> spectrum_named(SpectrumSet set, std::string_view name) {
  return column_named(table_of(set), name);
}

std::optional<std::array<Spectrum, 3>> camera_sensitivity(std::string_view camera) {
  if (camera == thesis_camera) {
    const CieTable table = sony_dxc930_sensitivity_4nm_table();
    return peak_one({column_of(table, 1), column_of(table, 2), column_of(table, 3)});
  }
  const CieTable table = camera_ssf_5nm_table();
  const std::string name(camera);
  auto red = column_named(table, name + "/R");
  auto green = column_named(table, name + "/G");
  auto blue = column_named(table, name + "/B");
  if (!red || !green || !blue) return std::nullopt;
  return peak_one({*std::move(red), *std::move(green), *std::move(blue)});
}

std::vector<std::string_view> camera_names() {
  std::vector<std::string_view> names;
  for (const std::string_view column : camera_ssf_5nm_table().columns) {
    if (column.ends_with("/R")) names.push_back(column.substr(0, column.size() - 2));
  }
  names.push_back(thesis_camera);
  return names;
}

std::optional<std::string_view> known_camera(std::string_view usual_name) {
  const auto plain = [](char c) { return c == ' ' ? '_' : ascii_lower(c); };
  const std::vector<std::string_view> names = camera_names();
  const auto found = std::ranges::find_if(
      names, [&](std::string_view name) { return std::ranges::equal(name, usual_name, {}, plain, plain); });
  return found == names.end() ? std::nullopt : std::optional(*found);
}

std::array<Spectrum, 3> cone_fundamentals(ConeSet set) {
  const CieTable table = set == ConeSet::smith_pokorny_1975 ? cones_smith_pokorny_1975_5nm_table()
                                                            : cones_stockman_sharpe_2deg_1nm_table();
  return {column_of(table, 1), column_of(table, 2), column_of(table, 3)};
}

}  // namespace lowlux::isp
