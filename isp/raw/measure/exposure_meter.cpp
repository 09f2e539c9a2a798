#include "isp/raw/measure/exposure_meter.h"

#include <algorithm>
#include <cstddef>
#include <numeric>

namespace lowlux::isp {
namespace {

constexpr int max_pairs = 128;
constexpr double darkest_fraction = 0.01;

double mean_of(std::uint64_t sum, std::uint64_t pixels) {
  return pixels == 0 ? 0 : static_cast<double>(sum) / static_cast<double>(pixels);
}

}  // namespace

bool is_metered_row(int y, int height) {
  const int pairs = std::max(height / 2, 1);
  return (y / 2) % ((pairs + max_pairs - 1) / max_pairs) == 0;
}

ExposureMeter::ExposureMeter(const RawFormat& format)
    : shift_(std::max(format.bits - bits, 0)),
      largest_(largest_code(format)),
      is_bayer_(format.layout == SensorLayout::bayer),
      sites_(4) {}

void ExposureMeter::clear() { std::ranges::fill(sites_, Site{}); }

void ExposureMeter::add_row(const std::uint16_t* dn, int width, int y) {
  for (int parity = 0; parity < 2; ++parity) {
    Site& site = sites_[is_bayer_ ? static_cast<std::size_t>(site_of(parity, y)) : 0];
    for (int x = parity; x < width; x += 2) {
      const int code = std::min<int>(dn[x], largest_);
      ++site.count[static_cast<std::size_t>(code >> shift_)];
      site.sum += static_cast<std::uint64_t>(code);
    }
    site.pixels += static_cast<std::uint64_t>((width - parity + 1) / 2);
  }
}

/// Returns the code that a fraction of a site's pixels exceed: the centre of a code is the code itself.
double ExposureMeter::exceeded_dn(const Site& site, double fraction) const {
  const double above = fraction * static_cast<double>(site.pixels);
  double seen = 0;
  for (std::size_t bin = site.count.size(); bin-- > 0;) {
    const double here = site.count[bin];
    if (here > 0 && seen + here > above) {
      const double from_top = (above - seen) / here;
      const double width_dn = 1 << shift_;
      return (static_cast<double>(bin) + 1 - from_top) * width_dn - 0.5;
    }
    seen += here;
  }
  return 0;
}

PerSite<double> ExposureMeter::darkest_dn() const {
  PerSite<double> out{};
  for (int i = 0; i < 4; ++i) {
    const Site& site = sites_[is_bayer_ ? static_cast<std::size_t>(i) : 0];
    out[i] = std::max(exceeded_dn(site, 1 - darkest_fraction), 0.0);
  }
  return out;
}

void ExposureMeter::find_saturation(const Site& site, double white_dn, double fraction) {
  std::size_t top = site.count.size() - 1;
  while (top > 0 && site.count[top] == 0) --top;
  const double pixels = site.count[top], top_dn = static_cast<double>(top << shift_);
  const bool is_pile = top > 0 && pixels >= std::max(2 * fraction * static_cast<double>(site.pixels), 32.0) &&
                       pixels >= 4.0 * site.count[top - 1];
  if (is_pile && top_dn > white_dn / 2) saturation_dn_ = std::min(saturation_dn_, top_dn);
}

MeteredCodes ExposureMeter::codes(const MeteredBlack& black, double white_dn, double fraction) {
  const int sites = is_bayer_ ? 4 : 1;
  for (int i = 0; i < sites; ++i) find_saturation(sites_[static_cast<std::size_t>(i)], white_dn, fraction);
  const double top_dn = std::clamp<double>(std::min(white_dn, saturation_dn_), 1, largest_);
  const std::size_t white = static_cast<std::size_t>(top_dn) >> shift_;
  MeteredCodes out;
  double max_dn = 0;
  for (int i = 0; i < sites; ++i) {
    const Site& site = sites_[static_cast<std::size_t>(i)];
    const double floor_dn = black.is_bound ? 0 : black.dn[i];
    const double mean_dn = mean_of(site.sum, site.pixels) - black.dn[i];
    const double highlight_dn = exceeded_dn(site, fraction) - floor_dn;
    if (i == 0 || mean_dn > max_dn) {
      max_dn = mean_dn;
      out.midtone_dn = exceeded_dn(site, 0.5) - black.dn[i];
    }
    out.highlight_dn = i == 0 ? highlight_dn : std::max(out.highlight_dn, highlight_dn);
    out.range_dn = i == 0 ? top_dn - floor_dn : std::min(out.range_dn, top_dn - floor_dn);
    const std::uint64_t clipped =
        std::accumulate(site.count.begin() + static_cast<std::ptrdiff_t>(white), site.count.end(), std::uint64_t{0});
    out.clipped_fraction = std::max(out.clipped_fraction, mean_of(clipped, site.pixels));
  }
  out.range_dn = std::max(out.range_dn, 1.0);
  return out;
}

}  // namespace lowlux::isp
