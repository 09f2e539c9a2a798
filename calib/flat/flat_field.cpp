#include "calib/flat/flat_field.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <utility>
#include <vector>

#include <fmt/format.h>

namespace lowlux::calib {
namespace {

constexpr int radius = 4;                                       // of local means, in pixels of a site
constexpr double window = (2 * radius + 1) * (2 * radius + 1);  // pixels
constexpr double max_clipped = 1e-3;                            // fraction of the pixels
constexpr double near_white = 0.95, min_centre = 0.05;          // of the range
constexpr double min_local = 0.02;                              // of the centre
constexpr double max_deviation = 0.1;                           // relative
constexpr double far_out = 5;                                   // standard deviations
constexpr double min_response = 0.25, max_response = 4;         // of a pixel that is not a defect
constexpr double mad_to_deviation = 1.4826;                     // of a normal distribution

/// One site of the flats: signal, local means, and the statistics of the relative deviations of pixels from these.
struct SiteFlat {
  Plane<float> signal;
  Plane<float> local;
  double centre_dn = 0;
  double deviation = 0;  // standard deviation without outliers
  double noise2 = 0;     // relative variance of the noise of a pixel
  double pattern2 = 0;   // relative variance of the response of a pixel
  double weight = 0;     // w
  GainNoise noise;       // noise of the gains
};

Plane<float> signal_of(const DarkGroup& flats, int site, double black_dn) {
  const Plane<float>& mean = flats.mean_dn;
  Plane<float> out((mean.width() + 1 - (site & 1)) / 2, (mean.height() + 1 - (site >> 1)) / 2);
  for (int y = 0; y < out.height(); ++y) {
    const float* in = mean.row(2 * y + (site >> 1)) + (site & 1);
    for (int x = 0; x < out.width(); ++x) out.at(x, y) = in[std::ptrdiff_t{2} * x] - static_cast<float>(black_dn);
  }
  return out;
}

/// Returns the means of squares about each pixel. They are symmetric at the borders too, so that a gradient does not
/// change them.
Plane<float> local_means(const Plane<float>& in) {
  const int width = in.width(), height = in.height();
  std::vector<double> sums(static_cast<std::size_t>(width + 1) * (height + 1));
  const auto sum_at = [&](int x, int y) -> double& { return sums[static_cast<std::size_t>(y) * (width + 1) + x]; };
  for (int y = 0; y < height; ++y) {
    double row = 0;
    for (int x = 0; x < width; ++x) {
      row += in.at(x, y);
      sum_at(x + 1, y + 1) = sum_at(x + 1, y) + row;
    }
  }
  Plane<float> out(width, height);
  for (int y = 0; y < height; ++y) {
    const int dy = std::min({radius, y, height - 1 - y});
    for (int x = 0; x < width; ++x) {
      const int dx = std::min({radius, x, width - 1 - x});
      const double sum = sum_at(x + dx + 1, y + dy + 1) - sum_at(x - dx, y + dy + 1) - sum_at(x + dx + 1, y - dy) +
                         sum_at(x - dx, y - dy);
      out.at(x, y) = static_cast<float>(sum / ((2 * dx + 1) * (2 * dy + 1)));
    }
  }
  return out;
}

/// Returns local means that single pixels, hot or dead, do not change.
Plane<float> local_means_without_defects(const Plane<float>& signal) {
  const Plane<float> first = local_means(signal);
  Plane<float> clean = signal.clone();
  for (std::size_t i = 0; i < clean.size(); ++i) {
    const float mean = first.data()[i];
    if (std::fabs(clean.data()[i] - mean) > max_deviation * mean) clean.data()[i] = mean;
  }
  return local_means(clean);
}

double centre_of(const Plane<float>& local) {
  double sum = 0, n = 0;
  for (int y = 3 * local.height() / 8; y <= 5 * local.height() / 8; ++y) {
    for (int x = 3 * local.width() / 8; x <= 5 * local.width() / 8; ++x) sum += local.at(x, y), ++n;
  }
  return sum / n;
}

/// Returns the standard deviation of the relative deviations within five normalised median absolute deviations.
double deviation_of(const SiteFlat& site) {
  std::vector<float> off(site.signal.size());
  for (std::size_t i = 0; i < off.size(); ++i) off[i] = std::fabs(site.signal.data()[i] / site.local.data()[i] - 1);
  std::vector<float> sorted = off;
  const auto middle = sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 2);
  std::nth_element(sorted.begin(), middle, sorted.end());
  const double cut = far_out * mad_to_deviation * *middle;
  double squares = 0, n = 0;
  for (const float d : off) {
    if (d <= cut) squares += d * d, ++n;
  }
  return std::sqrt(squares / n);
}

/// Returns the relative variance of the noise of a pixel of the mean of the flats, or nullopt if it is not known. Where
/// it is measured and modelled, the lesser is taken: flickering light adds to the measured variance.
std::optional<double> relative_noise(const DarkGroup& flats, const FlatLevels& levels, int site, const SiteFlat& flat) {
  if (flats.frames < 2 && !levels.noise) return std::nullopt;
  double measured = 0, modelled = 0;
  for (int y = 0; y < flat.local.height(); ++y) {
    for (int x = 0; x < flat.local.width(); ++x) {
      const double local = flat.local.at(x, y);
      measured += flats.variance_dn2.at(2 * x + (site & 1), 2 * y + (site >> 1)) / (local * local);
      if (!levels.noise) continue;
      modelled += (levels.noise->read_variance_dn2[site] + levels.noise->gain_dn_per_e[site] * local) / (local * local);
    }
  }
  const double sum = !levels.noise ? measured : flats.frames < 2 ? modelled : std::min(measured, modelled);
  return sum / static_cast<double>(flat.local.size()) / flats.frames;
}

/// Returns the fraction of the noise of a pixel that its gain contains.
double kept_noise(double weight) { return weight * weight * (1 - 1 / window) + 1 / window; }

/// Returns the noise of the gains as a function of the gain S_centre / L. Without a noise model all noise is taken for
/// shot noise.
GainNoise gain_noise(const FlatLevels& levels, int site, const SiteFlat& flat) {
  const double k = levels.noise ? levels.noise->gain_dn_per_e[site] : 1;
  const double read = levels.noise ? levels.noise->read_variance_dn2[site] : 0;
  double sum = 0;
  for (std::size_t i = 0; i < flat.local.size(); ++i) {
    const double local = flat.local.data()[i];
    sum += (read + k * local) / (local * local);
  }
  const double scale = kept_noise(flat.weight) * flat.noise2 * static_cast<double>(flat.local.size()) / sum;
  return {.shot = scale * k / flat.centre_dn, .read = scale * read / (flat.centre_dn * flat.centre_dn)};
}

tl::unexpected<Error> unfit(std::string message) { return fail(ErrorCode::malformed, std::move(message)); }

Result<SiteFlat> measure_site(const DarkGroup& flats, const FlatLevels& levels, int site) {
  SiteFlat out{.signal = signal_of(flats, site, levels.black_dn[site])};
  out.local = local_means_without_defects(out.signal);
  out.centre_dn = centre_of(out.local);
  const double range = *std::ranges::min_element(flats.setting.white_dn) - levels.black_dn[site];
  if (!(out.centre_dn >= min_centre * range)) {
    return unfit(fmt::format(
        "the flat is too dark: its centre is at {:.3g} % of the range, at least {:g} % are required; expose it longer",
        100 * out.centre_dn / range, 100 * min_centre));
  }
  const double least = *std::min_element(out.local.data(), out.local.data() + out.local.size());
  if (!(least >= min_local * out.centre_dn)) {
    return unfit(fmt::format("the flat falls to {:.3g} % of its centre, at least {:g} % are required; light it evenly",
                             100 * least / out.centre_dn, 100 * min_local));
  }
  out.deviation = deviation_of(out);
  if (out.deviation > max_deviation) {
    return unfit(
        fmt::format("neighbouring pixels of the flat differ by {:.3g} %, at most {:g} % are allowed; take it of an "
                    "even surface, out of focus",
                    100 * out.deviation, 100 * max_deviation));
  }
  // A deviation from the mean of `window` pixels has a fraction 1 - 1 / window of the noise and of the pattern.
  const double spread2 = out.deviation * out.deviation / (1 - 1 / window);
  out.noise2 = relative_noise(flats, levels, site, out).value_or(spread2);
  out.pattern2 = std::max(0.0, spread2 - out.noise2);
  out.weight = out.pattern2 > 0 ? out.pattern2 / (out.pattern2 + out.noise2) : 0;
  out.noise = gain_noise(levels, site, out);
  return out;
}

Result<void> check_not_clipped(const DarkGroup& flats, const FlatLevels& levels) {
  const double white = *std::ranges::min_element(flats.setting.white_dn);
  std::size_t clipped = 0;
  for (int y = 0; y < flats.mean_dn.height(); ++y) {
    for (int x = 0; x < flats.mean_dn.width(); ++x) {
      const double black = levels.black_dn[site_of(x, y)];
      clipped += flats.mean_dn.at(x, y) > black + near_white * (white - black);
    }
  }
  const double fraction = static_cast<double>(clipped) / static_cast<double>(flats.mean_dn.size());
  if (fraction <= max_clipped) return {};
  return unfit(
      fmt::format("{:.3g} % of the pixels of the flat are clipped or nearly clipped, at most {:g} % are allowed; "
                  "expose it for about half of the range",
                  100 * fraction, 100 * max_clipped));
}

void fill_gains(const SiteFlat& flat, int site, int width, std::vector<float>& gain) {
  const double cut = far_out * flat.deviation;
  for (int y = 0; y < flat.local.height(); ++y) {
    float* const row = gain.data() + static_cast<std::size_t>(2 * y + (site >> 1)) * width + (site & 1);
    for (int x = 0; x < flat.local.width(); ++x) {
      const double local = flat.local.at(x, y), response = flat.signal.at(x, y) / local;
      const bool defect = response < min_response || response > max_response;
      const double kept = defect ? 0 : std::fabs(response - 1) > cut ? 1 : flat.weight;
      row[std::ptrdiff_t{2} * x] = static_cast<float>(flat.centre_dn / (local * (1 + kept * (response - 1))));
    }
  }
}

/// Returns the map of one gain for each pixel.
GainMap pixel_map(int width, int height) {
  GainMap out{.bottom = height, .right = width, .points_v = height, .points_h = width};
  out.spacing_v = 1.0 / height;
  out.spacing_h = 1.0 / width;
  out.origin_v = 0.5 / height;
  out.origin_h = 0.5 / width;
  out.gain.resize(static_cast<std::size_t>(width) * height);
  return out;
}

}  // namespace

Result<FlatField> make_flat_field(const DarkGroup& flats, const FlatLevels& levels) {
  if (auto good = check_not_clipped(flats, levels); !good) return tl::make_unexpected(good.error());
  const int width = flats.mean_dn.width(), height = flats.mean_dn.height();
  FlatField out{.gain = pixel_map(width, height), .setting = flats.setting, .frames = flats.frames};
  double pattern2 = 0, added2 = 0;
  for (int site = 0; site < 4; ++site) {
    const auto flat = measure_site(flats, levels, site);
    if (!flat) return tl::make_unexpected(flat.error());
    fill_gains(*flat, site, width, out.gain.gain);
    const double least = *std::min_element(flat->local.data(), flat->local.data() + flat->local.size());
    out.max_gain = std::max(out.max_gain, flat->centre_dn / least);
    out.pixel_fraction = std::min(out.pixel_fraction, flat->weight);
    pattern2 += flat->pattern2 / 4;
    added2 += kept_noise(flat->weight) * flat->noise2 / 4;
    out.gain.noise[static_cast<std::size_t>(site)] = flat->noise;
  }
  out.prnu = std::sqrt(pattern2);
  out.noise = std::sqrt(added2);
  return out;
}

}  // namespace lowlux::calib
