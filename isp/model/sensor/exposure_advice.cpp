#include "isp/model/sensor/exposure_advice.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <numeric>
#include <utility>

#include "isp/base/text.h"
#include "isp/model/colour/chroma_bound.h"
#include "isp/model/sensor/noise_budget.h"
#include "isp/model/sensor/saturation_limits.h"

namespace lowlux::isp {
namespace {

/// Returns the dark electrons of R, G and B per second.
Vector3 dark_rate(const AdviceRequest& r, const SensorModel& sensor) {
  return dark_mean_e(sensor, {1, r.temperature_c});
}

/// Returns the electrons per second of the fullest channel of a neutral, dark current included.
double fullest_rate(const AdviceRequest& r, const GainSetting& gain, double luminance_cd_m2) {
  const Vector3 dark = dark_rate(r, gain.sensor);
  double most = 0;
  for (int k = 0; k < 3; ++k) most = std::max(most, gain.white_e_per_s[k] * luminance_cd_m2 + dark[k]);
  return most;
}

SaturationLimits limits_of(const AdviceRequest& r, const SensorModel& sensor) {
  return saturation_limits(sensor, normal_quantile_above(r.clipped_fraction));
}

struct Longest {
  double exposure_s;
  ExposureLimit limit;
};

Longest longest_exposure(const AdviceRequest& r, const GainSetting& gain) {
  const SaturationLimits limits = limits_of(r, gain.sensor);
  const double rate = fullest_rate(r, gain, r.highlight_cd_m2);
  Longest out{r.longest_exposure_s, ExposureLimit::motion};
  if (limits.full_well_e < rate * out.exposure_s) out = {limits.full_well_e / rate, ExposureLimit::full_well};
  if (limits.converter_e < rate * out.exposure_s) out = {limits.converter_e / rate, ExposureLimit::converter_range};
  return out;
}

int brightest_channel(const GainSetting& gain) {
  return static_cast<int>(std::ranges::max_element(gain.white_e_per_s) - gain.white_e_per_s.begin());
}

MeanCharge midtone_charge(const AdviceRequest& r, const GainSetting& gain, double exposure_s) {
  const int k = brightest_channel(gain);
  return {gain.white_e_per_s[k] * r.midtone_cd_m2 * exposure_s, dark_rate(r, gain.sensor)[k] * exposure_s};
}

std::optional<MidtoneQuality> midtone_quality(const AdviceRequest& r, const GainSetting& gain, double exposure_s) {
  const SensorModel& sensor = gain.sensor;
  FlatPatch patch;
  for (int k = 0; k < 3; ++k) {
    patch.signal_e[k] = gain.white_e_per_s[k] * r.midtone_cd_m2 * exposure_s;
    patch.dark_e[k] = dark_rate(r, sensor)[k] * exposure_s;
  }
  const double quantisation_e = 1 / (std::sqrt(12.0) * sensor.system_gain_dn_per_e);
  patch.noise_std_e = std::hypot(sensor.read_noise_e, quantisation_e);
  const double cells = r.patch_pixels * r.frames;
  patch.pixels = {cells, 2 * cells, cells};
  const auto chroma = chroma_crb(r.camera_to_xyz, patch);
  if (!chroma) return std::nullopt;
  return MidtoneQuality{r.frames * snr(sensor, midtone_charge(r, gain, exposure_s)), rss_std(chroma->uv_covariance),
                        chroma->weight_snr};
}

/// Returns the largest component of the mid tone's variance and its fraction.
std::pair<NoiseSource, double> largest_noise(const AdviceRequest& r, const GainSetting& gain, double exposure_s) {
  const MeanCharge charge = midtone_charge(r, gain, exposure_s);
  const double gain2 = gain.sensor.system_gain_dn_per_e * gain.sensor.system_gain_dn_per_e;
  const std::array variance_e2{charge.signal_e, charge.dark_e, gain.sensor.read_noise_e * gain.sensor.read_noise_e,
                               1 / (12 * gain2)};
  const auto* const most = std::ranges::max_element(variance_e2);
  const double sum = std::accumulate(variance_e2.begin(), variance_e2.end(), 0.0);
  return {static_cast<NoiseSource>(most - variance_e2.begin()), *most / sum};
}

GainAdvice best_of(const AdviceRequest& r, std::size_t gain) {
  const auto [exposure_s, limit] = longest_exposure(r, r.gains[gain]);
  const auto [noise, share] = largest_noise(r, r.gains[gain], exposure_s);
  GainAdvice out{predicted_point(r, gain, exposure_s), limit, noise, share};
  out.at.exceeds.reset();  // equals the limit, up to rounding
  return out;
}

/// Returns for each gain the larger loss: against the best SNR or against the best chromaticity [dB].
std::vector<double> losses_db(const std::vector<GainAdvice>& gains) {
  double best_snr = 0, min_std = INFINITY;
  for (const GainAdvice& g : gains) {
    best_snr = std::max(best_snr, g.at.midtone->snr);
    min_std = std::min(min_std, g.at.midtone->uv_std);
  }
  std::vector<double> losses;
  losses.reserve(gains.size());
  for (const GainAdvice& g : gains) {
    losses.push_back(std::max(decibel(best_snr / g.at.midtone->snr), 20 * std::log10(g.at.midtone->uv_std / min_std)));
  }
  return losses;
}

/// Returns the lowest of the gains whose loss is smallest, or within equal_quality_db of it.
std::size_t best_gain(const AdviceRequest& r, const std::vector<double>& losses) {
  const double least = *std::ranges::min_element(losses);
  std::optional<std::size_t> best;
  for (std::size_t i = 0; i < losses.size(); ++i) {
    if (losses[i] > least + equal_quality_db) continue;
    if (!best || r.gains[i].sensor.system_gain_dn_per_e < r.gains[*best].sensor.system_gain_dn_per_e) best = i;
  }
  assert(best);
  return *best;
}

std::vector<AdvicePoint> curve_of(const AdviceRequest& r, const std::vector<GainAdvice>& gains) {
  const auto by_time = [](const GainAdvice& g) { return g.at.exposure_s; };
  const double begin = std::ranges::min(gains, {}, by_time).at.exposure_s / 10;
  const double end = std::min(r.longest_exposure_s, 10 * std::ranges::max(gains, {}, by_time).at.exposure_s);
  std::vector<AdvicePoint> curve;
  curve.reserve(gains.size() * static_cast<std::size_t>(r.curve_points));
  for (std::size_t gain = 0; gain < gains.size(); ++gain) {
    for (int i = 0; i < r.curve_points; ++i) {
      const double place = static_cast<double>(i) / (r.curve_points - 1);
      const double time_s = i + 1 == r.curve_points ? end : begin * std::pow(end / begin, place);
      curve.push_back(predicted_point(r, gain, time_s));
    }
  }
  return curve;
}

}  // namespace

double decibel(double snr) { return 10 * std::log10(snr); }

AdvicePoint predicted_point(const AdviceRequest& request, std::size_t gain, double exposure_s) {
  const GainSetting& setting = request.gains[gain];
  const SaturationLimits limits = limits_of(request, setting.sensor);
  const double highlight_e = fullest_rate(request, setting, request.highlight_cd_m2) * exposure_s;
  AdvicePoint out;
  out.gain = gain;
  out.exposure_s = exposure_s;
  out.highlight_charge_fraction = highlight_e / setting.sensor.full_well_e;
  out.highlight_code_fraction = highlight_e / code_range_e(setting.sensor);
  if (exposure_s > request.longest_exposure_s) {
    out.exceeds = ExposureLimit::motion;
  } else if (highlight_e > limits.converter_e && limits.converter_e <= limits.full_well_e) {
    out.exceeds = ExposureLimit::converter_range;
  } else if (highlight_e > limits.full_well_e) {
    out.exceeds = ExposureLimit::full_well;
  }
  const double midtone_e = fullest_rate(request, setting, request.midtone_cd_m2) * exposure_s;
  const double reachable_e = limits.min_e() * (1 + 1e-12);  // the limit, up to rounding
  if (midtone_e <= reachable_e) out.midtone = midtone_quality(request, setting, exposure_s);
  return out;
}

Result<ExposureAdvice> advise_exposure(const AdviceRequest& request) {
  if (const auto good = check_request(request); !good) return tl::make_unexpected(good.error());
  ExposureAdvice out;
  out.gains.reserve(request.gains.size());
  for (std::size_t i = 0; i < request.gains.size(); ++i) {
    const GainSetting& gain = request.gains[i];
    if (!(limits_of(request, gain.sensor).min_e() > 0)) {
      return fail(
          ErrorCode::invalid_argument,
          "noise alone clips more pixels than the fraction allowed; allow a larger fraction, or leave out this gain",
          gain.name);
    }
    out.gains.push_back(best_of(request, i));
    if (!out.gains.back().at.midtone) {
      return fail(ErrorCode::invalid_argument,
                  "the mid tone has no chromaticity, because X + Y + Z is not positive by the matrix; give the colours "
                  "of this camera",
                  gain.name);
    }
  }
  const std::vector<double> losses = losses_db(out.gains);
  out.best = best_gain(request, losses);
  out.curve = curve_of(request, out.gains);
  out.reason = advice_reason(request, out, losses);
  return out;
}

namespace {

constexpr double largest_luminance_cd_m2 = 1e12;
constexpr double least = 1e-12;  // lower limit of luminances, rates and times: their products stay within double

std::string text_of(double value) { return number_text(value, 3); }

tl::unexpected<Error> wrong(const std::string& what) { return fail(ErrorCode::invalid_argument, what); }

Result<void> check_gain(const GainSetting& gain) {
  if (auto good = check_sensor(gain.sensor); !good) return good;
  double most = 0;
  for (const double rate : gain.white_e_per_s) {
    if (!(rate >= 0) || !(rate <= 1e15)) {
      return fail(ErrorCode::invalid_argument,
                  "the electrons of a white must lie between 0 and 1e15 per second and cd/m2, found " + text_of(rate),
                  gain.name);
    }
    most = std::max(most, rate);
  }
  if (!(most >= least))
    return fail(ErrorCode::invalid_argument, "no channel is sensitive to the light; give another", gain.name);
  return {};
}

Result<void> check_light(const AdviceRequest& r) {
  if (!(r.midtone_cd_m2 >= least) || !(r.midtone_cd_m2 <= largest_luminance_cd_m2)) {
    return wrong("the mid tone's luminance must lie between 1e-12 and 1e12 cd/m2, found " + text_of(r.midtone_cd_m2));
  }
  if (!(r.highlight_cd_m2 >= r.midtone_cd_m2) || !(r.highlight_cd_m2 <= largest_luminance_cd_m2)) {
    return wrong("the highlight must be at least as bright as the mid tone of " + text_of(r.midtone_cd_m2) +
                 " cd/m2 and at most 1e12 cd/m2, found " + text_of(r.highlight_cd_m2));
  }
  if (!(r.clipped_fraction >= 1e-9) || !(r.clipped_fraction <= 0.5)) {
    return wrong("the fraction allowed to clip must be between 1e-9 and 0.5, found " + text_of(r.clipped_fraction));
  }
  return {};
}

const char* name_of(NoiseSource source) {
  static constexpr const char* names[] = {"photon noise", "dark current", "read noise", "quantisation"};
  return names[static_cast<int>(source)];
}

/// Returns the gain setting next to the best one, if there is one: the next higher, or the next lower.
std::optional<std::size_t> neighbour(const AdviceRequest& r, std::size_t best, bool higher) {
  const auto k = [&](std::size_t i) { return r.gains[i].sensor.system_gain_dn_per_e; };
  std::optional<std::size_t> found;
  for (std::size_t i = 0; i < r.gains.size(); ++i) {
    if (higher ? k(i) <= k(best) : k(i) >= k(best)) continue;
    if (!found || (higher ? k(i) < k(*found) : k(i) > k(*found))) found = i;
  }
  return found;
}

std::string limit_text(const AdviceRequest& r, const ExposureAdvice& advice) {
  const GainAdvice& best = advice.gains[advice.best];
  const std::string time = text_of(best.at.exposure_s) + " s";
  switch (best.limit) {
    case ExposureLimit::motion:
      return "the longest exposure allowed is " + time;
    case ExposureLimit::converter_range:
      return "the highlight reaches the converter's largest code at " + r.gains[advice.best].name + " after " + time;
    case ExposureLimit::full_well:
      break;
  }
  return "the highlight reaches the full well after " + time;
}

std::string higher_text(const AdviceRequest& r, const ExposureAdvice& advice, const std::vector<double>& losses_db) {
  const auto higher = neighbour(r, advice.best, true);
  if (!higher) return r.gains.size() > 1 ? "no higher gain has less read noise" : "";
  const bool sooner = advice.gains[*higher].at.exposure_s < advice.gains[advice.best].at.exposure_s;
  const std::string& name = r.gains[*higher].name;
  const double lost_db = losses_db[*higher] - losses_db[advice.best];
  if (sooner) return name + " would clip the highlight after " + text_of(advice.gains[*higher].at.exposure_s) + " s";
  if (lost_db > equal_quality_db) return name + " would lose " + text_of(lost_db) + " dB";
  return "above " + r.gains[advice.best].name + " noise no longer falls by " + text_of(equal_quality_db) + " dB";
}

}  // namespace

Result<double> motion_limit_s(const Motion& motion) {
  if (!(motion.speed_px_per_s > 0) || !(motion.blur_px > 0) || !std::isfinite(motion.speed_px_per_s)) {
    return wrong("speed and blur must be above 0 px/s and 0 px, found " + text_of(motion.speed_px_per_s) + " and " +
                 text_of(motion.blur_px));
  }
  const double limit_s = motion.blur_px / motion.speed_px_per_s;
  if (!(limit_s > 0) || !(limit_s <= 1e6)) {
    return wrong("blur over speed must be an exposure of at most 1e6 s, found " + text_of(limit_s) +
                 " s; give the longest exposure instead");
  }
  return limit_s;
}

Result<void> check_request(const AdviceRequest& r) {
  if (r.gains.empty()) return wrong("there is no gain setting to choose from; give a sensor that has figures");
  for (const GainSetting& gain : r.gains) {
    if (auto good = check_gain(gain); !good) return good;
  }
  if (auto good = check_light(r); !good) return good;
  if (!(r.longest_exposure_s >= least)) {
    return wrong("the longest exposure must be at least 1e-12 s, found " + text_of(r.longest_exposure_s));
  }
  if (auto good = check_exposure({r.longest_exposure_s, r.temperature_c}); !good) return good;
  if (!(r.patch_pixels >= 1) || !(r.patch_pixels <= 1e12)) {
    return wrong("a patch must have 1 to 1e12 pixels, found " + text_of(r.patch_pixels));
  }
  if (r.frames < 1 || r.frames > 1000000)
    return wrong("the number of frames must be 1 to 1000000, found " + text_of(r.frames));
  if (r.curve_points < 2 || r.curve_points > 10000) {
    return wrong("a curve must have 2 to 10000 points, found " + text_of(r.curve_points));
  }
  for (const Vector3& row : r.camera_to_xyz) {
    if (!std::ranges::all_of(row, [](double value) { return std::isfinite(value); })) {
      return wrong("the matrix to XYZ must be of finite numbers; give the colours of this camera");
    }
  }
  return {};
}

std::string advice_reason(const AdviceRequest& r, const ExposureAdvice& advice, const std::vector<double>& losses_db) {
  const GainAdvice& best = advice.gains[advice.best];
  std::string text = limit_text(r, advice);
  if (const auto lower = neighbour(r, advice.best, false)) {
    text += ", " + r.gains[*lower].name + " would lose " + text_of(losses_db[*lower] - losses_db[advice.best]) + " dB";
  }
  if (const std::string higher = higher_text(r, advice, losses_db); !higher.empty()) text += ", " + higher;
  return text + "; " + name_of(best.largest_noise) + " is " + text_of(100 * best.largest_noise_fraction) +
         " % of the variance";
}

}  // namespace lowlux::isp
