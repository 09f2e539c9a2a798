#include "isp/model/sensor/bracket_advice.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include "isp/base/text.h"

namespace lowlux::isp {
namespace {

constexpr double max_frames = 9999;
constexpr double min_step = 2, max_step = 16;  // ratio of neighbouring exposures: merging compares their light
constexpr double rounding = 1e-9;              // of ratios, before they are rounded up

double whole_above(double ratio) { return std::max(1.0, std::ceil(ratio * (1 - rounding))); }

/// Returns the ratio of a frame whose exposure is `light` times that of the raw.
double frame_snr(const BracketScene& scene, double light, double signal_e) {
  const double signal = light * signal_e;
  return signal * signal / (signal + light * scene.dark_charge_e + scene.noise_variance_e2);
}

/// Returns x for which x^2 = snr (c x + v).
double root_of(double snr, double c, double v) { return (snr * c + std::sqrt(snr * snr * c * c + 4 * snr * v)) / 2; }

/// Returns the exposure, relative to that of the raw, at which one frame reaches the requested ratio.
double light_needed(const BracketRequest& r) {
  const double m = r.scene.darkest_e;
  return root_of(r.snr, (m + r.scene.dark_charge_e) / m, r.scene.noise_variance_e2) / m;
}

/// Returns the number of frames that add up to the requested ratio, in addition to what others have.
double frames_for(const BracketRequest& r, double light, double signal_e, double others_snr) {
  return whole_above((r.snr - others_snr) / frame_snr(r.scene, light, signal_e));
}

/// Returns exposures from `shortest` to `longest`, relative to that of the raw, and how many frames of each.
std::vector<BracketExposure> bracket_between(const BracketRequest& r, double shortest, double longest) {
  const BracketScene& scene = r.scene;
  const double enough_e = root_of(r.snr, 1, scene.noise_variance_e2);
  const double step = std::clamp(scene.saturation_e / enough_e, min_step, max_step);
  const double ratio = longest / shortest;
  const auto steps = static_cast<int>(whole_above(std::log(ratio) / std::log(step)));
  std::vector<BracketExposure> out;
  for (int i = 0; i <= steps; ++i) {
    const double light = i == steps ? longest : shortest * std::pow(ratio, static_cast<double>(i) / steps);
    const double next = shortest * std::pow(ratio, static_cast<double>(i + 1) / steps);
    const double signal_e = i == steps ? scene.darkest_e : scene.saturation_e / next - scene.dark_charge_e;
    const double count = frames_for(r, light, signal_e, merged_snr(scene, out, signal_e));
    out.push_back({light * scene.exposure_s, static_cast<int>(std::min(count, max_frames + 1))});
  }
  return out;
}

double count_of(const std::vector<BracketExposure>& exposures) {
  return std::accumulate(exposures.begin(), exposures.end(), 0.0,
                         [](double sum, const BracketExposure& e) { return sum + e.frames; });
}

Result<void> check(const BracketRequest& r) {
  const BracketScene& s = r.scene;
  for (const double value : {s.exposure_s, s.darkest_e, s.saturation_e, s.highlight_fraction, r.snr}) {
    if (!(value > 0) || !std::isfinite(value)) {
      return fail(ErrorCode::invalid_argument,
                  "exposure, signal, saturation, highlights and signal-to-noise ratio must be above 0, found " +
                      number_text(value, 3));
    }
  }
  if (!(s.dark_charge_e >= 0) || !(s.noise_variance_e2 >= 0) || !(r.longest_exposure_s > 0)) {
    return fail(ErrorCode::invalid_argument, "dark charge, noise or the longest exposure is negative");
  }
  return {};
}

}  // namespace

double merged_snr(const BracketScene& scene, std::span<const BracketExposure> exposures, double signal_e) {
  double snr = 0;
  for (const BracketExposure& e : exposures) {
    const double light = e.exposure_s / scene.exposure_s;
    if (light * (signal_e + scene.dark_charge_e) > scene.saturation_e * (1 + rounding)) continue;
    snr += e.frames * frame_snr(scene, light, signal_e);
  }
  return snr;
}

Result<BracketAdvice> advise_bracket(const BracketRequest& request) {
  if (auto good = check(request); !good) return tl::make_unexpected(good.error());
  const BracketScene& scene = request.scene;
  const double needed = light_needed(request), held = 1 / scene.highlight_fraction;
  const double allowed = request.longest_exposure_s / scene.exposure_s;
  const double shortest = std::min({held, allowed, needed});
  const double filled = scene.saturation_e / (scene.darkest_e + scene.dark_charge_e);
  const double longest = std::min({needed, allowed, filled});
  BracketAdvice out;
  out.raw_snr = frame_snr(scene, 1, scene.darkest_e);
  out.frames_like_raw = frames_for(request, 1, scene.darkest_e, 0);
  out.highlight_exposure_s = held * scene.exposure_s;
  out.shadow_exposure_s = needed * scene.exposure_s;
  const double equal = frames_for(request, shortest, scene.darkest_e, 0);
  out.exposures = {{shortest * scene.exposure_s, static_cast<int>(std::min(equal, max_frames + 1))}};
  if (longest > shortest * (1 + rounding)) {
    std::vector<BracketExposure> bracket = bracket_between(request, shortest, longest);
    if (count_of(bracket) < equal) out.exposures = std::move(bracket);
  }
  if (count_of(out.exposures) > max_frames) {
    return fail(ErrorCode::insufficient, "more than 9999 frames would be needed for " +
                                             number_text(10 * std::log10(request.snr), 3) +
                                             " dB; ask for less, or allow longer exposures");
  }
  out.snr = merged_snr(scene, out.exposures, scene.darkest_e);
  return out;
}

}  // namespace lowlux::isp
