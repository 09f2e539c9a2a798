#include "calib/dark/light_in_darks.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <utility>
#include <vector>

#include <fmt/format.h>

namespace lowlux::calib {
namespace {

constexpr double certain = 5;             // standard errors
constexpr double min_gradient = 0.25;     // of the dark charge, from edge to edge
constexpr double far_off = 2, off = 0.5;  // standard deviations of a pixel
constexpr double far_off_range = 1e-3;
constexpr double below = 4;  // standard deviations
constexpr double max_below = 0.01;
constexpr int tile_px = 32;
constexpr double dark_tiles = 0.1;  // of all tiles

PixelMask outliers_of(const DarkGroup& group, const PerSite<DarkSite>& sites) {
  PixelMask mask(group.mean_dn.width(), group.mean_dn.height());
  for (int y = 0; y < mask.height(); ++y) {
    for (int x = 0; x < mask.width(); ++x) {
      const SiteSpread& s = sites[site_of(x, y)].spread;
      // A gradient widens the spread itself; only hot pixels lie far outside it.
      mask.at(x, y) = std::fabs(group.mean_dn.at(x, y) - s.median) > certain * std::max(s.deviation, 0.5) ? 1 : 0;
    }
  }
  return mask;
}

struct Tile {
  double mean_dn = 0, noise_dn2 = 0;
};

/// Returns the mean and the noise of one site in a tile, from pairs of neighbours that share no pixel.
Tile measure_tile(const RawDn& picture, int site, const Rect& tile) {
  double sum = 0, squares = 0, pairs = 0;
  for (int y = tile.y + (site >> 1); y < tile.y + tile.height; y += 2) {
    const std::uint16_t* codes = picture.dn.row(picture.active.y + y) + picture.active.x;
    for (int x = tile.x + (site & 1); x + 2 < tile.x + tile.width; x += 4) {
      const double difference = codes[x + 2] - codes[x];
      sum += codes[x] + codes[x + 2];
      squares += difference * difference;
      ++pairs;
    }
  }
  return {sum / pairs / 2, squares / pairs / 2};
}

}  // namespace

double darkest_noise_dn2(const RawDn& picture, int site) {
  const Rect& active = picture.active;
  std::vector<Tile> tiles;
  for (int y = 0; y < active.height; y += tile_px) {
    for (int x = 0; x < active.width; x += tile_px) {
      const int width = std::min(tile_px, active.width - x), height = std::min(tile_px, active.height - y);
      if (2 * width >= tile_px && 2 * height >= tile_px)
        tiles.push_back(measure_tile(picture, site, {x, y, width, height}));
    }
  }
  if (tiles.empty()) return 0;
  const auto count = static_cast<std::ptrdiff_t>(1 + dark_tiles * static_cast<double>(tiles.size() - 1));
  std::ranges::nth_element(tiles, tiles.begin() + count - 1, {}, &Tile::mean_dn);
  const auto middle = tiles.begin() + count / 2;
  std::nth_element(tiles.begin(), middle, tiles.begin() + count,
                   [](const Tile& a, const Tile& b) { return a.noise_dn2 < b.noise_dn2; });
  return middle->noise_dn2;
}

Result<void> check_even_dark(const DarkGroup& group, const PerSite<DarkSite>& sites,
                             const std::optional<PerSite<double>>& pedestal_dn) {
  const double one = 1;
  const PixelMask mask = outliers_of(group, sites);
  for (int site = 0; site < 4; ++site) {
    const ImageFigures f = figures_of({{&group, 1}, {&one, 1}}, mask, site);
    const double charge = pedestal_dn ? std::max(0.0, f.mean - (*pedestal_dn)[site]) : 0;
    const double floor = std::max(std::sqrt(sites[site].noise_dn2), min_gradient * charge);
    for (const auto& [change, error] : {std::pair(f.change_x, f.error_x), std::pair(f.change_y, f.error_y)}) {
      if (std::fabs(change) <= std::max(certain * error, floor)) continue;
      return fail(
          ErrorCode::malformed,
          fmt::format("the darks of {:g} s change by {:.3g} DN across the frame, at most {:.3g} DN by dark current; "
                      "light reaches the sensor, or the sensor glows; cover camera and viewfinder and take them again",
                      *group.setting.exposure_s, std::fabs(change), floor));
    }
  }
  return {};
}

Result<std::optional<std::string>> check_masked_level(const RawDn& picture, const PerSite<double>& masked_dn,
                                                      const DarkFrame& dark) {
  double worst = 0;
  for (int site = 0; site < 4; ++site) {
    const double distance = dark.mean_dn[site] - masked_dn[site];
    const double range = *std::ranges::min_element(picture.white_dn) - masked_dn[site];
    if (std::fabs(distance) > std::max(far_off * dark.noise_std_dn[site], far_off_range * range)) {
      return fail(ErrorCode::malformed,
                  fmt::format("the darks are {:.3g} DN {} the masked pixels of the image; {}; take them again, "
                              "covered, at the temperature of the image",
                              std::fabs(distance), distance > 0 ? "above" : "below",
                              distance > 0 ? "light reaches the sensor, or they are warmer" : "they are colder"));
    }
    if (std::fabs(distance) > off * dark.noise_std_dn[site] && std::fabs(distance) > std::fabs(worst)) worst = distance;
  }
  if (worst == 0) return std::nullopt;
  return fmt::format("the darks differ by {:+.3g} DN from the masked pixels of the image", worst);
}

Result<void> check_below_picture(const RawDn& picture, const DarkFrame& dark) {
  std::int64_t count = 0;
  PerSite<double> margin{};
  for (int site = 0; site < 4; ++site) {
    const double noise_dn = std::max(dark.noise_std_dn[site], std::sqrt(darkest_noise_dn2(picture, site)));
    margin[site] = below * noise_dn + 1;
  }
  for (int y = 0; y < dark.dn.height(); ++y) {
    const std::uint16_t* codes = picture.dn.row(picture.active.y + y) + picture.active.x;
    for (int x = 0; x < dark.dn.width(); ++x) count += codes[x] < dark.dn.at(x, y) - margin[site_of(x, y)];
  }
  const double share = static_cast<double>(count) / static_cast<double>(dark.dn.size());
  if (share <= max_below) return {};
  return fail(ErrorCode::malformed,
              fmt::format("{:.3g} % of the pixels of the image are more than {:g} standard deviations below the darks, "
                          "at most {:g} % are allowed; light reached the darks, or they are warmer than the image; "
                          "take them again, covered, at the temperature of the image",
                          100 * share, below, 100 * max_below));
}

namespace {

constexpr double min_deviation_dn = 1e-3;
constexpr double far_out = 5;  // standard deviations: excluded from means
constexpr double hot = 8;      // standard deviations
constexpr std::size_t fewest_hot = 16;

double noise_of_differences(const Plane<float>& dn, int site) {
  Plane<float> difference(dn.width() - 2, dn.height());
  for (int y = 0; y < difference.height(); ++y) {
    for (int x = 0; x < difference.width(); ++x) difference.at(x, y) = dn.at(x + 2, y) - dn.at(x, y);
  }
  const double deviation = spread_of(difference, site, min_deviation_dn).deviation;
  return deviation * deviation / 2;
}

}  // namespace

PerSite<DarkSite> sites_of(const DarkGroup& group) {
  PerSite<DarkSite> out{};
  for (int site = 0; site < 4; ++site) {
    const SiteSpread spread = spread_of(group.mean_dn, site, min_deviation_dn);
    double sum = 0, n = 0;
    for (int y = site >> 1; y < group.mean_dn.height(); y += 2) {
      for (int x = site & 1; x < group.mean_dn.width(); x += 2) {
        if (std::fabs(group.mean_dn.at(x, y) - spread.median) > far_out * spread.deviation) continue;
        sum += group.variance_dn2.at(x, y);
        ++n;
      }
    }
    out[site] = {spread, group.frames > 1 && n > 0 ? sum / n : noise_of_differences(group.mean_dn, site)};
  }
  return out;
}

double hot_pixel_gain_dn(const DarkGroup& group, const PerSite<DarkSite>& sites) {
  if (group.frames < 2) return 0;
  std::vector<double> gains;
  for (int y = 0; y < group.mean_dn.height(); ++y) {
    for (int x = 0; x < group.mean_dn.width(); ++x) {
      const DarkSite& site = sites[site_of(x, y)];
      const double excess = group.mean_dn.at(x, y) - site.spread.median;
      if (excess * excess <= hot * hot * site.noise_dn2 || excess <= 0) continue;
      gains.push_back((group.variance_dn2.at(x, y) - site.noise_dn2) / excess);
    }
  }
  if (gains.size() < fewest_hot) return 0;
  const auto middle = gains.begin() + static_cast<std::ptrdiff_t>(gains.size() / 2);
  std::ranges::nth_element(gains, middle);
  const double degrees = group.frames - 1;
  return std::max(0.0, *middle / std::pow(1 - 2 / (9 * degrees), 3));
}

}  // namespace lowlux::calib
