#include "calib/frame_setting.h"

#include <cmath>

#include <fmt/format.h>

#include "isp/base/camera_profile.h"

namespace lowlux::calib {
namespace {

constexpr int smallest_side = 16;

tl::unexpected<Error> differs(const std::string& what, const std::string& found, const std::string& expected) {
  return fail(ErrorCode::invalid_argument,
              fmt::format("{} {}, the first frame {}; frames of one calibration must agree", what, found, expected));
}

std::string text_of(const std::optional<double>& value) { return value ? fmt::format("{:g}", *value) : "not stated"; }

}  // namespace

Result<FrameSetting> setting_of(const RawDn& raw) {
  if (raw.layout == SensorLayout::linear_rgb) {
    return fail(ErrorCode::unsupported,
                raw.from_x_trans ? "X-Trans supports dark and bias frames (--dark-frame, --bias-frame) only: flats, "
                                   "profiles and calibration need the 2 x 2 sites of a Bayer mosaic"
                                 : "the frame is already demosaiced; calibration needs the mosaic of the sensor");
  }
  if (raw.is_float()) {
    return fail(ErrorCode::unsupported,
                "the frame has floating-point samples; darks, flats and calibration need integer codes of the sensor");
  }
  const Rect& a = raw.active;
  if (a.width < smallest_side || a.height < smallest_side) {
    return fail(ErrorCode::insufficient, fmt::format("the active area is {} x {} pixels, calibration needs {} x {}",
                                                     a.width, a.height, smallest_side, smallest_side));
  }
  if (a.x < 0 || a.y < 0 || a.width > raw.dn.width() - a.x || a.height > raw.dn.height() - a.y) {
    return fail(ErrorCode::malformed, "the active area lies outside of the readout");
  }
  for (const double white : raw.white_dn) {
    if (!(white > 0)) return fail(ErrorCode::malformed, fmt::format("the white level is {:g} DN, not positive", white));
  }
  const auto& time = raw.info.exposure_s;
  if (time && !(*time >= 0 && std::isfinite(*time))) {
    return fail(ErrorCode::malformed, fmt::format("the exposure time is {:g} s, not a time", *time));
  }
  if (raw.info.temperature_c && !std::isfinite(*raw.info.temperature_c)) {
    return fail(ErrorCode::malformed, "the temperature is not a finite number");
  }
  return FrameSetting{raw.info.make, raw.info.model, raw.layout,   raw.phase,           a.width,
                      a.height,      raw.white_dn,   raw.info.iso, raw.info.exposure_s, raw.info.temperature_c};
}

bool same_temperature(const std::optional<double>& first_c, const std::optional<double>& second_c) {
  if (!first_c || !second_c) return first_c.has_value() == second_c.has_value();
  return std::fabs(*first_c - *second_c) <= same_temperature_c;
}

Result<void> check_same_camera(const FrameSetting& first, const FrameSetting& second, const std::string& what) {
  if (!is_same_camera({first.make, first.model}, {second.make, second.model})) {
    return differs(what, fmt::format("is of camera \"{}\"", camera_name(second.make, second.model)),
                   fmt::format("of \"{}\"", camera_name(first.make, first.model)));
  }
  if (first.width != second.width || first.height != second.height) {
    return differs(what, fmt::format("has {} x {} pixels", second.width, second.height),
                   fmt::format("{} x {}", first.width, first.height));
  }
  if (first.layout != second.layout || (first.layout == SensorLayout::bayer && first.phase != second.phase)) {
    return differs(what, "has another mosaic", "starts with another colour");
  }
  if (first.white_dn != second.white_dn) {
    return differs(what, fmt::format("has white at {:g} DN", second.white_dn[1]),
                   fmt::format("at {:g} DN", first.white_dn[1]));
  }
  if (first.iso != second.iso) {
    return differs(what, fmt::format("has ISO {}", text_of(second.iso)), fmt::format("ISO {}", text_of(first.iso)));
  }
  return {};
}

Result<void> check_same_setting(const FrameSetting& first, const FrameSetting& second, const std::string& what) {
  if (auto same = check_same_camera(first, second, what); !same) return same;
  if (first.exposure_s != second.exposure_s) {
    return differs(what, fmt::format("is exposed {} s", text_of(second.exposure_s)),
                   fmt::format("{} s", text_of(first.exposure_s)));
  }
  return {};
}

double mean_dn(const RawDn& raw) {
  const Rect& a = raw.active;
  const double sum = with_samples(raw, [&](const auto& dn) {
    double total = 0;
    for (int y = 0; y < a.height; ++y) {
      const auto* row = dn.row(a.y + y) + a.x;
      for (int x = 0; x < a.width; ++x) total += row[x];
    }
    return total;
  });
  return sum / (static_cast<double>(a.width) * a.height);
}

int channel_of_site(const FrameSetting& setting, int site) {
  if (setting.layout != SensorLayout::bayer) return 1;
  return static_cast<int>(colour_at(setting.phase, site & 1, site >> 1));
}

}  // namespace lowlux::calib
