#include "calib/flat/pair_statistics.h"

#include <algorithm>
#include <array>
#include <vector>

namespace lowlux::calib {
namespace {

// Shading of the light varies slowly: within a block it is negligible compared with the pattern of single pixels.
constexpr int block_sites = 32;
constexpr int block_pixels = 2 * block_sites;

/// Sums of codes as integers, to avoid cancellation. 2^28 pixels of 16 bits stay below 2^60.
struct BlockSums {
  std::int64_t pixels = 0, a = 0, b = 0, ab = 0;
};

struct SiteSums {
  std::int64_t pixels = 0, a = 0, b = 0, difference_squared = 0, at_white = 0, at_zero = 0;
  int rows = 0;
  double row_squares = 0;      // sum over rows of (sum of b - a)^2 / pixels
  double within_products = 0;  // sum over blocks of the products about the block's means
  std::int64_t within_degrees = 0;
};

using SiteBlocks = std::array<std::vector<BlockSums>, 4>;

/// Sums of the codes of a column in rows of one parity: those of one site.
struct ColumnSums {
  std::int64_t a = 0, b = 0;
};

struct Codes {
  PlaneView<const std::uint16_t> a, b;
};

struct RowSite {
  int y;
  int parity;  // parity of the site's columns
  double white_dn;
};

void add_row(const Codes& codes, const RowSite& which, SiteSums& sums, std::vector<BlockSums>& blocks,
             std::vector<ColumnSums>& columns) {
  const std::uint16_t* a = codes.a.row(which.y);
  const std::uint16_t* b = codes.b.row(which.y);
  std::int64_t row_difference = 0, row_pixels = 0;
  for (int x0 = 0; x0 < codes.a.width; x0 += block_pixels) {
    BlockSums& block = blocks[x0 / block_pixels];
    for (int x = x0 + which.parity; x < std::min(codes.a.width, x0 + block_pixels); x += 2) {
      const std::int64_t va = a[x], vb = b[x], d = vb - va;
      ++block.pixels;
      block.a += va;
      block.b += vb;
      block.ab += va * vb;
      columns[x].a += va;
      columns[x].b += vb;
      ++row_pixels;
      row_difference += d;
      sums.difference_squared += d * d;
      sums.at_white += (static_cast<double>(va) >= which.white_dn) + (static_cast<double>(vb) >= which.white_dn);
      sums.at_zero += (va == 0) + (vb == 0);
    }
  }
  ++sums.rows;
  const auto difference = static_cast<double>(row_difference);
  sums.row_squares += difference * difference / static_cast<double>(row_pixels);
}

void close_blocks(SiteBlocks& blocks, PerSite<SiteSums>& sums) {
  for (int site = 0; site < 4; ++site) {
    for (BlockSums& block : blocks[site]) {
      if (block.pixels > 0) {
        const double mean_a = static_cast<double>(block.a) / static_cast<double>(block.pixels);
        sums[site].within_products += static_cast<double>(block.ab) - mean_a * static_cast<double>(block.b);
        sums[site].within_degrees += block.pixels - 1;
      }
      sums[site].pixels += block.pixels;
      sums[site].a += block.a;
      sums[site].b += block.b;
      block = {};
    }
  }
}

// Computes an analysis of variance with rows as groups of equal size.
SiteStatistics statistics_of(const SiteSums& s) {
  const auto n = static_cast<double>(s.pixels), rows = static_cast<double>(s.rows);
  const auto difference = static_cast<double>(s.b - s.a);
  const double total = static_cast<double>(s.difference_squared) - difference * difference / n;
  const double between = s.row_squares - difference * difference / n;
  const double within = (total - between) / (n - rows);
  SiteStatistics out;
  out.pixels = s.pixels;
  out.rows = s.rows;
  out.mean_dn = static_cast<double>(s.a + s.b) / (2 * n);
  out.drift_dn = difference / n;
  out.variance_dn2 = total / (2 * (n - 1));
  out.row_variance_dn2 = (between / (rows - 1) - within) / (2 * n / rows);
  out.covariance_dn2 = s.within_products / static_cast<double>(s.within_degrees);
  out.fraction_at_white = static_cast<double>(s.at_white) / (2 * n);
  out.fraction_at_zero = static_cast<double>(s.at_zero) / (2 * n);
  return out;
}

/// Returns the part of the covariance that whole columns have in common. The means of columns of n rows covary by it
/// and by 1 / n of the rest.
double column_covariance(const std::vector<ColumnSums>& columns, int parity, const SiteStatistics& site) {
  const double rows = site.rows, count = static_cast<double>(site.pixels) / rows;
  if (count < 2 || rows < 2) return 0;
  double a = 0, b = 0, ab = 0;
  for (auto x = static_cast<std::size_t>(parity); x < columns.size(); x += 2) {
    a += static_cast<double>(columns[x].a) / rows;
    b += static_cast<double>(columns[x].b) / rows;
  }
  for (auto x = static_cast<std::size_t>(parity); x < columns.size(); x += 2) {
    ab +=
        (static_cast<double>(columns[x].a) / rows - a / count) * (static_cast<double>(columns[x].b) / rows - b / count);
  }
  return (ab / (count - 1) - site.covariance_dn2 / rows) / (1 - 1 / rows);
}

PlaneView<const std::uint16_t> active_view(const RawDn& raw) {
  return raw.dn.view().crop(raw.active.x, raw.active.y, raw.active.width, raw.active.height);
}

}  // namespace

Result<PairStatistics> measure_pair(const RawDn& a, const RawDn& b) {
  auto setting = setting_of(a);
  if (!setting) return tl::make_unexpected(setting.error());
  const auto second = setting_of(b);
  if (!second) return tl::make_unexpected(second.error());
  if (auto same = check_same_setting(*setting, *second, "the second frame of a pair"); !same) {
    return tl::make_unexpected(same.error());
  }
  const Codes codes{active_view(a), active_view(b)};
  PerSite<SiteSums> sums{};
  SiteBlocks blocks;
  std::array<std::vector<ColumnSums>, 2> columns;  // by parity of the rows
  for (auto& of_rows : columns) of_rows.resize(static_cast<std::size_t>(codes.a.width));
  for (auto& row_of_blocks : blocks) row_of_blocks.resize((codes.a.width + block_pixels - 1) / block_pixels);
  for (int y = 0; y < codes.a.height; ++y) {
    for (int parity = 0; parity < 2; ++parity) {
      const int site = site_of(parity, y);
      add_row(codes, {y, parity, setting->white_dn[channel_of_site(*setting, site)]}, sums[site], blocks[site],
              columns[y % 2]);
    }
    if (y % block_pixels == block_pixels - 1 || y == codes.a.height - 1) close_blocks(blocks, sums);
  }
  PairStatistics out{std::move(*setting), {}};
  for (int site = 0; site < 4; ++site) {
    out.site[site] = statistics_of(sums[site]);
    out.site[site].column_covariance_dn2 = column_covariance(columns[site >> 1], site & 1, out.site[site]);
  }
  return out;
}

}  // namespace lowlux::calib
