#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "isp/base/cfa.h"
#include "isp/base/plane.h"

namespace lowlux::isp {

/// Models the temporal variance of a code v DN above black: offset_dn2 + gain_dn * v.
struct NoiseLine {
  double gain_dn = 0;  // the system gain [DN/e-]
  double offset_dn2 = 0;
  double gain_error_dn = 0;  // standard errors; a hundredth of each level is included for the effect of detail
  double offset_error_dn2 = 0;
};

/// Measures the means and variances of the four sites in square tiles of a mosaic from sums of columns, and estimates
/// noise and black from them. Memory is reserved in the constructor.
///
/// Variances are of differences between neighbours of one site about the tile's mean difference, halved, so that slopes
/// add nothing. Detail can only increase them: the lowest twentieth of the tiles of one level, divided by the
/// corresponding chi-square quantile, is taken as the noise. Levels whose noise is less than half a code do not count,
/// because rounding hides it.
class TileNoise {
 public:
  /// @param tile  side in pixels, even, at least 8
  TileNoise(int width, int height, int tile);

  int tile() const { return tile_; }
  int tile_rows() const { return rows_; }
  void clear();
  /// Adds sums of the columns of some rows of one row of tiles, separate for even and odd rows: sums of the codes, and
  /// of the squares of their differences from the code two columns to the right. One thread processes each row of
  /// tiles.
  void add_columns(const std::array<const std::uint32_t*, 2>& sums, const std::array<const std::uint32_t*, 2>& squares,
                   int tile_row);

  /// Returns the straight line of variance over level. Returns nullopt where the levels of the frame lie too close
  /// together to separate gain from offset (the gain is not four standard errors above 0), or too few tiles are
  /// complete and not clipped.
  /// @param black_dn  black level of each site
  /// @param white_dn  tiles whose mean is above 0.9 of it do not count
  std::optional<NoiseLine> line(const PerSite<double>& black_dn, double white_dn) const;

  /// Returns the mean that a hundredth of the tiles lie below, site by site: an upper bound of black, where the scene
  /// has a black area. Returns 0 without complete tiles.
  PerSite<double> darkest_dn();

 private:
  struct Tile {
    PerSite<std::uint32_t> sum{};
    PerSite<std::int32_t> difference{};  // sums of differences between neighbours
    PerSite<std::uint64_t> square{};     // sums of the squares of the differences
  };
  int pairs() const { return (tile_ / 2) * (tile_ / 4); }  // pairs of neighbours of one site
  int freedom() const { return pairs() - 1; }              // degrees of freedom of a tile's variance
  std::optional<NoiseLine> line_by(const NoiseLine& expected, const PerSite<double>& black_dn, double white_dn) const;
  double mean_of(const Tile& tile, int site) const;
  double variance_of(const Tile& tile, int site) const;

  int tile_;
  int columns_, rows_;   // numbers of complete tiles
  double low_fraction_;  // fraction of the variance that the lowest twentieth of estimates lies below
  double low_error2_;    // relative, of that quantile from one estimate: p (1 - p) / (density at it times it)^2
  std::vector<Tile> tiles_;
  std::vector<float> memory_;
};

}  // namespace lowlux::isp
