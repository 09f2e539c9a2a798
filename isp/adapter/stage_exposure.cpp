#include "isp/adapter/stage_exposure.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace lowlux::isp {
namespace {

constexpr double usual_clipped_fraction = 1e-3;
constexpr double steps_for_each_ev = 16, most_factor = 1e4;

static_assert(static_cast<int>(ExposureLimit::motion) + 1 == LOWLUX_STAGE_LIMIT_TIME &&
              static_cast<int>(ExposureLimit::converter_range) + 1 == LOWLUX_STAGE_LIMIT_CODES &&
              static_cast<int>(ExposureLimit::full_well) + 1 == LOWLUX_STAGE_LIMIT_FULL_WELL);

Mains mains_of(std::int32_t hz) {
  if (hz == 50) return Mains::hz50;
  if (hz == 60) return Mains::hz60;
  return hz == LOWLUX_STAGE_MAINS_EITHER ? Mains::either : Mains::off;
}

ExposureLimits limits_of(const lowlux_stage_params& params) {
  ExposureLimits out;
  out.times = {std::max<double>(params.min_exposure_s, 1e-7), params.max_exposure_s, 0};
  out.longest_s = params.max_exposure_s;
  if (params.max_gain > 0) out.max_factor = params.max_gain;
  out.mains = mains_of(params.mains_hz);
  out.clipped_fraction = params.clipped_fraction > 0 ? params.clipped_fraction : usual_clipped_fraction;
  if ((params.valid & LOWLUX_STAGE_HAS_TEMPERATURE) != 0) out.temperature_c = params.temperature_c;
  return out;
}

}  // namespace

std::vector<double> StageExposure::factors() {
  std::vector<double> out;
  for (int i = 0; i <= steps_for_each_ev * std::log2(most_factor); ++i) out.push_back(std::exp2(i / steps_for_each_ev));
  return out;
}

StageExposure::StageExposure(const RawFormat& format, std::vector<GainStep> gains)
    : meter_(format), controller_({.gains = std::move(gains), .limits = {}, .at = {}}) {}

void StageExposure::reset() {
  is_running_ = false;
  lowest_dn_.reset();
}

bool StageExposure::advise(const RawDn& raw, MeteredBlack black, const lowlux_stage_params& params,
                           lowlux_stage_result& out) {
  constexpr std::uint32_t needed =
      LOWLUX_STAGE_HAS_EXPOSURE_LIMITS | LOWLUX_STAGE_HAS_EXPOSURE | LOWLUX_STAGE_HAS_ANALOGUE_GAIN;
  if ((params.valid & needed) != needed) return false;
  const bool is_scaled = (params.valid & LOWLUX_STAGE_HAS_DIGITAL_GAIN) != 0;
  const double factor = params.analogue_gain * (is_scaled ? params.digital_gain : 1.0);
  const ExposureLimits limits = limits_of(params);
  controller_.set_limits(limits);
  if (!is_running_) controller_.reset({params.exposure_s, controller_.gain_near(factor)});
  is_running_ = true;
  meter_.clear();
  for (int y = 0; y < raw.active.height; ++y) {
    if (is_metered_row(y, raw.active.height)) {
      meter_.add_row(raw.dn.row(raw.active.y + y) + raw.active.x, raw.active.width, y);
    }
  }
  // The black level includes the mean dark charge, which the controller subtracts by its own model.
  const GainStep& step = controller_.gains()[controller_.gain_near(factor)];
  const double dn_per_e = step.sensor.system_gain_dn_per_e * factor / step.factor;
  for (double& site_dn : black.dn) site_dn -= dark_e_per_s(step, limits) * params.exposure_s * dn_per_e;
  if (black.is_bound) {
    if (!lowest_dn_) lowest_dn_ = black.dn;
    for (int site = 0; site < 4; ++site) {
      black.dn[site] = (*lowest_dn_)[site] = std::max(0.0, std::min(black.dn[site], (*lowest_dn_)[site]));
    }
  }
  controller_.take(meter_.codes(black, raw.white_dn[1], limits.clipped_fraction),
                   StatedExposure{params.exposure_s, factor});
  const ExposureSetting& setting = controller_.setting();
  out.advised_exposure_s = static_cast<float>(setting.exposure_s);
  out.advised_gain = static_cast<float>(controller_.gains()[setting.gain].factor);
  out.advised_snr_db = static_cast<float>(decibel(controller_.choice().snr));
  out.advised_limit = static_cast<std::int32_t>(controller_.choice().limit) + 1;
  return true;
}

const char* fault_of_limits(const lowlux_stage_params& params) {
  const auto within = [](double value, double low, double high) { return value >= low && value <= high; };
  if (!within(params.max_exposure_s, 1e-7, 1e5)) return "the longest exposure must be between 1e-7 and 1e5 s";
  if (!within(params.min_exposure_s, 0, params.max_exposure_s)) return "the shortest exposure exceeds the longest";
  if (params.max_gain != 0 && !within(params.max_gain, 1, most_factor))
    return "the largest gain must be between 1 and 1e4";
  if (params.clipped_fraction != 0 && !within(params.clipped_fraction, 1e-9F, 0.5)) {
    return "the fraction that may clip must be between 1e-9 and 0.5";
  }
  const bool known = params.mains_hz == 0 || mains_of(params.mains_hz) != Mains::off;
  return known ? nullptr : "the mains frequency must be 50 or 60 Hz, 0 for none, or -1 for either";
}

}  // namespace lowlux::isp
