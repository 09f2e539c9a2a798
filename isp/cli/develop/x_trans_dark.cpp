#include "isp/cli/develop/x_trans_dark.h"

#include <algorithm>
#include <iterator>
#include <numeric>
#include <utility>

#include "isp/base/executor.h"
#include "isp/raw/subtract_dark_frame.h"

namespace lowlux::cli {
namespace {

/// Replaces the codes by the signal on top of the mean of the dark frame [DN].
void subtract(const DarkFrame& dark, const BlackPoint& black, RawDn& raw) {
  const int width = raw.active.width, height = raw.active.height;
  Plane<float> signal(width, height);
  InlineExecutor alone;  // other threads read other files
  isp::to_fraction(raw, dark, black, signal.view(), alone);
  PerSite<float> mean{}, range{};
  for (int site = 0; site < 4; ++site) {
    mean[site] = static_cast<float>(black.pedestal_dn[site]);
    range[site] = static_cast<float>(isp::white_at(raw, site)) - mean[site];
  }
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      float& v = signal.at(x, y);
      v = v * range[site_of(x, y)] + mean[site_of(x, y)];
    }
  }
  raw.dn = {};
  raw.dn_float = std::move(signal);
  raw.active = {0, 0, width, height};
  raw.masked.clear();
  raw.masked_is_stated = false;
  raw.black_tag =
      BlackLevel{.rows = 2, .columns = 2, .pattern_dn = {black.pedestal_dn.begin(), black.pedestal_dn.end()}};
}

void add_variance(const DarkFrame& dark, double range_dn, NoiseProfile& noise) {
  const auto& added = dark.added_variance_dn2;
  const double mean_dn2 = std::accumulate(added.begin(), added.end(), 0.0) / 4;
  for (double& offset : noise.offset) offset += mean_dn2 / (range_dn * range_dn);
}

}  // namespace

Result<bool> subtract_from_x_trans(DarkSource& darks, const isp::BlackRequest& black, RawFrame& mosaic) {
  const auto dark = darks.frame_for(mosaic, black);
  if (!dark) return tl::make_unexpected(dark.error());
  const auto level = isp::black_of(mosaic.raw, **dark);
  if (!level) return tl::make_unexpected(level.error());
  if (mosaic.noise) add_variance(**dark, isp::mean_range_dn(mosaic.raw, *level), *mosaic.noise);
  subtract(**dark, *level, mosaic.raw);
  std::ranges::copy((*dark)->unknown, std::back_inserter(mosaic.corrections.defects));
  std::ranges::copy((*dark)->warnings, std::back_inserter(mosaic.warnings));
  return true;
}

}  // namespace lowlux::cli
