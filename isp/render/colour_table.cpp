#include "isp/render/colour_table.h"
#include "isp/base/text.h"
#include "isp/model/colour/colour_difference.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cassert>
#include <cmath>
#include <numeric>
#include <optional>
#include <string>
#include <utility>

#include "isp/render/colour_table_rows.h"

namespace lowlux::isp {
namespace {

constexpr int first_cells = 32, first_cells_of_levels = 16, max_cells = 256, max_levels_per_octave = 64;
constexpr int octaves = 18;  // one level in each: 86 KiB
constexpr int floats_per_node = 4;
constexpr double widest_margin = 1.0 / 16;
constexpr double largest_answer = 1e30;  // for a sum of 1, as the kernel's largest input

Vector3 scaled(const Vector3& v, double s) { return {s * v[0], s * v[1], s * v[2]}; }

/// Maps RGB to RGB, in units of the sum R + G + B.
struct RgbMap {
  const ColourMap& map;
  Matrix3 to_xyz;
  Matrix3 to_rgb;

  Vector3 per_sum(const Vector3& shares, double sum) const {
    const Xyz seen = map(xyz_of(to_xyz * scaled(shares, sum)));
    return scaled(to_rgb * vector_of(seen), 1 / sum);
  }
};

double largest_of(const Vector3& v) { return std::max({v[0], v[1], v[2]}); }

/// Returns whether the result per sum is the same at three brightnesses.
bool homogeneous(const RgbMap& map, double limit) {
  constexpr std::array<Vector3, 10> colours{{{1, 1, 1},
                                             {1, 0, 0},
                                             {0, 1, 0},
                                             {0, 0, 1},
                                             {1, 1, 0},
                                             {0, 1, 1},
                                             {1, 0, 1},
                                             {0.6, 0.3, 0.1},
                                             {0.1, 0.5, 0.4},
                                             {0.3, 0.2, 0.5}}};
  return std::all_of(colours.begin(), colours.end(), [&](const Vector3& colour) {
    const double brightest = limit * (colour[0] + colour[1] + colour[2]) / largest_of(colour);
    const Vector3 shares = scaled(colour, 1 / (colour[0] + colour[1] + colour[2]));
    const Vector3 bright = map.per_sum(shares, brightest);
    const double size = std::fabs(bright[0]) + std::fabs(bright[1]) + std::fabs(bright[2]);
    return std::ranges::all_of(std::array{0x1p-5, 0x1p-14}, [&](double scale) {
      const Vector3 dark = map.per_sum(shares, scale * brightest);
      return std::fabs(dark[0] - bright[0]) <= 1e-5 * size && std::fabs(dark[1] - bright[1]) <= 1e-5 * size &&
             std::fabs(dark[2] - bright[2]) <= 1e-5 * size;
    });
  });
}

double fraction_at(const ColourTable& t, double node) { return node * (1 + 3 * t.margin) / t.cells - t.margin; }

/// Returns the sum R + G + B of a level, which may lie between two levels.
double sum_at(const ColourTable& t, double level) {
  const double octave = std::floor(level / t.levels_per_octave);
  const double part = level / t.levels_per_octave - octave;
  return std::ldexp(1 + part, t.first_level_log2 + static_cast<int>(octave));
}

std::size_t nodes_of(int cells, int levels) {
  return (static_cast<std::size_t>(cells) + 1) * (static_cast<std::size_t>(cells) + 1) *
         static_cast<std::size_t>(levels);
}

table_rows::Table view_of(const ColourTable& t) {
  table_rows::Table out{};
  for (int c = 0; c < 3; ++c) {
    out.luminance[c] = static_cast<float>(t.luminance[c]);
    out.grey[c] = static_cast<float>(t.grey[c]);
  }
  out.margin = static_cast<float>(t.margin);
  out.nodes_per_fraction = static_cast<float>(t.cells / (1 + 3 * t.margin));
  out.cells = t.cells;
  out.levels = t.levels;
  out.first_level_bits = std::bit_cast<std::int32_t>(std::ldexp(1.0f, t.first_level_log2));
  out.levels_per_bit = static_cast<float>(std::ldexp(t.levels_per_octave, -23));
  out.node = t.node.data();
  return out;
}

bool fits_floats(const Vector3& v) { return std::fabs(v[0]) + std::fabs(v[1]) + std::fabs(v[2]) <= largest_answer; }

/// Fills the nodes of cells that contain colours; the others stay 0. Returns false if a result exceeds a float.
bool fill(ColourTable& t, const RgbMap& map, double brightest_sum) {
  t.node.assign(nodes_of(t.cells, t.levels) * floats_per_node, 0.0f);
  float* to = t.node.data();
  for (int level = 0; level < t.levels; ++level) {
    const double sum = t.levels == 1 ? brightest_sum : sum_at(t, level);
    for (int y = 0; y <= t.cells; ++y) {
      for (int x = 0; x <= t.cells; ++x, to += floats_per_node) {
        if (x + y > t.cells + 1) continue;
        const double red = fraction_at(t, x), green = fraction_at(t, y);
        const Vector3 seen = map.per_sum({red, green, 1 - red - green}, sum);
        if (!fits_floats(seen)) return false;
        for (int c = 0; c < 3; ++c) to[c] = static_cast<float>(seen[c]);
      }
    }
  }
  return true;
}

/// Holds colours as planar rows.
struct Samples {
  std::vector<float> channel[3];

