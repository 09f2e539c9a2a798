#include "isp/render/colour_table.h"
#include "isp/base/look_grid.h"
#include "isp/base/text.h"
#include "isp/model/colour/colour_difference.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cassert>
#include <cmath>
#include <numeric>
#include <optional>
#include <span>
#include <string>
#include <utility>

#include "isp/render/colour_table_rows.h"

namespace lowlux::isp {
namespace {

constexpr int first_cells = 32, first_cells_of_levels = 16, max_cells = 256, max_levels_per_octave = 64;
constexpr int octaves = 18;  // one level in each: 86 KiB
constexpr int first_noise_log2 = -5, noise_octaves = 10;
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

/// Supplies the map of each level: one for all, or one for each ratio of noise to signal.
class LevelMaps {
 public:
  LevelMaps(const ColourMap& map, const ColourTableRequest& request, const Matrix3& to_rgb)
      : map_(map), to_xyz_(request.rgb_to_xyz), to_rgb_(to_rgb) {}
  LevelMaps(const NoiseColourMap& maps, const ColourTableRequest& request, const Matrix3& to_rgb)
      : maps_(&maps), to_xyz_(request.rgb_to_xyz), to_rgb_(to_rgb) {}

  bool by_noise() const { return maps_ != nullptr; }
  const Matrix3& to_xyz() const { return to_xyz_; }

  /// Prepares the map of a level; it is valid until the next call.
  Result<RgbMap> at(double level_value) {
    if (maps_ != nullptr) {
      Result<ColourMap> made = (*maps_)(level_value);
      if (!made) return tl::make_unexpected(std::move(made.error()));
      map_ = *std::move(made);
    }
    return RgbMap{map_, to_xyz_, to_rgb_};
  }

