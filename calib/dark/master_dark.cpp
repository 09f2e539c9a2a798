#include "calib/dark/master_dark.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

#include <fmt/format.h>

#include "calib/dark/dark_dose.h"

namespace lowlux::calib {
namespace {

constexpr double far_out = 5;                // standard deviations
constexpr double mad_to_deviation = 1.4826;  // of a normal distribution
constexpr std::int64_t max_pairs = std::int64_t{1} << 20;
constexpr double min_exposures_between = 4;
constexpr double far_below = 2, far_below_range = 1e-3;

/// Differences of neighbours of a site, from pairs that share no pixel.
struct Pairs {
  std::vector<float> dark, picture;
};

Pairs pairs_of(const DarkGroup& group, const RawDn& picture, int site) {
  const Plane<float>& dark = group.mean_dn;
  const std::int64_t all = static_cast<std::int64_t>(dark.width() / 4) * (dark.height() / 2);
  const int step = 2 * static_cast<int>(1 + 4 * all / max_pairs);  // rows of a site that are used
  Pairs out;
  for (int y = site >> 1; y < dark.height(); y += step) {
    const std::uint16_t* codes = picture.dn.row(picture.active.y + y) + picture.active.x;
    for (int x = site & 1; x + 2 < dark.width(); x += 4) {
      out.dark.push_back(dark.at(x + 2, y) - dark.at(x, y));
      out.picture.push_back(static_cast<float>(codes[x + 2] - codes[x]));
    }
  }
  return out;
}

/// Returns the limit beyond which differences are hot pixels or edges.
float limit_of(std::vector<float> values, double min_deviation) {
  for (float& v : values) v = std::fabs(v);
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return static_cast<float>(far_out * std::max(mad_to_deviation * *middle, min_deviation));
}

struct PairSums {
  double n = 0, dark2 = 0, picture2 = 0, product = 0;

