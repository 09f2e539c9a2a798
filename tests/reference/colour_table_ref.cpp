#include "tests/reference/colour_table_ref.h"

#include <algorithm>
#include <cmath>

namespace lowlux::reference {
namespace {

/// Holds the node below a position on an axis of `cells`, and the weights of it and the next.
struct Step {
  int node;
  double weight[2];
};

Step step_of(double place, int cells) {
  const double inside = std::clamp(place, 0.0, static_cast<double>(cells));
  const int node = std::min(static_cast<int>(std::floor(inside)), cells - 1);
  return {node, {1 - (inside - node), inside - node}};
}

/// Returns the position of a sum or ratio among the levels: octaves above the lowest, linear within each.
double level_of(const isp::ColourTable& table, double value) {
  const int octave = std::ilogb(value);
  return (octave - table.first_level_log2 + std::ldexp(value, -octave) - 1) * table.levels_per_octave;
}

}  // namespace

Vector3 through_colour_table(const isp::ColourTable& table, const Vector3& rgb, double noise_to_signal) {
  Vector3 in{};
  for (int c = 0; c < 3; ++c) in[c] = std::isnan(rgb[c]) ? 0 : std::clamp(rgb[c], -1e30, 1e30);
  const Vector3& w = table.luminance;
  const double luminance = w[0] * in[0] + w[1] * in[1] + w[2] * in[2];
  if (!(luminance > 1e-30)) {
    return {luminance * table.grey[0], luminance * table.grey[1], luminance * table.grey[2]};
  }
  double sum = in[0] + in[1] + in[2];
  const double least = std::min({in[0], in[1], in[2]});
  if (least < -table.margin * sum) {
    const double room = luminance * (1 + 3 * table.margin);
    const double t = room / (room - least - table.margin * sum);
    for (double& c : in) c = luminance + t * (c - luminance);
    sum = in[0] + in[1] + in[2];
  }
  const double nodes = table.cells / (1 + 3 * table.margin);
  const Step x = step_of((in[0] / sum + table.margin) * nodes, table.cells);
  const Step y = step_of((in[1] / sum + table.margin) * nodes, table.cells);
  const double level_value = table.by_noise ? std::clamp(noise_to_signal, 1e-6, 1e6) : sum;
  const Step z = table.levels == 1 ? Step{0, {1, 0}} : step_of(level_of(table, level_value), table.levels - 1);
  const int side = table.cells + 1;
  Vector3 out{};
  for (int corner = 0; corner < 8; ++corner) {
    const int dx = corner & 1, dy = corner / 2 & 1, dz = corner / 4;
    if (z.weight[dz] == 0) continue;
    const int node = ((z.node + dz) * side + y.node + dy) * side + x.node + dx;
    for (int c = 0; c < 3; ++c) {
      out[c] += sum * x.weight[dx] * y.weight[dy] * z.weight[dz] * static_cast<double>(table.node[4 * node + c]);
    }
  }
  return out;
}

}  // namespace lowlux::reference