  void add(const Vector3& rgb) {
    for (int c = 0; c < 3; ++c) channel[c].push_back(static_cast<float>(rgb[c]));
  }
};

/// Returns the colours at the centre of cells, `beyond` above each level, of a table that has levels.
Samples middles(const ColourTable& t, double limit, double beyond) {
  Samples out;
  const int levels = std::max(t.levels - 1, 1);
  for (auto& channel : out.channel) channel.reserve(nodes_of(t.cells, levels));
  for (int level = 0; level < levels; ++level) {
    for (int y = 0; y < t.cells; ++y) {
      for (int x = 0; x < t.cells; ++x) {
        const double red = fraction_at(t, x + 0.5), green = fraction_at(t, y + 0.5);
        const Vector3 shares{red, green, 1 - red - green};
        if (red < 0 || green < 0 || shares[2] < 0) continue;
        const double brightest = limit / largest_of(shares);
        const double sum = t.levels == 1 ? brightest : sum_at(t, level + beyond);
        if (sum <= brightest) out.add(scaled(shares, sum));
      }
    }
  }
  return out;
}

ColourTableError measure(const ColourTable& t, const RgbMap& map, const Samples& in) {
  Samples out = in;
  const auto count = in.channel[0].size();
  float* const to[3] = {out.channel[0].data(), out.channel[1].data(), out.channel[2].data()};
  table_rows::convert_row({in.channel[0].data(), in.channel[1].data(), in.channel[2].data()}, static_cast<int>(count),
                          view_of(t), to);
  const Xyz white = xyz_of(map.to_xyz * Vector3{1, 1, 1});
  std::vector<double> difference(count);
  for (std::size_t i = 0; i < count; ++i) {
    const Vector3 rgb{in.channel[0][i], in.channel[1][i], in.channel[2][i]};
    const Vector3 shown{out.channel[0][i], out.channel[1][i], out.channel[2][i]};
    const Lab exact = lab_of(map.map(xyz_of(map.to_xyz * rgb)), white);
    // ciede2000 treats values that are not numbers as equal.
    const bool usable = std::isfinite(exact.l + exact.a + exact.b);
    difference[i] = usable ? ciede2000(lab_of(xyz_of(map.to_xyz * shown), white), exact) : INFINITY;
  }
  std::sort(difference.begin(), difference.end());
  ColourTableError error{.colours = static_cast<int>(count)};
  error.mean = std::accumulate(difference.begin(), difference.end(), 0.0) / static_cast<double>(count);
  error.p99 = difference[(count - 1) * 99 / 100];
  error.largest = difference.back();
  return error;
}

std::optional<std::string> wrong_with(const ColourTableRequest& r) {
  if (!(r.limit >= 1e-6 && r.limit <= 1e6)) return "a limit of 1e-6 to 1e6, found " + number_text(r.limit);
  if (!(r.error_bound > 0)) return "an error bound above 0, found " + number_text(r.error_bound);
  if (r.largest_bytes < std::size_t{512} << 10 || r.largest_bytes > std::size_t{256} << 20) {
    return "512 KiB to 256 MiB, found " + std::to_string(r.largest_bytes) + " bytes";
  }
  for (const double weight : r.rgb_to_xyz[1]) {
    if (!(weight > 0)) return "primaries that each have luminance, found " + number_text(weight);
  }
  return std::nullopt;
}

/// Returns the next finer table, twice as fine in the direction of the larger error; nullopt at the request's limits.
std::optional<ColourTable> finer(const ColourTable& t, const RgbMap& map, const ColourTableRequest& request) {
  ColourTable next{.luminance = t.luminance, .grey = t.grey, .margin = t.margin, .cells = t.cells};
  next.levels = t.levels;
  next.levels_per_octave = t.levels_per_octave;
  next.first_level_log2 = t.first_level_log2;
  const bool by_levels = t.levels > 1 && measure(t, map, middles(t, request.limit, 0)).p99 < 0.5 * t.error.p99;
  if (by_levels) {
    next.levels = 2 * (t.levels - 1) + 1;
    next.levels_per_octave *= 2;
  } else {
    next.cells *= 2;
  }
  const std::size_t bytes = nodes_of(next.cells, next.levels) * floats_per_node * sizeof(float);
  if (next.cells > max_cells || next.levels_per_octave > max_levels_per_octave || bytes > request.largest_bytes) {
    return std::nullopt;
  }
  return next;
}

}  // namespace

Result<ColourTable> make_colour_table(const ColourMap& map, const ColourTableRequest& request) {
  if (const auto wrong = wrong_with(request)) {
    return fail(ErrorCode::invalid_argument, "a table of colours needs " + *wrong);
  }
  const auto to_rgb = inverse(request.rgb_to_xyz);
  if (!to_rgb) return fail(ErrorCode::invalid_argument, "a table of colours needs three independent primaries");
  const RgbMap rgb_map{map, request.rgb_to_xyz, *to_rgb};
  ColourTable table{.luminance = request.rgb_to_xyz[1], .cells = first_cells};
  const double least = *std::ranges::min_element(table.luminance);
  const double all = table.luminance[0] + table.luminance[1] + table.luminance[2];
  // The corner of the least primary has luminance least + margin (3 least - all): a fifth of `least` is kept.
  table.margin = std::min(widest_margin, 0.8 * least / std::max(all - 3 * least, least));
  const double brightest_sum = 3 * request.limit;
  table.first_level_log2 = static_cast<int>(std::ceil(std::log2(brightest_sum))) - octaves;
  const Vector3 dark = rgb_map.per_sum({1.0 / 3, 1.0 / 3, 1.0 / 3}, sum_at(table, 0));
  table.grey = scaled(dark, 3 / all);
  if (!homogeneous(rgb_map, request.limit)) {
    table.levels = octaves + 1;
    table.cells = first_cells_of_levels;
  }
  for (std::optional<ColourTable> next = table; next;) {
    table = std::move(*next);
    const bool filled = fits_floats(table.grey) && fill(table, rgb_map, brightest_sum);
    if (filled) table.error = measure(table, rgb_map, middles(table, request.limit, 0.5));
    if (!filled || !std::isfinite(table.error.largest)) {
      return fail(ErrorCode::invalid_argument, "the map of colours gives figures that are not finite, or beyond 1e30");
    }
    table.within_bound = table.error.p99 <= request.error_bound;
    if (table.within_bound) break;
    next = finer(table, rgb_map, request);
  }
  return table;
}

void apply_colour_table(const ColourTable& table, const RgbView<const float>& in, const RgbView<float>& out,
                        Executor& executor) {
  const table_rows::Table view = view_of(table);
  const int width = in[0].width, height = in[0].height;
  for (int c = 0; c < 3; ++c) {
    assert(in[c].width == width && in[c].height == height && out[c].width == width && out[c].height == height);
  }
  for_each_band(executor, height, [&](RowBand band, int) {
    for (int y = band.first; y < band.last; ++y) {
      float* const to[3] = {out[0].row(y), out[1].row(y), out[2].row(y)};
      table_rows::convert_row({in[0].row(y), in[1].row(y), in[2].row(y)}, width, view, to);
    }
  });
}

}  // namespace lowlux::isp
