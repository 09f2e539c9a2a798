#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "capture/x_trans/x_trans_bank.h"
#include "capture/x_trans/x_trans_setting.h"
#include "isp/base/plane.h"

namespace lowlux::capture::x_trans {

/// The samples around a site, each divided by the ratio that its colour has at the site.
using Patch = PlacedFilter;
using Base = std::array<float, terms>;  // weights of the terms
using PlacedFilters = std::array<PlacedFilter, terms>;

inline constexpr int core = 128;   // side of the region that a tile computes
inline constexpr int margin = 12;  // number of sites around it that are read
inline constexpr int padded = core + 2 * margin;

/// Interpolates one tile. Memory is allocated once, by the constructor.
class Tile {
 public:
  explicit Tile(const XTransSetting& setting);

  /// Returns row y of the samples to be filled in, 0 .. padded - 1, each divided by the neutral of its colour. Sites
  /// beyond the mosaic need a value of their colour too.
  float* samples(int y) { return samples_.row(y); }

  /// Interpolates `width` x `height` sites of the core. Site (margin, margin) of the samples is (x, y) of the mosaic.
  /// @param out  height x (3 width): fractions of white
  void run(int x, int y, PlaneView<float> out);

 private:
  std::size_t site_at(int x, int y) const {
    return row_sites_[static_cast<std::size_t>(y)] + column_sites_[static_cast<std::size_t>(x)];
  }
  void compute_ratios();
  Patch patch_of(const SiteFilters& site, int x, int y) const;
  void compute_luma();
  void compute_tensor();
  void mark_saturated();
  void write_pixel(int x, int y, float* rgb);
  /// The range of the sites of a colour.
  struct Range {
    float low = INFINITY, high = -INFINITY;
  };
  /// Returns the range of the sites of a colour in the square that reaches `distance` pixels to each side.
  Range range_of(std::size_t colour, int x, int y, int distance) const;
  /// Computes asinh(v / (2 knee)) of the samples v around the core, clipped to the level up to which no colour
  /// saturates: a logarithm well above the knee, and linear in noise around zero.
  void compress_samples();
  /// Interpolates compressed samples. The ratios of colours are constants there, which the filters keep.
  float compressed_value(const PlacedFilters& filters, const Base& base, int x, int y);
  /// Interpolates close to a saturated site: from compressed samples, so that edges of saturated regions are alike in
  /// all colours and a lamp does not shine into its dark surroundings. Where that gives a value beyond the clipping
  /// level, it is `value`, which was interpolated from all there is.
  float value_near_saturation(const PlacedFilters& filters, const Base& base, float value, std::size_t colour, int x,
                              int y);
  /// Interpolates a colour. A value further below zero than noise explains, where no sample is, is next to a lamp that
  /// does not saturate: it is interpolated from compressed samples too.
  float value_at(const PlacedFilters& filters, const Base& base, const Patch& patch, std::size_t colour, int x, int y);

  XTransSetting setting_;
  std::array<float, 3> neutral_{}, white_{};  // relative to green; white over neutral
  float luma_scale_ = 0, luma_offset_ = 0;    // noise of luma
  float min_white_ = INFINITY;
  float ratio_floor_ = 0, root_offset_ = 0, knee_ = 0;
  float min_value_ = 0;                                           // smallest value that noise explains in dark areas
  bool is_compressed_ = false;                                    // the tile that is run
  std::array<std::size_t, padded> row_sites_{}, column_sites_{};  // offsets whose sum is the index of a site
  Plane<float> samples_, luma_, compressed_;
  std::array<Plane<float>, 3> ratio_;     // by which samples of each colour are divided around a site
  std::array<Plane<float>, 4> row_sums_;  // scratch
  std::array<Plane<float>, 4> tensor_;    // xx, xy, yy and mean luma
  Plane<std::uint8_t> near_saturated_;
};

}  // namespace lowlux::capture::x_trans
