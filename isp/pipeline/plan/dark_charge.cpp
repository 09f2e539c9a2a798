#include "isp/pipeline/plan/dark_charge.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <vector>

#include <fmt/format.h>

#include "isp/base/cfa.h"
#include "isp/model/colour/camera_colour.h"
#include "isp/model/colour/dark_desaturation.h"
#include "isp/pipeline/render/cell_figures.h"
#include "isp/raw/measure/dark_estimate.h"
#include "isp/raw/to_linear.h"

namespace lowlux::isp {
namespace {

// Dark current that few sensors exceed uncooled: that of the GSENSE4040BSI at 25 C by its data sheet.
constexpr double high_current_e_per_s = 25, max_current_e_per_s = 1000, at_c = 25, doubling_c = 7;
constexpr double min_charge_e = 2, min_fraction = 0.1;

/// Returns the charge [e-] of a dark current that is stated at 25 C.
double charge_of(double current_e_per_s, const FrameInfo& info) {
  return current_e_per_s * std::exp2((info.temperature_c.value_or(at_c) - at_c) / doubling_c) * *info.exposure_s;
}

double at_fraction(std::vector<double>& values, double fraction) {
  const auto place = values.begin() + static_cast<std::ptrdiff_t>(fraction * static_cast<double>(values.size()));
  std::nth_element(values.begin(), place, values.end());
  return *place;
}

/// Returns DarkCharge::max_fraction; nullopt where it is too small to matter.
std::optional<double> max_dark_fraction(const RawFrame& frame, const RawLevels& levels, const Thumbnail& thumbnail) {
  const std::array<double, 3> electrons = electrons_by_colour(frame.raw, levels);
  std::vector<double> charge(thumbnail.mean.plane[0].size());
  for (std::size_t i = 0; i < charge.size(); ++i) {
    for (std::size_t c = 0; c < 3; ++c)
      charge[i] += fraction_of_sites[c] * electrons[c] * thumbnail.mean.plane[c].data()[i];
  }
  if (charge.empty()) return std::nullopt;
  const double median = at_fraction(charge, 0.5), darkest = at_fraction(charge, 0.01);
  if (!(median > 0)) return std::nullopt;
  const double fraction = std::clamp(darkest / median, 0.0, 1.0);
  return fraction >= min_fraction ? std::optional(fraction) : std::nullopt;
}

std::optional<DarkEstimate> estimate(const RawFrame& frame, const RawLevels& levels, const Thumbnail& thumbnail) {
  const Rect& active = frame.raw.active;
  DarkEvidence evidence{
      .mean = thumbnail.mean,
      .electrons_at_white = electrons_by_colour(frame.raw, levels),
      .pixels = static_cast<double>(active.width) * active.height / static_cast<double>(thumbnail.mean.plane[0].size()),
      .neutral = frame.colour.as_shot_neutral,
      .clipped = &thumbnail.clipped};
  for (std::size_t c = 0; c < 3; ++c) {
    const double electrons = evidence.electrons_at_white[c];
    evidence.variance_e2[c] = std::max(frame.noise->offset[c], 0.0) * electrons * electrons;
  }
  return estimate_dark_charge(evidence);
}

void use(const DarkEstimate& found, const RawDn& raw, DarkCharge& out) {
  out.state = DarkCharge::State::estimated;
  out.mean_e = found.mean_e;
  out.standard_error_e = found.standard_error_e;
  out.reason = fmt::format("the darkest blocks have {:.3g} e- more than light of this colour explains", found.mean_e);
  for (int site = 0; site < 4; ++site) {
    out.estimated_e[site] = found.charge_e[static_cast<std::size_t>(colour_at(raw.phase, site & 1, site >> 1))];
  }
  out.charge_e = out.estimated_e;
}

std::string refusal_of(const std::optional<DarkEstimate>& found, const FrameInfo& info) {
  if (!found) return "the frame has no coloured light from which dark charge can be separated";
  if (!found->is_significant()) {
    return fmt::format("the darkest blocks show {:.3g} e- with a standard error of {:.3g} e-: not significant",
                       found->mean_e, found->standard_error_e);
  }
  return fmt::format(
      "the darkest blocks show {:.3g} e-, more than the dark current of any known sensor makes in {:g} s",
      found->mean_e, *info.exposure_s);
}

/// Returns the dark charge in the black point [DN]: as stated in addition to a pedestal, else the difference from the
/// tagged pedestal; nullopt without a tag.
std::optional<PerSite<double>> dark_of_black_point(const RawFrame& frame, const RawLevels& levels) {
  if (levels.stated_dark_dn != PerSite<double>{}) return levels.stated_dark_dn;
  const Result<BlackPoint> tag = choose_black(frame.raw, {.choice = BlackChoice::metadata});
  if (!tag) return std::nullopt;
  PerSite<double> out = levels.black.pedestal_dn;
  for (int site = 0; site < 4; ++site) out[site] -= tag->pedestal_dn[site];
  return out;
}

/// Describes the dark charge of a black point that holds it, or states it apart from its pedestal.
DarkCharge in_black_point(const RawFrame& frame, const RawLevels& levels) {
  DarkCharge out{.state = DarkCharge::State::in_black_point};
  if (levels.black.dark_mean_e != PerSite<double>{}) {
    out.charge_e = levels.black.dark_mean_e;
    out.mean_e = mean_of_sites(out.charge_e);
    out.reason = "the black point states it separately from its pedestal";
    return out;
  }
  const std::optional<PerSite<double>> dark_dn = dark_of_black_point(frame, levels);
  if (!dark_dn || !levels.electrons_at_white) {
    out.reason = "not known without a tagged pedestal and a gain";
    return out;
  }
  double variance_e2 = 0;
  for (int site = 0; site < 4; ++site) {
    const double per_dn =
        (*levels.electrons_at_white)[site] / (white_at(frame.raw, site) - levels.black.pedestal_dn[site]);
    const double error = levels.black.pedestal_standard_error_dn[site] * per_dn;
    out.charge_e[site] = (*dark_dn)[site] * per_dn;
    variance_e2 += error * error / 16;
  }
  out.mean_e = mean_of_sites(out.charge_e);
  if (variance_e2 > 0) out.standard_error_e = std::sqrt(variance_e2);
  const bool is_stated = levels.stated_dark_dn != PerSite<double>{};
  out.reason =
      is_stated ? "added to the black level, as the profile states it" : "the black level minus the one of the tag";
  return out;
}

double median_of(const Plane<float>& plane) {
  std::vector<double> values(plane.data(), plane.data() + plane.size());
  return values.empty() ? 0 : at_fraction(values, 0.5);
}

}  // namespace

DarkCharge find_dark_charge(const RawFrame& frame, const RawLevels& levels, const Thumbnail& thumbnail,
                            const DevelopOptions& options) {
  const FrameInfo& info = frame.raw.info;
  if (frame.raw.layout != SensorLayout::bayer) return {.reason = "the sensor has no colour filters"};
  const bool is_known = levels.black.dark_mean_e != PerSite<double>{};
  if (is_known || levels.black.holds == BlackPoint::Holds::pedestal_and_dark) return in_black_point(frame, levels);
  // If a raw is denoised already, its maker knew more: `lowlux denoise` subtracts dark charge, or warns.
  if (!levels.electrons_at_white) return {.reason = "the gain is not known"};
  if (frame.noise->reduced) return {.reason = "noise was reduced before"};
  if (!info.exposure_s) return {.reason = "the exposure time is not known"};
  DarkCharge out{.state = DarkCharge::State::not_expected};
  // A short exposure is not exempt: the current of the series may be above high_current_e_per_s.
  if (options.series_dark_e) {
    out.state = DarkCharge::State::estimated;
    out.charge_e = out.estimated_e = *options.series_dark_e;
    out.mean_e = mean_of_sites(out.charge_e);
    out.reason = "estimated from another frame of the series";
    return out;
  }
  if (!(charge_of(high_current_e_per_s, info) >= min_charge_e)) {
    out.reason = "the exposure was short or the sensor was cold";
    return out;
  }
  if (options.estimate_dark) {
    const std::optional<DarkEstimate> found = estimate(frame, levels, thumbnail);
    if (found && found->is_significant() && found->mean_e <= charge_of(max_current_e_per_s, info)) {
      use(*found, frame.raw, out);
      return out;
    }
    out.reason = refusal_of(found, info);
  } else {
    out.reason = "the estimate is switched off";
  }
  out.max_fraction = max_dark_fraction(frame, levels, thumbnail);
  if (out.max_fraction) out.state = DarkCharge::State::unknown;
  return out;
}

double dark_charge_ratio(const FrameInfo& of, const FrameInfo& to) {
  double out = *of.exposure_s / *to.exposure_s;
  if (of.temperature_c && to.temperature_c) out *= std::exp2((*of.temperature_c - *to.temperature_c) / doubling_c);
  return out;
}

std::string warning_of(const DarkCharge& dark, const FrameInfo& info) {
  if (dark.state != DarkCharge::State::unknown) return {};
  const std::string place = info.temperature_c ? fmt::format(" and {:g} C", *info.temperature_c) : std::string();
  return fmt::format(
      "the dark charge is unknown: at {:g} s{} it may reduce the saturation by up to {:.0f} %; use --dark-frame, or "
      "--profile with a dark current",
      *info.exposure_s, place, 100 * *dark.max_fraction);
}

double light_range_of(const RawFrame& frame, const RawLevels& levels) {
  const RawDn& raw = frame.raw;
  std::optional<PerSite<double>> dark_dn;
  if (levels.black.holds == BlackPoint::Holds::pedestal_and_dark &&
      (raw.black_tag || levels.stated_dark_dn != PerSite<double>{})) {
    dark_dn = dark_of_black_point(frame, levels);
  }
  double sum = 0;
  for (int site = 0; site < 4; ++site) {
    const double range_dn = white_at(raw, site) - levels.black.pedestal_dn[site];
    double share = dark_dn ? range_dn / (range_dn + std::max((*dark_dn)[site], 0.0)) : 1;
    if (levels.electrons_at_white) share *= light_at_white_e(levels)[site] / (*levels.electrons_at_white)[site];
    sum += share / 4;
  }
  return sum > 0 && std::isfinite(sum) ? sum : 1;
}

Thumbnail light_of(const Thumbnail& thumbnail, const RawFrame& frame, const RawLevels& levels) {
  const RawDn& raw = frame.raw;
  Thumbnail out{.mean = CameraRgb(thumbnail.mean.width(), thumbnail.mean.height()),
                .clipped = thumbnail.clipped.clone(),
                .black_noise_std = thumbnail.black_noise_std,
                .light_range = light_range_of(frame, levels)};
  std::array<double, 3> electrons{1, 1, 1}, light_e{1, 1, 1};
  if (levels.electrons_at_white) {
    electrons = electrons_by_colour(raw, levels);
    light_e = light_at_white_by_colour(raw, levels);
  }
  double gain = 0;  // gain of the noise, as the mean over pixels
  for (std::size_t c = 0; c < 3; ++c) {
    const auto per_light = static_cast<float>(electrons[c] / light_e[c]);
    const auto dark = static_cast<float>(1 - light_e[c] / electrons[c]);
    gain += fraction_of_sites[c] * static_cast<double>(per_light);
    const Plane<float>& from = thumbnail.mean.plane[c];
    std::transform(from.data(), from.data() + from.size(), out.mean.plane[c].data(),
                   [&](float mean) { return per_light * (mean - dark); });
  }
  out.black_noise_std *= gain;
  return out;
}

std::optional<double> signal_fraction_at_median(const RawFrame& frame, const RawLevels& levels,
                                                const Rendering& rendering, const Thumbnail& light,
                                                const PerSite<double>& charge_e) {
  if (!levels.electrons_at_white) return std::nullopt;
  const std::array<double, 3> light_e = light_at_white_by_colour(frame.raw, levels);
  Vector3 signal{}, dark{};
  for (std::size_t c = 0; c < 3; ++c) {
    signal[c] = median_of(light.mean.plane[c]);
  }
  for (int site = 0; site < 4; ++site) {
    const auto c = static_cast<std::size_t>(colour_at(frame.raw.phase, site & 1, site >> 1));
    dark[c] += std::max(charge_e[site], 0.0) / light_e[c] * (c == 1 ? 0.5 : 1);
  }
  if (rendering.white) {
    const Result<Matrix3> to_xyz = camera_to_xyz(frame.colour, rendering.white->xy, rendering.white->xy);
    if (!to_xyz) return std::nullopt;
    signal = *to_xyz * signal;
    dark = *to_xyz * dark;
  }
  return signal_fraction({signal[0], signal[1], signal[2]}, {dark[0], dark[1], dark[2]});
}

}  // namespace lowlux::isp