 private:
  ColourMap map_;
  const NoiseColourMap* maps_ = nullptr;
  Matrix3 to_xyz_, to_rgb_;
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

/// Returns the sum R + G + B, or the ratio of noise to signal, of a level, which may lie between two levels.
double value_at(const ColourTable& t, double level) {
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

tl::unexpected<Error> not_finite() {
  return fail(ErrorCode::invalid_argument, "the map of colours gives values that are not finite, or beyond 1e30");
}

/// Returns the node of a table that is coarser in cells or levels at the place of one of `t`; null where it has none.
const float* node_at(const ColourTable& coarser, const ColourTable& t, int x, int y, int level) {
  if (coarser.node.empty()) return nullptr;
  const int cells = t.cells / coarser.cells, levels = t.levels_per_octave / coarser.levels_per_octave;
  if (x % cells != 0 || y % cells != 0 || level % levels != 0) return nullptr;
  const auto side = static_cast<std::size_t>(coarser.cells) + 1;
  const auto row = static_cast<std::size_t>(level / levels) * side + static_cast<std::size_t>(y / cells);
  return coarser.node.data() + (row * side + static_cast<std::size_t>(x / cells)) * floats_per_node;
}

/// Fills the nodes of cells that contain colours; the others stay 0. Errors: a result that exceeds a float.
/// @param coarser  a table whose nodes are kept; it may have none
Result<void> fill(ColourTable& t, const ColourTable& coarser, LevelMaps& maps, double brightest_sum) {
  t.node.assign(nodes_of(t.cells, t.levels) * floats_per_node, 0.0f);
  float* to = t.node.data();
  for (int level = 0; level < t.levels; ++level) {
    const Result<RgbMap> map = maps.at(value_at(t, level));
    if (!map) return tl::make_unexpected(map.error());
    const double sum = t.levels == 1 || t.by_noise ? brightest_sum : value_at(t, level);
    for (int y = 0; y <= t.cells; ++y) {
      for (int x = 0; x <= t.cells; ++x, to += floats_per_node) {
        if (x + y > t.cells + 1) continue;
        if (const float* const known = node_at(coarser, t, x, y, level)) {
          std::copy_n(known, floats_per_node, to);
          continue;
        }
        const double red = fraction_at(t, x), green = fraction_at(t, y);
        const Vector3 seen = map->per_sum({red, green, 1 - red - green}, sum);
        if (!fits_floats(seen)) return not_finite();
        for (int c = 0; c < 3; ++c) to[c] = static_cast<float>(seen[c]);
      }
    }
  }
  return {};
}

/// Holds colours as planar rows.
struct Samples {
  std::vector<float> channel[3];

  void add(const Vector3& rgb) {
    for (int c = 0; c < 3; ++c) channel[c].push_back(static_cast<float>(rgb[c]));
  }
};

/// Returns the colours at the centre of cells, at a level that may lie between two, within the limit.
Samples middles(const ColourTable& t, double limit, double level) {
  Samples out;
  for (auto& channel : out.channel) channel.reserve(nodes_of(t.cells, 1));
  for (int y = 0; y < t.cells; ++y) {
    for (int x = 0; x < t.cells; ++x) {
      const double red = fraction_at(t, x + 0.5), green = fraction_at(t, y + 0.5);
      const Vector3 shares{red, green, 1 - red - green};
      if (red < 0 || green < 0 || shares[2] < 0) continue;
      const double brightest = limit / largest_of(shares);
      const double sum = t.levels == 1 || t.by_noise ? brightest : value_at(t, level);
      if (sum <= brightest) out.add(scaled(shares, sum));
    }
  }
  return out;
}

void add_differences(const ColourTable& t, const RgbMap& map, const Samples& in, double level_value,
                     std::vector<double>& difference) {
  Samples out = in;
  const auto count = in.channel[0].size();
  const std::vector<float> levels(t.by_noise ? count : 0, static_cast<float>(level_value));
  float* const to[3] = {out.channel[0].data(), out.channel[1].data(), out.channel[2].data()};
  table_rows::convert_row({in.channel[0].data(), in.channel[1].data(), in.channel[2].data()},
                          t.by_noise ? levels.data() : nullptr, static_cast<int>(count), view_of(t), to);
  const Xyz white = xyz_of(map.to_xyz * Vector3{1, 1, 1});
  for (std::size_t i = 0; i < count; ++i) {
    const Vector3 rgb{in.channel[0][i], in.channel[1][i], in.channel[2][i]};
    const Vector3 shown{out.channel[0][i], out.channel[1][i], out.channel[2][i]};
    const Lab exact = lab_of(map.map(xyz_of(map.to_xyz * rgb)), white);
    // ciede2000 treats values that are not numbers as equal.
    const bool usable = std::isfinite(exact.l + exact.a + exact.b);
    difference.push_back(usable ? ciede2000(lab_of(xyz_of(map.to_xyz * shown), white), exact) : INFINITY);
  }
}

/// Measures the error at the centres of cells, `beyond` above each level of a table that has levels.
Result<ColourTableError> measure(const ColourTable& t, LevelMaps& maps, double limit, double beyond) {
  std::vector<double> difference;
  for (int level = 0; level < std::max(t.levels - 1, 1); ++level) {
    const double value = value_at(t, level + beyond);
    const Result<RgbMap> map = maps.at(value);
    if (!map) return tl::make_unexpected(map.error());
    add_differences(t, *map, middles(t, limit, level + beyond), value, difference);
  }
  std::sort(difference.begin(), difference.end());
  const std::size_t count = difference.size();
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
std::optional<ColourTable> finer(const ColourTable& t, LevelMaps& maps, const ColourTableRequest& request) {
  ColourTable next = t;
  next.node.clear();
  next.error = {};
  const Result<ColourTableError> at_levels = measure(t, maps, request.limit, 0);
  const bool by_levels = t.levels > 1 && at_levels && at_levels->p99 < 0.5 * t.error.p99;
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

/// Fills a table whose cells and levels are set, and makes it finer until its error is within the bound.
Result<ColourTable> refined(ColourTable table, LevelMaps& maps, const ColourTableRequest& request) {
  ColourTable coarser{.cells = table.cells};
  for (std::optional<ColourTable> next = std::move(table); next; coarser = table) {
    table = std::move(*next);
    if (const Result<void> filled = fill(table, coarser, maps, 3 * request.limit); !filled) {
      return tl::make_unexpected(filled.error());
    }
    const Result<ColourTableError> error = measure(table, maps, request.limit, 0.5);
    if (!error) return tl::make_unexpected(error.error());
    if (!std::isfinite(error->largest)) return not_finite();
    table.error = *error;
    table.within_bound = table.error.p99 <= request.error_bound;
    if (table.within_bound) break;
    next = finer(table, maps, request);
  }
  return table;
}

Result<Matrix3> checked_to_rgb(const ColourTableRequest& request) {
  if (const auto wrong = wrong_with(request)) {
    return fail(ErrorCode::invalid_argument, "a table of colours needs " + *wrong);
  }
  const auto to_rgb = inverse(request.rgb_to_xyz);
  if (!to_rgb) return fail(ErrorCode::invalid_argument, "a table of colours needs three independent primaries");
  return *to_rgb;
}

/// Returns a table without nodes, of one level. Error: a grey that exceeds a float.
Result<ColourTable> empty_table(LevelMaps& maps, const ColourTableRequest& request) {
  ColourTable table{.luminance = request.rgb_to_xyz[1], .cells = first_cells};
  const double least = *std::ranges::min_element(table.luminance);
  const double all = table.luminance[0] + table.luminance[1] + table.luminance[2];
  // The corner of the least primary has luminance least + margin (3 least - all): a fifth of `least` is kept.
  table.margin = std::min(widest_margin, 0.8 * least / std::max(all - 3 * least, least));
  table.by_noise = maps.by_noise();
  table.first_level_log2 =
      table.by_noise ? first_noise_log2 : static_cast<int>(std::ceil(std::log2(3 * request.limit))) - octaves;
  const Result<RgbMap> darkest = maps.at(value_at(table, 0));
  if (!darkest) return tl::make_unexpected(darkest.error());
  const double sum = table.by_noise ? 3 * request.limit : value_at(table, 0);
  table.grey = scaled(darkest->per_sum({1.0 / 3, 1.0 / 3, 1.0 / 3}, sum), 3 / all);
  if (!fits_floats(table.grey)) return not_finite();
  return table;
}

}  // namespace

Result<ColourTable> make_colour_table(const ColourMap& map, const ColourTableRequest& request) {
  const Result<Matrix3> to_rgb = checked_to_rgb(request);
  if (!to_rgb) return tl::make_unexpected(to_rgb.error());
  LevelMaps maps(map, request, *to_rgb);
  Result<ColourTable> table = empty_table(maps, request);
  if (!table) return table;
  if (!homogeneous({map, request.rgb_to_xyz, *to_rgb}, request.limit)) {
    table->levels = octaves + 1;
    table->cells = first_cells_of_levels;
  }
  return refined(*std::move(table), maps, request);
}

Result<ColourTable> make_noise_colour_table(const NoiseColourMap& maps_of_ratios, const ColourTableRequest& request) {
  const Result<Matrix3> to_rgb = checked_to_rgb(request);
  if (!to_rgb) return tl::make_unexpected(to_rgb.error());
  LevelMaps maps(maps_of_ratios, request, *to_rgb);
  Result<ColourTable> table = empty_table(maps, request);
  if (!table) return table;
  table->levels = noise_octaves + 1;
  table->cells = first_cells_of_levels;
  return refined(*std::move(table), maps, request);
}

namespace {

[[maybe_unused]] bool equal_sizes(const RgbView<const float>& in, const RgbView<float>& out) {
  for (int c = 0; c < 3; ++c) {
    if (in[c].width != in[0].width || in[c].height != in[0].height) return false;
    if (out[c].width != in[0].width || out[c].height != in[0].height) return false;
  }
  return true;
}

/// Locates the centre of a pixel between the centres of cells: the lower cell, the next, and the fraction of the way.
struct CellPlace {
  int cell;
  int next;
  float t;
};
CellPlace cell_place(int pixel, int cells) {
  const float place = std::max((static_cast<float>(pixel) + 0.5f) / LookGrid::cell - 0.5f, 0.0f);
  const int cell = std::min(static_cast<int>(place), cells - 1);
  return {cell, std::min(cell + 1, cells - 1), place - static_cast<float>(cell)};
}

/// Interpolates row y of the pixels' ratios of signal to noise, and inverts it.
void ratio_row(const PlaneView<const float>& grid, int y, std::span<float> out) {
  const CellPlace down = cell_place(y, grid.height);
  const float *const top = grid.row(down.cell), *const bottom = grid.row(down.next);
  const auto at = [&](int cell) { return top[cell] + down.t * (bottom[cell] - top[cell]); };
  for (std::size_t x = 0; x < out.size(); ++x) {
    const CellPlace across = cell_place(static_cast<int>(x), grid.width);
    const float left = at(across.cell);
    out[x] = 1 / std::clamp(left + across.t * (at(across.next) - left), 1e-6f, 1e6f);
  }
}

}  // namespace

void apply_colour_table(const ColourTable& table, const RgbView<const float>& in, const RgbView<float>& out,
                        Executor& executor) {
  assert(!table.by_noise && equal_sizes(in, out));
  const table_rows::Table view = view_of(table);
  const int width = in[0].width, height = in[0].height;
  for_each_band(executor, height, [&](RowBand band, int) {
    for (int y = band.first; y < band.last; ++y) {
      float* const to[3] = {out[0].row(y), out[1].row(y), out[2].row(y)};
      table_rows::convert_row({in[0].row(y), in[1].row(y), in[2].row(y)}, nullptr, width, view, to);
    }
  });
}

void apply_colour_table(const ColourTable& table, const RgbView<const float>& in, const NoiseGrid& noise,
                        const RgbView<float>& out, Executor& executor) {
  assert(table.by_noise && equal_sizes(in, out));
  assert(noise.signal_to_noise.width == cells_along(in[0].width));
  assert(noise.signal_to_noise.height == cells_along(in[0].height));
  const table_rows::Table view = view_of(table);
  const int width = in[0].width;
  for_each_band(executor, in[0].height, [&](RowBand band, int) {
    std::vector<float> ratio(static_cast<std::size_t>(width));
    for (int y = band.first; y < band.last; ++y) {
      ratio_row(noise.signal_to_noise, y, ratio);
      float* const to[3] = {out[0].row(y), out[1].row(y), out[2].row(y)};
      table_rows::convert_row({in[0].row(y), in[1].row(y), in[2].row(y)}, ratio.data(), width, view, to);
    }
  });
}

}  // namespace lowlux::isp
