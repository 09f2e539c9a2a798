#include "isp/model/spectrum/spectral_lift.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "isp/model/sensor/photon.h"
#include "isp/model/spectrum/cie_data.h"
#include "isp/model/spectrum/max_entropy.h"

namespace lowlux::isp {
namespace {

constexpr double gamma = 1e-6;
constexpr double locus_margin = 0.98;  // fraction of the way from white to the locus
constexpr std::array<std::array<double, 2>, 2> unit{{{1, 0}, {0, 1}}};

struct Nodes {
  std::array<Vector3, lift_nodes> cmf;       // xbar, ybar, zbar
  std::array<double, lift_nodes> weight_nm;  // trapezium rule
};

const Nodes& nodes() {
  static const Nodes all = [] {
    Nodes out;
    for (int i = 0; i < lift_nodes; ++i) {
      for (int c = 0; c < 3; ++c) out.cmf[i][c] = cie_1931_observer()[c].at(lift_wavelength_nm(i));
      out.weight_nm[i] = i == 0 || i == lift_nodes - 1 ? 2.5 : 5;
    }
    return out;
  }();
  return all;
}

/// Returns the spectral locus at the nodes, closed by the line of purples.
const std::array<Xy, lift_nodes>& locus() {
  static const std::array<Xy, lift_nodes> all = [] {
    std::array<Xy, lift_nodes> out;
    for (int i = 0; i < lift_nodes; ++i) out[i] = *xy_of(xyz_of(nodes().cmf[i]));
    return out;
  }();
  return all;
}

/// Returns the distance at which the ray from white through xy leaves the locus, in units of the distance to xy.
double reach(const Xy& xy) {
  const double dx = xy.x - white_e.x, dy = xy.y - white_e.y;
  double nearest = std::numeric_limits<double>::infinity();
  for (int i = 0; i < lift_nodes; ++i) {
    const Xy& a = locus()[i];
    const Xy& b = locus()[(i + 1) % lift_nodes];
    const double ex = b.x - a.x, ey = b.y - a.y;
    const double cross = dx * ey - dy * ex;
    if (cross == 0) continue;
    const double ax = a.x - white_e.x, ay = a.y - white_e.y;
    const double along = (ax * ey - ay * ex) / cross, on_edge = (ax * dy - ay * dx) / cross;
    if (along > 0 && on_edge >= 0 && on_edge <= 1) nearest = std::min(nearest, along);
  }
  return nearest;
}

std::optional<std::array<double, 2>> fit(const Xy& xy, const std::array<double, 2>& start) {
  SpectralBasis<2> basis;
  for (int i = 0; i < lift_nodes; ++i) {
    const Vector3& c = nodes().cmf[i];
    const double sum = c[0] + c[1] + c[2];
    basis.f.push_back({c[0] - xy.x * sum, c[1] - xy.y * sum});
    basis.weight_nm.push_back(nodes().weight_nm[i]);
  }
  const auto found = fit_max_entropy<2>(basis, {0, 0}, unit, gamma, start);
  if (!found) return std::nullopt;
  return found->theta;
}

/// Returns the power at the nodes for X + Y + Z = 1 cd/m2 [W m-2 sr-1 nm-1].
std::array<double, lift_nodes> power(const Xy& xy, const std::array<double, 2>& theta) {
  std::array<double, lift_nodes> p{};
  double sum = 0;
  for (int i = 0; i < lift_nodes; ++i) {
    const Vector3& c = nodes().cmf[i];
    const double s = c[0] + c[1] + c[2];
    p[i] = std::exp(theta[0] * (c[0] - xy.x * s) + theta[1] * (c[1] - xy.y * s));
    sum += nodes().weight_nm[i] * p[i] * s;
  }
  for (double& value : p) value /= luminous_efficacy_lm_w * sum;
  return p;
}

}  // namespace

Xy liftable(const Xy& xy) {
  const double farthest = locus_margin * reach(xy);
  if (farthest >= 1) return xy;
  return {white_e.x + farthest * (xy.x - white_e.x), white_e.y + farthest * (xy.y - white_e.y)};
}

double excitation_purity(const Xy& xy) { return 1 / reach(xy); }

std::optional<Spectrum> lift(const Xyz& colour_cd_m2) {
  const std::optional<Xy> xy = xy_of(colour_cd_m2);
  if (!xy || !(liftable(*xy) == *xy)) return std::nullopt;
  const auto theta = fit(*xy, {0, 0});
  if (!theta) return std::nullopt;
  const auto unit_power = power(*xy, *theta);
  std::vector<double> nm(lift_nodes), value(lift_nodes);
  for (int i = 0; i < lift_nodes; ++i) {
    nm[i] = lift_wavelength_nm(i);
    value[i] = unit_power[i] * (colour_cd_m2.x + colour_cd_m2.y + colour_cd_m2.z);
  }
  return *Spectrum::of(std::move(nm), std::move(value));
}

LiftTable::LiftTable(const SpectralResponse& response) : nodes_(static_cast<std::size_t>(rows) * columns) {
  std::array<Vector3, lift_nodes> charge_per_power{};  // [e- s-1 per W m-2 sr-1 nm-1]
  for (int i = 0; i < lift_nodes; ++i) {
    const double nm = lift_wavelength_nm(i);
    for (int k = 0; k < 3; ++k) {
      charge_per_power[i][k] =
          response.etendue_m2_sr * nodes().weight_nm[i] / photon_energy_j(nm) * response.quantum_efficiency[k].at(nm);
    }
  }
  for (int row = 0; row < rows; ++row) {
    std::array<double, 2> theta{};
    for (int column = 0; column < columns; ++column) {
      const Xy xy = liftable({column / double{steps_per_unit}, row / double{steps_per_unit}});
      theta = fit(xy, theta).value_or(std::array<double, 2>{});
      const auto p = power(xy, theta);
      Vector3 rate{};
      for (int i = 0; i < lift_nodes; ++i) {
        for (int k = 0; k < 3; ++k) rate[k] += p[i] * charge_per_power[i][k];
      }
      Node& node = nodes_[static_cast<std::size_t>(row) * columns + column];
      for (int k = 0; k < 3; ++k) node.response[k] = static_cast<float>(rate[k]);
      for (int k = 0; k < 2; ++k) node.multipliers[k] = static_cast<float>(theta[k]);
    }
  }
}

namespace {

/// Holds the position of a chromaticity in the table: the cell and the offset in it.
struct Cell {
  std::size_t corner;
  float tx, ty;
};

Cell cell_of(float x, float y) {
  const float cx = std::clamp(x * LiftTable::steps_per_unit, 0.0f, LiftTable::columns - 1.001f);
  const float cy = std::clamp(y * LiftTable::steps_per_unit, 0.0f, LiftTable::rows - 1.001f);
  const int column = static_cast<int>(cx), row = static_cast<int>(cy);
  return {static_cast<std::size_t>(row) * LiftTable::columns + column, cx - column, cy - row};
}

float bilinear(const Cell& c, float v00, float v10, float v01, float v11) {
  const float top = v00 + c.tx * (v10 - v00), bottom = v01 + c.tx * (v11 - v01);
  return top + c.ty * (bottom - top);
}

}  // namespace

float LiftTable::response(int channel, float x, float y) const {
  const Cell c = cell_of(x, y);
  const Node* n = &nodes_[c.corner];
  return bilinear(c, n[0].response[channel], n[1].response[channel], n[columns].response[channel],
                  n[columns + 1].response[channel]);
}

std::array<float, 2> LiftTable::multipliers(float x, float y) const {
  const Cell c = cell_of(x, y);
  const Node* n = &nodes_[c.corner];
  std::array<float, 2> out{};
  for (int k = 0; k < 2; ++k) {
    out[k] =
        bilinear(c, n[0].multipliers[k], n[1].multipliers[k], n[columns].multipliers[k], n[columns + 1].multipliers[k]);
  }
  return out;
}

std::array<float, lift_nodes> lifted_power(const LiftTable& table, const Xyz& colour_cd_m2) {
  std::array<float, lift_nodes> out{};
  const std::optional<Xy> seen = xy_of(colour_cd_m2);
  if (!seen) return out;
  const Xy xy = liftable(*seen);
  const auto m = table.multipliers(static_cast<float>(xy.x), static_cast<float>(xy.y));
  const auto unit_power = power(xy, {m[0], m[1]});
  const double sum = colour_cd_m2.x + colour_cd_m2.y + colour_cd_m2.z;
  for (int i = 0; i < lift_nodes; ++i) out[i] = static_cast<float>(unit_power[i] * sum);
  return out;
}

}  // namespace lowlux::isp
