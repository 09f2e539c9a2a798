#include "capture/dng/quad_bayer.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

namespace lowlux::capture {
namespace {

constexpr int period = 4;
constexpr double largest_code = 65535;
using Colours = std::array<double, 4>;  // of 2 x 2 blocks

/// Returns the colours of the blocks whose first one begins at (x, y); nullopt if one has several colours.
std::optional<Colours> blocks_at(std::span<const double> pattern, int x, int y) {
  Colours out{};
  for (int block = 0; block < 4; ++block) {
    const int left = x + 2 * (block % 2), top = y + 2 * (block / 2);
    const auto colour = [&](int site) {
      const int row = (top + site / 2) % period, column = (left + site % 2) % period;
      return pattern[static_cast<std::size_t>(row) * period + static_cast<std::size_t>(column)];
    };
    out[static_cast<std::size_t>(block)] = colour(0);
    if (colour(1) != colour(0) || colour(2) != colour(0) || colour(3) != colour(0)) return std::nullopt;
  }
  return out;
}

std::optional<BayerPhase> phase_of(const Colours& colours) {
  for (const BayerPhase phase : {BayerPhase::rggb, BayerPhase::grbg, BayerPhase::gbrg, BayerPhase::bggr}) {
    bool alike = true;
    for (int site = 0; site < 4; ++site) {
      const CfaColour expected = colour_at(phase, site & 1, site >> 1);
      alike = alike && colours[static_cast<std::size_t>(site)] == static_cast<double>(expected);
    }
    if (alike) return phase;
  }
  return std::nullopt;
}

/// Maps positions to blocks, of which the first begins at `first`.
struct Axis {
  int first = 0;
  int block_from(int at) const { return (at - first + 1) >> 1; }  // the first one that begins at `at` or later
  int block_of(int at) const { return (at - first) >> 1; }
};

/// Returns the blocks that are completely within a rectangle.
Rect inside(const Rect& sites, const Axis& x, const Axis& y) {
  const int left = x.block_from(sites.x), top = y.block_from(sites.y);
  return {left, top, std::max(x.block_of(sites.x + sites.width) - left, 0),
          std::max(y.block_of(sites.y + sites.height) - top, 0)};
}

BlackLevel sum_of(const BlackLevel& site, const QuadBayer& mosaic, const Rect& active) {
  BlackLevel out{.rows = site.rows % 2 == 0 ? site.rows / 2 : site.rows,
                 .columns = site.columns % 2 == 0 ? site.columns / 2 : site.columns};
  BlackLevel pattern = site;
  pattern.row_dn.clear();
  pattern.column_dn.clear();
  for (int y = 0; y < out.rows; ++y) {
    for (int x = 0; x < out.columns; ++x) {
      const int left = mosaic.x + 2 * x, top = mosaic.y + 2 * y;
      out.pattern_dn.push_back(pattern.at(left, top) + pattern.at(left + 1, top) + pattern.at(left, top + 1) +
                               pattern.at(left + 1, top + 1));
    }
  }
  const auto sums = [](const std::vector<double>& deltas, int first, int blocks) {
    std::vector<double> of_blocks;
    for (int i = 0; !deltas.empty() && i < blocks; ++i) {
      const auto at = static_cast<std::size_t>(first) + 2 * static_cast<std::size_t>(i);
      of_blocks.push_back(2 * (deltas[at] + deltas[at + 1]));
    }
    return of_blocks;
  };
  out.column_dn = sums(site.column_dn, mosaic.x, active.width);
  out.row_dn = sums(site.row_dn, mosaic.y, active.height);
  return out;
}

/// Returns the sums of all blocks of a readout.
template <class To, class From>
Plane<To> sums_of(PlaneView<const From> sites, const Axis& x, const Axis& y, double white) {
  Plane<To> out(x.block_of(sites.width), y.block_of(sites.height));
  for (int row = 0; row < out.height(); ++row) {
    const From* const above = sites.row(y.first + 2 * row);
    const From* const below = sites.row(y.first + 2 * row + 1);
    for (int column = 0; column < out.width(); ++column) {
      const int at = x.first + 2 * column;
      const std::array<double, 4> values{static_cast<double>(above[at]), static_cast<double>(above[at + 1]),
                                         static_cast<double>(below[at]), static_cast<double>(below[at + 1])};
      const double sum = values[0] + values[1] + values[2] + values[3];
      const bool saturated = *std::max_element(values.begin(), values.end()) >= white;
      const double value = saturated ? std::max(sum, 4 * white) : sum;
      out.at(column, row) = static_cast<To>(std::is_integral_v<To> ? std::min(value, largest_code) : value);
    }
  }
  return out;
}

void bin_samples(RawDn& raw, const Axis& x, const Axis& y) {
  const double white = *std::min_element(raw.white_dn.begin(), raw.white_dn.end());
  if (raw.is_float()) {
    raw.dn_float = sums_of<float>(std::as_const(raw.dn_float).view(), x, y, white);
  } else if (4 * white <= largest_code) {
    raw.dn = sums_of<std::uint16_t>(std::as_const(raw.dn).view(), x, y, white);
  } else {
    raw.dn_float = sums_of<float>(std::as_const(raw.dn).view(), x, y, white);
    raw.dn = {};
  }
}

/// Changes the position of a map's points, which is relative to `sites` before and to `blocks` after.
void bin_points(double& origin, double& spacing, const Axis& axis, int sites, int blocks) {
  const double scale = sites / (2.0 * blocks);
  origin = (origin - static_cast<double>(axis.first) / sites) * scale;
  spacing *= scale;
}

/// @param x, y    of the active area
/// @param sites   the active area before
void bin_corrections(const Axis& x, const Axis& y, const Rect& sites, RawFrame& frame) {
  const Rect& active = frame.raw.active;
  std::vector<DefectRect>& defects = frame.corrections.defects;
  for (DefectRect& defect : defects) {
    const int left = std::max(x.block_of(defect.x), 0), top = std::max(y.block_of(defect.y), 0);
    const int right = std::min(x.block_of(defect.x + defect.width - 1), active.width - 1);
    const int bottom = std::min(y.block_of(defect.y + defect.height - 1), active.height - 1);
    defect = {left, top, right - left + 1, bottom - top + 1};
  }
  std::erase_if(defects, [](const DefectRect& defect) { return defect.width <= 0 || defect.height <= 0; });
  for (GainMap& map : frame.corrections.gain_maps) {
    map.left = x.block_from(map.left), map.right = x.block_from(map.right);
    map.top = y.block_from(map.top), map.bottom = y.block_from(map.bottom);
    bin_points(map.origin_h, map.spacing_h, x, sites.width, active.width);
    bin_points(map.origin_v, map.spacing_v, y, sites.height, active.height);
  }
}

}  // namespace

std::optional<QuadBayer> quad_bayer_of(std::span<const double> pattern) {
  if (pattern.size() != std::size_t{period} * period) return std::nullopt;
  for (int corner = 0; corner < 4; ++corner) {
    const int x = corner % 2, y = corner / 2;
    const auto colours = blocks_at(pattern, x, y);
    const auto phase = colours ? phase_of(*colours) : std::nullopt;
    if (phase) return QuadBayer{*phase, x, y};
  }
  return std::nullopt;
}

Result<void> bin_quad_bayer(const QuadBayer& mosaic, RawFrame& frame) {
  RawDn& raw = frame.raw;
  const Rect active = raw.active;
  const Axis x{(active.x + mosaic.x) % 2}, y{(active.y + mosaic.y) % 2};  // of the readout
  const Axis active_x{mosaic.x}, active_y{mosaic.y};
  raw.active =
      inside({active.x + mosaic.x, active.y + mosaic.y, active.width - mosaic.x, active.height - mosaic.y}, x, y);
  if (raw.active.width == 0 || raw.active.height == 0) {
    return fail(ErrorCode::unsupported, "the active area of " + std::to_string(active.width) + " x " +
                                            std::to_string(active.height) +
                                            " pixels holds no block of 2 x 2 sites of this Quad Bayer mosaic");
  }
  bin_samples(raw, x, y);
  raw.phase = mosaic.phase;
  raw.default_crop = inside(raw.default_crop, active_x, active_y);
  if (raw.default_crop.width == 0 || raw.default_crop.height == 0) {
    raw.default_crop = {0, 0, raw.active.width, raw.active.height};
  }
  for (Rect& area : raw.masked) area = inside(area, x, y);
  std::erase_if(raw.masked, [](const Rect& area) { return area.width == 0 || area.height == 0; });
  if (raw.black_tag) raw.black_tag = sum_of(*raw.black_tag, mosaic, raw.active);
  for (double& white : raw.white_dn) white *= 4;
  for (std::size_t c = 0; frame.noise && c < 3; ++c) {
    frame.noise->scale[c] /= 4;
    frame.noise->offset[c] /= 4;
  }
  frame.noise_ratio = nullptr;
  bin_corrections(active_x, active_y, active, frame);
  frame.warnings.emplace_back(
      "Quad Bayer mosaic: the four sites of one colour are read as one, at half the width and height");
  return {};
}

}  // namespace lowlux::capture