  void add(const Pairs& pairs) {
    // Most differences of whole codes may be 0.
    const double min_deviation = std::sqrt(2 * rounding_dn2);
    const float dark_limit = limit_of(pairs.dark, min_deviation),
                picture_limit = limit_of(pairs.picture, min_deviation);
    for (std::size_t i = 0; i < pairs.dark.size(); ++i) {
      const double d = pairs.dark[i], p = pairs.picture[i];
      if (std::fabs(d) > dark_limit || std::fabs(p) > picture_limit) continue;
      ++n;
      dark2 += d * d;
      picture2 += p * p;
      product += d * p;
    }
  }
};

double rounded_count(double count) {
  const double step = count < 16 ? 1 : std::exp2(std::floor(std::log2(count)) - 3);
  return std::clamp(step * std::round(count / step), 1.0, static_cast<double>(max_exposures));
}

}  // namespace

PerSite<double> noise_of_one_exposure(const DarkNoiseModel& noise, const PerSite<DarkSite>& sites,
                                      const std::optional<PerSite<double>>& pedestal_dn) {
  PerSite<double> out = noise.read_variance_dn2;
  for (int site = 0; site < 4 && pedestal_dn; ++site) {
    out[site] += noise.gain_dn_per_e[site] * std::max(0.0, sites[site].spread.median - (*pedestal_dn)[site]);
  }
  return out;
}

double estimate_exposures(const DarkGroup& group, const RawDn& picture, const DarkNoiseModel& noise,
                          const std::optional<PerSite<double>>& pedestal_dn) {
  PairSums sums;
  for (int site = 0; site < 4; ++site) sums.add(pairs_of(group, picture, site));
  if (sums.n == 0) return 1;
  const double dark_dn2 = sums.dark2 / sums.n / 2, picture_dn2 = sums.picture2 / sums.n / 2;
  const FrameInfo& info = picture.info;
  const bool same = is_same_exposure({group.setting.exposure_s.value_or(0), group.setting.temperature_c},
                                     {info.exposure_s.value_or(0), info.temperature_c});
  const double pattern_dn2 = same ? std::max(0.0, sums.product / sums.n / 2) : 0;
  const double error_dn2 = std::sqrt(dark_dn2 * (2 * dark_dn2 + (same ? picture_dn2 : 0)) / sums.n);
  const double rest_dn2 = dark_dn2 - pattern_dn2 - (group.rounded ? rounding_dn2 : 0);
  const double one_dn2 = mean_of_sites(noise_of_one_exposure(noise, sites_of(group), pedestal_dn));
  return rounded_count(one_dn2 / std::max({rest_dn2, error_dn2, one_dn2 / max_exposures}));
}

double estimate_exposures_between(const DarkGroup& group, const RawDn& picture, const DarkNoiseModel& noise,
                                  const std::optional<PerSite<double>>& pedestal_dn) {
  const PerSite<DarkSite> sites = sites_of(group);
  PerSite<double> one_dn2 = noise_of_one_exposure(noise, sites, pedestal_dn);
  double between_dn2 = 0;
  for (int site = 0; site < 4; ++site) {
    one_dn2[site] = std::min(one_dn2[site], darkest_noise_dn2(picture, site));
    between_dn2 += sites[site].noise_dn2 / 4;
  }
  const double one = mean_of_sites(one_dn2);
  const auto degrees = static_cast<double>(group.mean_dn.size()) * (group.frames - 1);
  const double rounding = group.rounded ? rounding_dn2 : 0, error_dn2 = between_dn2 * std::sqrt(2 / degrees);
  const double rest_dn2 = std::max({between_dn2 - rounding, rounding, error_dn2, one / max_exposures});
  const double count = rounded_count(one / rest_dn2);
  return count < min_exposures_between ? 1 : count;
}

Result<DarkGroup> group_of_master(const Plane<float>& dn, bool rounded, const FrameInfo& stated, const RawDn& picture,
                                  const std::optional<PerSite<double>>& pedestal_dn) {
  const Rect& active = picture.active;
  const bool is_readout = dn.width() == picture.dn.width() && dn.height() == picture.dn.height();
  if (!is_readout && (dn.width() != active.width || dn.height() != active.height)) {
    return fail(ErrorCode::invalid_argument,
                fmt::format("the dark frame has {} x {} pixels, the image {} x {}; take darks with its camera",
                            dn.width(), dn.height(), active.width, active.height));
  }
  const auto setting = setting_of(picture);
  if (!setting) return tl::make_unexpected(setting.error());
  DarkGroup out{.setting = *setting, .frames = 1, .rounded = rounded};
  if (!stated.make.empty()) out.setting.make = stated.make;
  if (!stated.model.empty()) out.setting.model = stated.model;
  if (stated.iso) out.setting.iso = stated.iso;
  if (stated.exposure_s) out.setting.exposure_s = stated.exposure_s;
  out.mean_dn = Plane<float>(active.width, active.height);
  out.variance_dn2 = Plane<float>(active.width, active.height);
  std::fill_n(out.variance_dn2.data(), out.variance_dn2.size(), 0.0f);
  for (int y = 0; y < active.height; ++y) {
    const float* from = dn.row(is_readout ? active.y + y : y) + (is_readout ? active.x : 0);
    std::copy_n(from, active.width, out.mean_dn.row(y));
  }
  const PerSite<DarkSite> sites = sites_of(out);
  for (int site = 0; site < 4 && pedestal_dn; ++site) {
    const double range = *std::ranges::min_element(picture.white_dn) - (*pedestal_dn)[site];
    const double limit = std::max(far_below * std::sqrt(sites[site].noise_dn2), far_below_range * range);
    const double level = sites[site].spread.median;
    if (level >= (*pedestal_dn)[site] - limit) continue;
    return fail(ErrorCode::malformed,
                fmt::format("the level of the dark frame, {:.4g} DN, is below the black level of the image, {:.4g} DN; "
                            "its bias was subtracted, or it has other units; make it without subtracting the bias",
                            level, (*pedestal_dn)[site]));
  }
  return out;
}

}  // namespace lowlux::calib
