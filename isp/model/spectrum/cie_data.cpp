#include "isp/model/spectrum/cie_data.h"

#include <algorithm>
#include <cassert>
#include <utility>
#include <vector>

namespace lowlux::isp {

const std::array<Spectrum, 3>& cie_1931_observer() {
  static const std::array<Spectrum, 3> observer = [] {
    const CieTable table = cie1931_2deg_cmf_1nm_table();
    return std::array{column_of(table, 1), column_of(table, 2), column_of(table, 3)};
  }();
  return observer;
}

std::optional<Spectrum> light_named(std::string_view name) {
  if (auto illuminant = column_named(illuminants_cie_5nm_table(), name)) return illuminant;
  return column_named(street_lamps_5nm_table(), name);
}

std::vector<std::string_view> light_names() {
  std::vector<std::string_view> names;
  for (const CieTable& table : {illuminants_cie_5nm_table(), street_lamps_5nm_table()}) {
    names.insert(names.end(), table.columns.begin() + 1, table.columns.end());
  }
  return names;
}

Xyz xyz_of(const Spectrum& power) {
  Vector3 sum{};
  for (int i = 0; i < 3; ++i) {
    sum[i] = integrate(power, [&](double nm) { return cie_1931_observer()[i].at(nm); });
  }
  return xyz_of(sum);
}

Xyz xyz_cd_m2(const Spectrum& radiance) {
  const Xyz sum = xyz_of(radiance);
  return {luminous_efficacy_lm_w * sum.x, luminous_efficacy_lm_w * sum.y, luminous_efficacy_lm_w * sum.z};
}

std::optional<Xyz> xyz_of_reflectance(const Spectrum& reflectance, const Spectrum& light) {
  const double white_y = xyz_of(light).y;
  if (!(white_y > 0)) return std::nullopt;
  Vector3 sum{};
  for (int i = 0; i < 3; ++i) {
    sum[i] = integrate(light, [&](double nm) { return cie_1931_observer()[i].at(nm) * reflectance.at(nm); }) / white_y;
  }
  return xyz_of(sum);
}

Spectrum column_of(const CieTable& table, std::size_t column) {
  const std::size_t columns = table.columns.size();
  std::vector<double> nm, value;
  for (std::size_t i = 0; i < table.cells.size(); i += columns) {
    nm.push_back(table.cells[i]);
    value.push_back(table.cells[i + column]);
  }
  auto spectrum = Spectrum::of(std::move(nm), std::move(value));
  assert(spectrum && "a compiled-in table is well formed");
  return *std::move(spectrum);
}

std::optional<Spectrum> column_named(const CieTable& table, std::string_view name) {
  const auto found = std::find(table.columns.begin() + 1, table.columns.end(), name);
  if (found == table.columns.end()) return std::nullopt;
  return column_of(table, static_cast<std::size_t>(found - table.columns.begin()));
}

}  // namespace lowlux::isp
