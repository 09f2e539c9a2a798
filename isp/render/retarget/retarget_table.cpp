#include "isp/render/retarget/retarget_table.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>

#include "isp/model/colour/colorimetry.h"
#include "isp/model/colour/colour_difference.h"
#include "isp/render/output_space.h"

namespace lowlux::isp {
namespace {

constexpr double highest_code = 65535;

std::int32_t packed(double low, double high) {
  const auto code = [](double v) {
    return static_cast<std::uint32_t>(std::lround(highest_code * std::clamp(v, 0.0, 1.0)));
  };
  return static_cast<std::int32_t>(code(low) | code(high) << 16);
}

Vector3 node(const RetargetTable& table, std::size_t number) {
  const auto first = static_cast<std::uint32_t>(table.nodes[2 * number]);
  const auto second = static_cast<std::uint32_t>(table.nodes[2 * number + 1]);
  return {(first & 0xFFFF) / highest_code, (first >> 16) / highest_code, second / highest_code};
}

/// Returns Van der Corput's sequence: the digits of i in a base, mirrored at the point.
double mirrored_digits(int i, int base) {
  double value = 0, weight = 1;
  for (; i > 0; i /= base) {
    weight /= base;
    value += (i % base) * weight;
  }
  return value;
}

Lab lab_of_code(const Vector3& code) {
  static const Matrix3 to_xyz = rgb_to_xyz(primaries_rec709).value();
  Vector3 light{};
  for (std::size_t c = 0; c < 3; ++c) light[c] = decode_transfer(OutputSpace::srgb, code[c]);
  return lab_of(xyz_of(to_xyz * light), xyz_of(to_xyz * Vector3{1, 1, 1}));
}

}  // namespace

RetargetTable tabulated(const CodeMap& map, int levels, Executor& executor) {
  assert(levels >= 2 && levels <= 65);
  RetargetTable table{levels, {}};
  const auto n = static_cast<std::size_t>(levels);
  table.nodes.resize(2 * n * n * n);
  for_each_band(executor, levels * levels, [&](const RowBand& band, int) {
    for (int row = band.first; row < band.last; ++row) {
      for (int b = 0; b < levels; ++b) {
        const double step = 1.0 / (levels - 1);
        const int r = row / levels, g = row % levels;
        const Vector3 out = map({step * r, step * g, step * b});
        const std::size_t number = static_cast<std::size_t>(row) * n + static_cast<std::size_t>(b);
        table.nodes[2 * number] = packed(out[0], out[1]);
        table.nodes[2 * number + 1] = packed(out[2], 0);
      }
    }
  });
  return table;
}

Vector3 looked_up(const RetargetTable& table, const Vector3& code) {
  std::array<std::size_t, 3> axis{0, 1, 2};
  Vector3 fraction{};
  const auto n = static_cast<std::size_t>(table.levels);
  const std::array<std::size_t, 3> stride{n * n, n, 1};
  std::size_t at = 0;
  for (std::size_t c = 0; c < 3; ++c) {
    const double place = code[c] * (table.levels - 1);
    const int cell = std::clamp(static_cast<int>(place), 0, table.levels - 2);
    fraction[c] = place - cell;
    at += static_cast<std::size_t>(cell) * stride[c];
  }
  std::ranges::stable_sort(axis, std::greater(), [&](std::size_t c) { return fraction[c]; });
  Vector3 out{};
  double before = 1;
  for (std::size_t k = 0; k <= 3; ++k) {
    const double after = k < 3 ? fraction[axis[k]] : 0;
    const Vector3 corner = node(table, at);
    for (std::size_t c = 0; c < 3; ++c) out[c] += (before - after) * corner[c];
    if (k < 3) at += stride[axis[k]];
    before = after;
  }
  return out;
}

TableError table_error(const RetargetTable& table, const CodeMap& map, int colours, Executor& executor) {
  assert(colours > 0);
  std::vector<std::array<double, 2>> errors(static_cast<std::size_t>(colours));  // CIEDE2000, steps
  for_each_band(executor, colours, [&](const RowBand& band, int) {
    for (int i = band.first; i < band.last; ++i) {
      const Vector3 code{mirrored_digits(i, 2), mirrored_digits(i, 3), mirrored_digits(i, 5)};
      const Vector3 exact = map(code), got = looked_up(table, code);
      double steps = 0;
      for (std::size_t c = 0; c < 3; ++c) steps = std::max(steps, 255 * std::abs(got[c] - exact[c]));
      errors[static_cast<std::size_t>(i)] = {ciede2000(lab_of_code(exact), lab_of_code(got)), steps};
    }
  });
  TableError out;
  for (const auto& [difference, steps] : errors) {
    out.mean_ciede2000 += difference / colours;
    out.mean_steps += steps / colours;
    out.max_ciede2000 = std::max(out.max_ciede2000, difference);
    out.max_steps = std::max(out.max_steps, steps);
  }
  return out;
}

MeasuredTable tabulated_to(const CodeMap& map, double mean_ciede2000, Executor& executor) {
  constexpr int colours = 2048;
  MeasuredTable out;
  for (const int levels : {33, 65}) {
    out.table = tabulated(map, levels, executor);
    out.error = table_error(out.table, map, colours, executor);
    if (out.error.mean_ciede2000 <= mean_ciede2000) break;
  }
  return out;
}

}  // namespace lowlux::isp
