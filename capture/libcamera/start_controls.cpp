#include "capture/libcamera/start_controls.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "isp/base/text.h"

namespace lowlux::capture {
namespace {

constexpr double usual_frame_us = 1e6 / 30;
// One year: longer than any frame, and far below the limit of 64 bits.
constexpr double longest_frame_us = 3.2e13;

std::int64_t whole_us(double time_us) { return std::llround(std::clamp(time_us, 1.0, longest_frame_us)); }

struct Wanted {
  const char* name;
  double value;
};

/// Returns whether the control can be set; warns if it is absent or its range does not include the value.
bool is_settable(const Wanted& wanted, const OfferedControl& control, std::vector<std::string>& warnings) {
  if (!control.offered) {
    warnings.push_back(std::string("the camera has no control of its ") + wanted.name + ": " +
                       number_text(wanted.value) + " is not set");
    return false;
  }
  if (control.range && !(wanted.value >= control.range->least && wanted.value <= control.range->largest)) {
    warnings.push_back("the camera states a range of " + number_text(control.range->least) + " to " +
                       number_text(control.range->largest) + " for its " + wanted.name + ", asked for is " +
                       number_text(wanted.value) + ": it may take the nearest");
  }
  return true;
}

void set_frame_duration(const CameraRequest& request, const OfferedControl& control, StartControls& controls) {
  if (request.frame_rate_hz) {
    const double frame_us = 1e6 / *request.frame_rate_hz;
    if (is_settable({"frame duration [us]", frame_us}, control, controls.warnings)) {
      controls.frame_duration_us = {whole_us(frame_us), whole_us(frame_us)};
    }
    if (request.exposure_s && *request.exposure_s * 1e6 > frame_us) {
      controls.warnings.push_back("an exposure of " + number_text(*request.exposure_s) +
                                  " s is longer than a frame at " + number_text(*request.frame_rate_hz) +
                                  " Hz: the camera shortens one of them");
    }
  } else if (controls.exposure_us && *controls.exposure_us > usual_frame_us && control.offered) {
    // Rows are read after the exposure, so a frame is longer than it by some rows; the camera uses the minimum it
    // needs.
    const double longest_us = std::max(control.range ? control.range->largest : 0.0, 2.0 * *controls.exposure_us);
    controls.frame_duration_us = {*controls.exposure_us, whole_us(longest_us)};
  }
}

}  // namespace

StartControls start_controls(const CameraRequest& request, const OfferedControls& offered) {
  StartControls controls;
  if (request.exposure_s) {
    const double exposure_us = *request.exposure_s * 1e6;
    if (is_settable({"exposure [us]", exposure_us}, offered.exposure_us, controls.warnings)) {
      constexpr auto largest_us = static_cast<double>(std::numeric_limits<std::int32_t>::max());
      controls.exposure_us = static_cast<std::int32_t>(std::lround(std::clamp(exposure_us, 1.0, largest_us)));
    }
  }
  if (request.analogue_gain &&
      is_settable({"analogue gain", *request.analogue_gain}, offered.analogue_gain, controls.warnings)) {
    constexpr auto largest = static_cast<double>(std::numeric_limits<float>::max());
    controls.analogue_gain = static_cast<float>(std::min(*request.analogue_gain, largest));
  }
  controls.ae_off = offered.ae_enable && (controls.exposure_us || controls.analogue_gain);
  set_frame_duration(request, offered.frame_duration_us, controls);
  return controls;
}

Result<ExposureControls> exposure_controls(const CameraRequest& request, const OfferedControls& offered) {
  const auto& time = offered.exposure_us;
  if (!time.offered || !time.range || !(time.range->largest >= 1)) {
    return fail(ErrorCode::unsupported,
                std::string("automatic exposure: the camera ") +
                    (time.offered ? "states no range of its exposure time" : "has no control of its exposure time"));
  }
  ExposureControls out;
  out.step_s = 1e-6;
  out.min_s = std::ceil(std::max(time.range->least, 1.0)) * 1e-6;
  out.max_s = std::max(std::floor(time.range->largest) * 1e-6, out.min_s);
  const auto& gain = offered.analogue_gain;
  if (request.analogue_gain || !gain.offered || !gain.range || !(gain.range->largest >= gain.range->least)) return out;
  constexpr int steps_for_each_ev = 16, max_steps = 16 * steps_for_each_ev;
  const double first = std::max(gain.range->least, 1e-3);
  for (int i = 0; i <= max_steps; ++i) {
    const double factor = first * std::exp2(static_cast<double>(i) / steps_for_each_ev);
    if (i > 0 && factor > gain.range->largest) break;
    out.gains.push_back({.factor = factor, .code = 0});
  }
  return out;
}

StartControls exposure_settings(const CameraRequest& request, const CameraExposure& exposure,
                                const OfferedControls& offered) {
  CameraRequest wanted = request;
  wanted.exposure_s = exposure.exposure_s;
  if (exposure.gain) wanted.analogue_gain = exposure.gain->factor;
  StartControls out = start_controls(wanted, offered);
  if (!request.frame_rate_hz && offered.frame_duration_us.offered) {
    const double exposure_us = exposure.exposure_s * 1e6;
    out.frame_duration_us = {whole_us(std::max(exposure_us, usual_frame_us)),
                             whole_us(std::max(2 * exposure_us, usual_frame_us))};
  }
  return out;
}

}  // namespace lowlux::capture
