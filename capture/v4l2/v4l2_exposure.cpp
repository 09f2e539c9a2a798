#include "capture/v4l2/v4l2_exposure.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <numeric>
#include <optional>

#include <linux/videodev2.h>

#include "isp/base/text.h"

namespace lowlux::capture {
namespace {

// V4L2 deprecates it as a synonym of brightness, but drivers of raw cameras still use it for the pedestal.
constexpr std::uint32_t control_black_level = 0x0098090b;

/// Returns the time of one line: (width read out + horizontal blanking) / pixel rate; nullopt if the node does not have
/// both.
std::optional<double> line_time_s(V4l2Device& device, const CameraFormat& format) {
  const auto rate_hz = read_wide_control(device, V4L2_CID_PIXEL_RATE);
  const auto blanking = read_control(device, V4L2_CID_HBLANK);
  if (!rate_hz || !blanking || *rate_hz <= 0 || *blanking < 0) return std::nullopt;
  v4l2_selection crop{};
  crop.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  crop.target = V4L2_SEL_TGT_CROP;
  const bool cropped = device.call(VIDIOC_G_SELECTION, &crop) == 0 && crop.r.width > 0;
  const double width = cropped ? crop.r.width : format.width;
  return (width + *blanking) / static_cast<double>(*rate_hz);
}

bool exposes_by_itself(V4l2Device& device) {
  const auto mode = read_control(device, V4L2_CID_EXPOSURE_AUTO);
  return mode && *mode != V4L2_EXPOSURE_MANUAL && *mode != V4L2_EXPOSURE_SHUTTER_PRIORITY;
}

void apply_exposure_time(V4l2Device& device, double wanted_s, const CameraFormat& format,
                         std::vector<std::string>& warnings) {
  const std::string asked = "exposure of " + number_text(wanted_s) + " s";
  const bool stays = end_automatic_exposure(device);
  const auto exposure = find_exposure_time(device, format);
  if (!exposure || !exposure->control.writable) {
    warnings.push_back(asked + ": the driver has no control for it whose unit is known");
    return;
  }
  const auto set_s = set_exposure_time(device, *exposure, wanted_s);
  if (!set_s) {
    warnings.push_back(asked + ": " + set_s.error().message);
    return;
  }
  if (std::abs(*set_s - wanted_s) > 0.5001 * exposure->control.step * exposure->unit_s) {
    warnings.push_back(asked + ": the driver sets " + number_text(*set_s) + " s");
  }
  if (!stays) warnings.push_back(asked + ": the automatic exposure cannot be switched off");
}

void set_gain(V4l2Device& device, const V4l2Control& gain, int code, std::vector<std::string>& warnings) {
  if (!end_automatic_gain(device)) warnings.emplace_back("the automatic gain cannot be switched off");
  const auto set = write_control(device, gain, code);
  if (set && *set == code) return;
  warnings.push_back("gain code " + std::to_string(code) + ": " +
                     (set ? "the driver sets " + std::to_string(*set) : set.error().message));
}

Result<void> apply_gain(V4l2Device& device, const V4l2Options& options, std::vector<std::string>& warnings) {
  const std::optional<double>& factor = options.request.analogue_gain;
  if (!factor && !options.gain_code) return {};
  const auto gain = find_gain(device);
  if (!gain) {
    warnings.emplace_back("gain: the driver has no control for it");
  } else if (options.gain_code) {
    if (*options.gain_code < gain->minimum || *options.gain_code > gain->maximum) {
      return fail(
          ErrorCode::invalid_argument,
          "gain code " + std::to_string(*options.gain_code) + " is not one of the driver's " + range_text(*gain),
          device.path());
    }
    set_gain(device, *gain, *options.gain_code, warnings);
  } else if (*factor == 1.0 && gain->id == V4L2_CID_ANALOGUE_GAIN) {
    set_gain(device, *gain, gain->minimum, warnings);
  } else {
    warnings.push_back("gain of " + number_text(*factor) +
                       ": V4L2 does not state the factors of the driver's codes; give one of them, " +
                       range_text(*gain));
  }
  return {};
}

/// Returns a rate as a fraction of seconds: to 1e-4 Hz, lowest terms.
v4l2_fract interval_of(double rate_hz) {
  constexpr std::uint32_t fineness = 10000;
  const auto denominator = static_cast<std::uint32_t>(std::lround(rate_hz * fineness));
  const std::uint32_t common = std::gcd(fineness, denominator);
  return {fineness / common, denominator / common};
}

}  // namespace

std::optional<V4l2ExposureTime> find_exposure_time(V4l2Device& device, const CameraFormat& format) {
  if (const auto absolute = find_control(device, V4L2_CID_EXPOSURE_ABSOLUTE))
    return V4l2ExposureTime{.control = *absolute, .unit_s = 100e-6};
  const auto lines = find_control(device, V4L2_CID_EXPOSURE);
  if (!lines) return std::nullopt;
  const auto line_s = line_time_s(device, format);
  if (!line_s) return std::nullopt;
  V4l2ExposureTime out{.control = *lines, .unit_s = *line_s};
  const auto blanking = find_control(device, V4L2_CID_VBLANK);
  const auto blanking_lines = blanking && blanking->writable ? read_control(device, V4L2_CID_VBLANK) : std::nullopt;
  if (blanking_lines) {
    out.blanking = blanking;
    out.blanking_lines = *blanking_lines;
  }
  return out;
}

double V4l2ExposureTime::max_s() const {
  const double added = blanking ? std::max(0.0, static_cast<double>(blanking->maximum) - blanking_lines) : 0;
  return (control.maximum + added) * unit_s;
}

Result<double> set_exposure_time(V4l2Device& device, const V4l2ExposureTime& time, double wanted_s) {
  const double wanted = wanted_s / time.unit_s;
  V4l2Control control = time.control;
  if (time.blanking) {
    const double lines = time.blanking_lines + std::max(0.0, std::ceil(wanted - control.maximum));
    // If the driver refuses, its blanking stays and the exposure is the longest that fits, which the caller sees.
    if (read_control(device, time.blanking->id) != lines) {
      static_cast<void>(write_control(device, *time.blanking, lines + (time.blanking->step - 1) / 2.0));
    }
    control = find_control(device, control.id).value_or(control);  // its range follows the blanking
  }
  const auto set = write_control(device, control, wanted);
  if (!set) return tl::make_unexpected(set.error());
  return *set * time.unit_s;
}

bool end_automatic_exposure(V4l2Device& device) {
  const auto mode = find_control(device, V4L2_CID_EXPOSURE_AUTO);
  if (!mode) return true;
  for (const int wanted : {V4L2_EXPOSURE_MANUAL, V4L2_EXPOSURE_SHUTTER_PRIORITY}) {
    if (!exposes_by_itself(device)) return true;
    if (const auto set = write_control(device, *mode, wanted); set && *set == wanted) return true;
  }
  return !exposes_by_itself(device);
}

bool end_automatic_gain(V4l2Device& device) {
  const auto automatic = find_control(device, V4L2_CID_AUTOGAIN);
  if (!automatic) return true;
  const auto off = write_control(device, *automatic, 0);
  return off && *off == 0;
}

std::optional<V4l2Control> find_gain(V4l2Device& device) {
  const auto analogue = find_control(device, V4L2_CID_ANALOGUE_GAIN);
  return analogue ? analogue : find_control(device, V4L2_CID_GAIN);
}

std::string range_text(const V4l2Control& control) {
  return std::to_string(control.minimum) + " to " + std::to_string(control.maximum);
}

void apply_frame_rate(V4l2Device& device, const CameraRequest& request, CameraFormat& format,
                      std::vector<std::string>& warnings) {
  v4l2_streamparm told{};
  told.type = device.buffer_type();
  v4l2_captureparm& capture = told.parm.capture;
  int code = device.call(VIDIOC_G_PARM, &told);
  if (code == 0 && request.frame_rate_hz && (capture.capability & V4L2_CAP_TIMEPERFRAME) != 0) {
    told = {};
    told.type = device.buffer_type();
    capture.timeperframe = interval_of(*request.frame_rate_hz);
    code = device.call(VIDIOC_S_PARM, &told);
  }
  const v4l2_fract& interval = capture.timeperframe;
  if (code == 0 && interval.numerator > 0 && interval.denominator > 0) {
    format.frame_rate_hz = static_cast<double>(interval.denominator) / interval.numerator;
  }
  if (!request.frame_rate_hz) return;
  const std::string asked = "frame rate of " + number_text(*request.frame_rate_hz) + " Hz: ";
  if (!format.frame_rate_hz) {
    warnings.push_back(asked + "the driver has no control for it");
  } else if (std::abs(*format.frame_rate_hz / *request.frame_rate_hz - 1) > 1e-3) {
    warnings.push_back(asked + "the driver keeps " + number_text(*format.frame_rate_hz) + " Hz");
  }
}

Result<void> apply_exposure(V4l2Device& device, const V4l2Options& options, const CameraFormat& format,
                            std::vector<std::string>& warnings) {
  if (options.request.exposure_s) apply_exposure_time(device, *options.request.exposure_s, format, warnings);
  return apply_gain(device, options, warnings);
}

FrameFacts read_facts(V4l2Device& device, const CameraFormat& format) {
  FrameFacts facts;
  const auto exposure = find_exposure_time(device, format);
  if (exposure && exposure->control.is_steady && !exposes_by_itself(device)) {
    const auto count = read_control(device, exposure->control.id);
    if (count && *count > 0) facts.exposure_s = *count * exposure->unit_s;
  }
  const auto gain = find_control(device, V4L2_CID_ANALOGUE_GAIN);
  if (gain && gain->is_steady && read_control(device, V4L2_CID_AUTOGAIN).value_or(0) == 0 &&
      read_control(device, V4L2_CID_ANALOGUE_GAIN) == gain->minimum) {
    facts.analogue_gain = 1.0;
  }
  const auto black = find_control(device, control_black_level);
  const auto level_dn = black && black->is_steady ? read_control(device, control_black_level) : std::nullopt;
  if (level_dn && *level_dn >= 0 && *level_dn < largest_code(format.raw)) {
    const double level = *level_dn;
    facts.black_level_dn = std::array{level, level, level, level};
  }
  return facts;
}

namespace {

/// V4L2_CTRL_FLAG_MODIFY_LAYOUT of Linux 4.15; older headers do not define it.
constexpr std::uint32_t flag_modifies_layout = 0x0400;

struct Flip {
  std::uint32_t id;
  const char* name;
  std::optional<bool> wanted;
};

}  // namespace

std::optional<V4l2Control> find_control(V4l2Device& device, std::uint32_t id) {
  v4l2_queryctrl told{};
  told.id = id;
  if (device.call(VIDIOC_QUERYCTRL, &told) != 0 || (told.flags & V4L2_CTRL_FLAG_DISABLED) != 0) return std::nullopt;
  constexpr std::uint32_t unsteady = V4L2_CTRL_FLAG_INACTIVE | V4L2_CTRL_FLAG_VOLATILE;
  return V4l2Control{.id = id,
                     .minimum = told.minimum,
                     .maximum = std::max(told.minimum, told.maximum),
                     .step = std::max(told.step, 1),
                     .writable = (told.flags & V4L2_CTRL_FLAG_READ_ONLY) == 0,
                     .is_steady = (told.flags & unsteady) == 0,
                     .modifies_layout = (told.flags & flag_modifies_layout) != 0};
}

std::optional<int> read_control(V4l2Device& device, std::uint32_t id) {
  v4l2_control one{};
  one.id = id;
  if (device.call(VIDIOC_G_CTRL, &one) != 0) return std::nullopt;
  return one.value;
}

std::optional<std::int64_t> read_wide_control(V4l2Device& device, std::uint32_t id) {
  v4l2_ext_control one{};
  one.id = id;
  v4l2_ext_controls list{};
  list.which = V4L2_CTRL_WHICH_CUR_VAL;
  list.count = 1;
  list.controls = &one;
  if (device.call(VIDIOC_G_EXT_CTRLS, &list) != 0) return std::nullopt;
  return static_cast<std::int64_t>(one.value64);
}

Result<int> write_control(V4l2Device& device, const V4l2Control& control, double wanted) {
  const double steps =
      std::round((std::clamp<double>(wanted, control.minimum, control.maximum) - control.minimum) / control.step);
  const double value = control.minimum + steps * control.step;
  v4l2_control one{};
  one.id = control.id;
  one.value = static_cast<int>(value > control.maximum ? value - control.step : value);
  if (const int code = device.call(VIDIOC_S_CTRL, &one)) {
    return tl::make_unexpected(device.error(code, "the driver refuses the value " + std::to_string(one.value)));
  }
  return read_control(device, control.id).value_or(one.value);
}

std::vector<std::string> apply_flips(V4l2Device& device, const CameraRequest& request,
                                     std::vector<std::string>& warnings) {
  const Flip flips[] = {{V4L2_CID_HFLIP, "horizontal flip", request.flip_horizontal},
                        {V4L2_CID_VFLIP, "vertical flip", request.flip_vertical}};
  std::vector<std::string> silent;
  for (const Flip& flip : flips) {
    const auto control = find_control(device, flip.id);
    int now = control ? read_control(device, flip.id).value_or(0) : 0;
    if (flip.wanted && (now != 0) != *flip.wanted) {
      const auto set = control ? write_control(device, *control, *flip.wanted ? 1 : 0)
                               : Result<int>(fail(ErrorCode::unsupported, "the driver has no such control"));
      if (set) now = *set;
      if (!set || (*set != 0) != *flip.wanted) {
        warnings.push_back(std::string(flip.name) + " cannot be switched " + (*flip.wanted ? "on" : "off") + ": " +
                           (set ? "the driver keeps its value" : set.error().message));
      }
    }
    if (control && now != 0 && !control->modifies_layout) silent.emplace_back(flip.name);
  }
  return silent;
}

}  // namespace lowlux::capture
