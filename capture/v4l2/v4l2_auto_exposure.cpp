#include "capture/v4l2/v4l2_auto_exposure.h"

#include <algorithm>
#include <cstdint>
#include <string>

#include "capture/file/pass_on.h"
#include "isp/base/text.h"

namespace lowlux::capture {
namespace {

tl::unexpected<Error> unsupported(const V4l2Device& device, const std::string& why) {
  return fail(ErrorCode::unsupported, "automatic exposure: " + why, device.path());
}

Result<V4l2Control> gain_for(V4l2Device& device, const std::vector<CameraGain>& codes) {
  const auto gain = find_gain(device);
  if (!gain || !gain->writable)
    return unsupported(device, "the driver has no control of its gain: leave the codes out");
  for (const CameraGain& one : codes) {
    if (one.code >= gain->minimum && one.code <= gain->maximum &&
        (std::int64_t{one.code} - gain->minimum) % gain->step == 0)
      continue;
    return fail(ErrorCode::invalid_argument,
                "gain code " + std::to_string(one.code) + " is not one of the driver's " + range_text(*gain) +
                    (gain->step > 1 ? " in steps of " + std::to_string(gain->step) : ""),
                device.path());
  }
  if (!end_automatic_gain(device)) return unsupported(device, "the driver's automatic gain cannot be switched off");
  return *gain;
}

}  // namespace

Result<V4l2AutoExposure> V4l2AutoExposure::take(V4l2Device& device, const V4l2Options& options,
                                                const CameraFormat& format) {
  const bool stays = end_automatic_exposure(device);
  V4l2AutoExposure out;
  const auto time = find_exposure_time(device, format);
  if (device.gone()) return tl::make_unexpected(device.gone_error());
  if (!time || !time->control.writable) {
    return unsupported(device, "the driver has no control of the exposure time whose unit is known");
  }
  if (!stays) return unsupported(device, "the driver's own cannot be switched off");
  out.time_ = *time;
  const double unit_s = time->unit_s;
  const int first = std::max(time->control.minimum, time->control.minimum > 0 ? 0 : time->control.step);
  out.controls_.min_s = first * unit_s;
  out.controls_.max_s = time->max_s();
  out.controls_.step_s = time->control.step * unit_s;
  if (!(out.controls_.max_s >= out.controls_.min_s)) {
    return unsupported(device, "the driver states exposure times of " + range_text(time->control));
  }
  if (options.gain_codes.empty()) return out;
  auto gain = gain_for(device, options.gain_codes);
  if (!gain) return pass_on(gain);
  out.gain_ = *gain;
  out.controls_.gains = options.gain_codes;
  return out;
}

Result<double> V4l2AutoExposure::set(V4l2Device& device, const CameraExposure& exposure) {
  if (gain_ && exposure.gain && exposure.gain->code != code_) {
    const int wanted = exposure.gain->code;
    auto set = write_control(device, *gain_, wanted);
    if (!set) return pass_on(set);
    if (*set != wanted) {
      return unsupported(device, "the driver sets gain code " + std::to_string(*set) + " where " +
                                     std::to_string(wanted) + " was asked for: leave that code out");
    }
    code_ = wanted;
  }
  auto set_s = set_exposure_time(device, time_, exposure.exposure_s);
  if (set_s && *set_s <= 0)
    return unsupported(device, "the driver sets an exposure time of " + number_text(*set_s) + " s");
  return set_s;
}

}  // namespace lowlux::capture
