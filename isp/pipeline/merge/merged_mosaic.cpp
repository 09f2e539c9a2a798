#include "isp/pipeline/merge/merged_mosaic.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <memory>
#include <span>
#include <utility>
#include <vector>

#include "isp/pipeline/finished/raw_codes.h"
#include "isp/pipeline/finished/residual_profile.h"

namespace lowlux::isp {
namespace {

constexpr double min_ratio = 1.0 / 64, max_ratio = 982;  // that a DNG can state (noise_ratio_bytes.h)
constexpr float hardly_different = 0.1F;
constexpr double max_rounding = 0.1;     // of the variance
constexpr std::size_t smooth_sites = 8;  // of the same parity, on each side

std::size_t colour_of(BayerPhase phase, int site) {
  return static_cast<std::size_t>(colour_at(phase, site & 1, site >> 1));
}

/// Returns the smallest variance of a site without light, in fractions of white squared.
double min_dark_variance(const FrameElectrons& reference, const PerSite<double>& site_white_e,
                         const MergedRaw& merged) {
  double max_light = 1;
  for (const FrameUse& use : merged.frames) max_light = std::max(max_light, use.light);
  double least = std::numeric_limits<double>::infinity();
  for (int site = 0; site < 4; ++site) {
    const double one = reference.variance_e2[site] / std::pow(max_light * site_white_e[site], 2);
    least = std::min(least, one / static_cast<double>(merged.frames.size()));
  }
  return least;
}

}  // namespace

double dark_noise(const FrameElectrons& reference, const PerSite<double>& site_white_e) {
  double noise = 0;
  for (int site = 0; site < 4; ++site) {
    const double variance = reference.variance_e2[site] + reference.common_variance_e2[site];
    noise = std::max(noise, std::sqrt(variance) / site_white_e[site]);
  }
  return noise;
}

SampleLevels fine_levels(const SampleLevels& codes, const FrameElectrons& reference,
                         const PerSite<double>& site_white_e, const MergedRaw& merged) {
  const bool fine = codes.rounding_variance() < max_rounding * min_dark_variance(reference, site_white_e, merged);
  return fine ? codes : float_levels();
}

namespace {

/// Returns the variance of the mean at a site, 1 / weight, or that of sites without values, which were filled.
double variance_at(const Plane<float>& weight, int x, int y, double of_filled) {
  return weight.at(x, y) > 0 ? 1 / static_cast<double>(weight.at(x, y)) : of_filled;
}

/// Returns the variance of a site of a mean of frames of equal exposure over that of one frame: at most 1, also where
/// only the edge of a drop lies.
double variance_of_mean_at(const Plane<float>& weight, int x, int y) {
  return std::min(variance_at(weight, x, y, 1), 1.0);
}

/// The variance of the sites of a mean over that of one frame.
struct MeanVariance {
  std::array<double, 3> of_colour{};  // mean over the sites of R, G and B
  double of_all = 1;
};

/// Returns the mean variance of sites; those that were filled count as one frame. Frames that moved leave more samples
/// at green sites, which are nearer to each other. A colour without sites has the mean of all.
MeanVariance mean_variance(const Plane<float>& weight, BayerPhase phase, Executor& executor) {
  std::vector<PerSite<double>> of_row(static_cast<std::size_t>(weight.height()));
  for_each_index(executor, weight.height(), [&](int y) {
    PerSite<double> sum{};
    for (int x = 0; x < weight.width(); ++x) sum[site_of(x, y)] += variance_of_mean_at(weight, x, y);
    of_row[static_cast<std::size_t>(y)] = sum;
  });
  std::array<double, 3> sum{}, sites{};
  for (int site = 0; site < 4; ++site) {
    const std::size_t colour = colour_of(phase, site);
    for (const PerSite<double>& row : of_row) sum[colour] += row[site];
    sites[colour] +=
        static_cast<double>((weight.width() + 1 - (site & 1)) / 2) * ((weight.height() + 1 - (site >> 1)) / 2);
  }
  MeanVariance out;
  out.of_all = (sum[0] + sum[1] + sum[2]) / static_cast<double>(weight.size());
  for (std::size_t c = 0; c < 3; ++c) out.of_colour[c] = sites[c] > 0 ? sum[c] / sites[c] : out.of_all;
  return out;
}

/// Returns the NoiseProfile of a mean of frames. The dark frame is the same for all; frames that moved have other sites
/// of it.
NoiseProfile profile_of_mean(const FrameElectrons& reference, const std::array<double, 3>& variance,
                             MergeAlignment alignment) {
  NoiseProfile out;
  const bool still = alignment == MergeAlignment::none;
  for (int site = 0; site < 4; ++site) {
    const std::size_t colour = colour_of(reference.phase, site);
    const double share = colour == 1 ? 0.5 : 1, unit = 1 / reference.light_at_white_e[site];
    const double common = reference.common_variance_e2[site] * (still ? 1 : variance[colour]);
    out.scale[colour] += share * unit * variance[colour];
    out.offset[colour] += share * (reference.variance_e2[site] * variance[colour] + common) * unit * unit;
  }
  return out;
}

/// Returns the variance of a site of R, G and B in each 2x2 cell of a bracket [e-^2]; 0 for a colour without a value at
/// one of its sites.
std::array<Plane<float>, 3> site_variance(const Plane<float>& weight, BayerPhase phase, Executor& executor) {
  const int columns = weight.width() / 2, rows = weight.height() / 2;
  std::array<Plane<float>, 3> out{Plane<float>(columns, rows), {columns, rows}, {columns, rows}};
  for_each_index(executor, rows, [&](int y) {
    for (int x = 0; x < columns; ++x) {
      std::array<double, 3> sum{};
      for (int site = 0; site < 4; ++site) {
        const std::size_t colour = colour_of(phase, site);
        sum[colour] += (colour == 1 ? 0.5 : 1) * variance_at(weight, 2 * x + (site & 1), 2 * y + (site >> 1), INFINITY);
      }
      for (std::size_t c = 0; c < 3; ++c) out[c].at(x, y) = std::isfinite(sum[c]) ? static_cast<float>(sum[c]) : 0;
    }
  });
  return out;
}

/// Sets sites of a bracket that are saturated in every frame to white.
void mark_saturated(Plane<float>& mean, const Plane<float>& weight, PlaneView<const float> saturated,
                    const PerSite<double>& site_white_e, Executor& executor) {
  for_each_index(executor, mean.height(), [&](int y) {
    for (int x = 0; x < mean.width(); ++x) {
      if (weight.at(x, y) > 0 || saturated.at(x, y) != 1) continue;
      mean.at(x, y) = static_cast<float>(site_white_e[site_of(x, y)]);
    }
  });
}

/// Returns how the variance differs from what the NoiseProfile states, by blocks.
/// @param stated_variance  stated variance of a site (x, y), in the unit of 1 / weight
template <class Found, class Stated>
NoiseRatio noise_ratio(const Plane<float>& weight, const Found& found_variance, const Stated& stated_variance,
                       Executor& executor) {
  NoiseRatio out{.block_px = merge::block_px};
  out.ratio = Plane<float>((weight.width() + out.block_px - 1) / out.block_px,
                           (weight.height() + out.block_px - 1) / out.block_px);
  for_each_index(executor, out.ratio.height(), [&](int row) {
    for (int column = 0; column < out.ratio.width(); ++column) {
      double found = 0, stated = 0;
      for (int y = out.block_px * row; y < std::min(out.block_px * (row + 1), weight.height()); ++y) {
        for (int x = out.block_px * column; x < std::min(out.block_px * (column + 1), weight.width()); ++x) {
          if (!(weight.at(x, y) > 0)) continue;
          found += found_variance(x, y);
          stated += stated_variance(x, y);
        }
      }
      out.ratio.at(column, row) = found > 0 && stated > 0 ? static_cast<float>(found / stated) : 1;
    }
  });
  return out;
}

/// Sets the noise ratio of the frame, unless it is hardly different from 1. If it exceeds what a DNG can state, as
/// where only the shortest exposure of a bracket of many EV is not saturated, the NoiseProfile is raised by the excess.
void state_noise_ratio(NoiseRatio ratio, RawFrame& frame) {
  const std::span<float> values(ratio.ratio.data(), ratio.ratio.size());
  const auto [least, most] = std::ranges::minmax(values);
  if (least > 1 - hardly_different && most < 1 + hardly_different) return;
  const double excess = std::max(static_cast<double>(most) / max_ratio, 1.0);
  for (double& scale : frame.noise->scale) scale *= excess;
  for (double& offset : frame.noise->offset) offset *= excess;
  for (float& value : values) {
    value = static_cast<float>(std::clamp(static_cast<double>(value) / excess, min_ratio, max_ratio));
  }
  frame.noise_ratio = std::make_shared<const NoiseRatio>(std::move(ratio));
}

/// Replaces each value of a line by the mean of those around it that have its parity.
void smooth_line(float* line, std::size_t count, std::size_t stride) {
  std::vector<double> sum(count + 2);  // of the values before, of the same parity
  for (std::size_t i = 0; i < count; ++i) sum[i + 2] = sum[i] + static_cast<double>(line[i * stride]);
  for (std::size_t i = 0; i < count; ++i) {
    const std::size_t before = std::min(smooth_sites, i / 2), after = std::min(smooth_sites, (count - 1 - i) / 2);
    const double total = sum[i + 2 * after + 2] - sum[i - 2 * before];
    line[i * stride] = static_cast<float>(total / static_cast<double>(before + after + 1));
  }
}

}  // namespace

void smooth_gain_maps(RawCorrections& corrections, int height_px, Executor& executor) {
  for (GainMap& map : corrections.gain_maps) {
    if (map.points_v < height_px || map.map_planes != 1) continue;
    const auto columns = static_cast<std::size_t>(map.points_h), rows = static_cast<std::size_t>(map.points_v);
    for_each_index(executor, map.points_v,
                   [&](int y) { smooth_line(map.gain.data() + columns * static_cast<std::size_t>(y), columns, 1); });
    for_each_index(executor, map.points_h, [&](int x) { smooth_line(map.gain.data() + x, rows, columns); });
  }
}

void encode_merged(merge::MosaicMean& mean, const FrameElectrons& reference, PlaneView<const float> saturated,
                   RawFrame& frame, MergedRaw& out, Executor& executor) {
  double least_light = 1;
  for (const FrameUse& use : out.frames) least_light = std::min(least_light, use.light);
  PerSite<double> site_white_e = reference.light_at_white_e;
  std::array<double, 3> saturation_e = reference.saturation_e;
  if (out.bracket) {
    out.baseline_exposure_ev = -std::log2(least_light);
    for (double& white : site_white_e) white /= least_light;
    for (double& saturation : saturation_e) saturation /= least_light;
  }
  SignalElectrons merged{mean.take_mean(executor), reference.phase};
  const Plane<float>& weight = mean.weight();
  const SampleLevels levels =
      fine_levels(code_levels(dark_noise(reference, site_white_e)), reference, site_white_e, out);
  if (out.bracket) {
    mark_saturated(merged.value, weight, saturated, site_white_e, executor);
    out.frame.noise = residual_profile(merged, site_variance(weight, reference.phase, executor), site_white_e,
                                       levels.rounding_variance(), ProfileFit::least);
    out.frame.noise->reduced = false;
    NoiseRatio ratio = noise_ratio(
        weight, [&](int x, int y) { return variance_at(weight, x, y, 0); },
        [&](int x, int y) {
          const auto colour = static_cast<std::size_t>(colour_at(reference.phase, x, y));
          const double white = site_white_e[site_of(x, y)];
          const double signal = std::max(static_cast<double>(merged.value.at(x, y)) / white, 0.0);
          return (out.frame.noise->scale[colour] * signal + out.frame.noise->offset[colour]) * white * white;
        },
        executor);
    state_noise_ratio(std::move(ratio), out.frame);
  } else {
    const MeanVariance variance = mean_variance(weight, reference.phase, executor);
    out.mean_count = 1 / variance.of_all;
    std::array<double, 3> stated = variance.of_colour;
    for (std::size_t c = 0; c < 3; ++c) stated[c] *= out.drop_noise[c];
    out.frame.noise = profile_of_mean(reference, stated, out.alignment);
    for (double& offset : out.frame.noise->offset) offset += levels.rounding_variance();
    NoiseRatio ratio = noise_ratio(
        weight, [&](int x, int y) { return variance_of_mean_at(weight, x, y); },
        [&](int x, int y) { return variance.of_colour[static_cast<std::size_t>(colour_at(reference.phase, x, y))]; },
        executor);
    state_noise_ratio(std::move(ratio), out.frame);
  }
  out.frame.noise->source = frame.noise->source;
  const PlaneView<const float> signal_e = std::as_const(merged.value).view();
  out.frame.raw = encode_signal({.signal_e = signal_e,
                                 .charge_e = signal_e,
                                 .saturation_e = saturation_e,
                                 .signal_at_white_e = site_white_e,
                                 .charge_at_white_e = site_white_e},
                                frame.raw, levels, executor);
  // Luminances are computed with the time in which the reference would have collected the least light of the frames:
  // white is the saturation of that exposure.
  if (out.bracket && out.frame.raw.info.exposure_s) *out.frame.raw.info.exposure_s *= least_light;
  out.frame.colour = std::move(frame.colour);
  out.frame.corrections = std::move(frame.corrections);
  out.frame.corrections.defects.clear();
  out.frame.source_tags = std::move(frame.source_tags);
  if (out.alignment != MergeAlignment::none)
    smooth_gain_maps(out.frame.corrections, out.frame.raw.active.height, executor);
}

}  // namespace lowlux::isp
