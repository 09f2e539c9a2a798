#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "isp/base/cfa.h"
#include "isp/base/plane.h"

namespace lowlux::isp {

/// Temporal variance of a code v DN above black: offset_dn2 + gain_dn * v.
struct NoiseLine {
  double gain_dn = 0;  // the system gain [DN/e-]
  double offset_dn2 = 0;
  double gain_error_dn = 0;  // standard errors; of each level a hundredth is taken for what detail adds
  double offset_error_dn2 = 0;
};

/// Means and variances of the four sites in square tiles of a mosaic, taken from sums of columns, and what they tell of
/// its noise and its black. Memory is reserved in the constructor.
///
/// Variances are of differences between neighbours of one site about the tile's mean difference, halved, so that slopes
/// add nothing. Detail only adds: of the tiles of one level the lowest twentieth, divided by what chi-square has there,
/// is taken for the noise. Levels whose noise is less than half a code do not count: rounding hides it.
class TileNoise {
 public:
  /// @param tile  side in pixels, even, at least 8
  TileNoise(int width, int height, int tile);

  int tile() const { return tile_; }
  int tile_rows() const { return rows_; }
  void clear();
  /// Sums of the columns of some rows of one row of tiles, of even and of odd rows apart: of the codes, and of the
  /// squares of their differences from the code two columns on. One thread for each row of tiles.
  void add_columns(const std::array<const std::uint32_t*, 2>& sums, const std::array<const std::uint32_t*, 2>& squares,
                   int tile_row);

  /// The straight line of variance over level. Nullopt where the levels of the frame lie too close together to tell
  /// gain from offset (the gain is not four standard errors above 0), or too few tiles are whole and not clipped.
  /// @param black_dn  of the sites
  /// @param white_dn  tiles whose mean is above 0.9 of it do not count
  std::optional<NoiseLine> line(const PerSite<double>& black_dn, double white_dn) const;

  /// The mean that a hundredth of the tiles lie below, site by site: what black is at most, where the scene has a black
  /// place. 0 without whole tiles.
  PerSite<double> darkest_dn();

 private:
  struct Tile {
    PerSite<std::uint32_t> sum{};
    PerSite<std::int32_t> difference{};  // sums of differences between neighbours
    PerSite<std::uint64_t> square{};     // and of their squares
  };
  int pairs() const { return (tile_ / 2) * (tile_ / 4); }  // of neighbours of one site
  int freedom() const { return pairs() - 1; }              // of a tile's variance
  std::optional<NoiseLine> line_by(const NoiseLine& expected, const PerSite<double>& black_dn, double white_dn) const;
  double mean_of(const Tile& tile, int site) const;
  double variance_of(const Tile& tile, int site) const;

  int tile_;
  int columns_, rows_;  // whole tiles
  double low_share_;    // of the variance, that the lowest twentieth of estimates lies below
  double low_error2_;   // relative, of that quantile of one estimate: p (1 - p) / (density at it times it)^2
  std::vector<Tile> tiles_;
  std::vector<float> memory_;
};

}  // namespace lowlux::isp
