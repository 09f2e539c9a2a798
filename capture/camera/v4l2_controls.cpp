#include "capture/camera/v4l2_controls.h"

#include <linux/videodev2.h>

#include <algorithm>
#include <cmath>

namespace lowlux::capture {
namespace {

/// V4L2_CTRL_FLAG_MODIFY_LAYOUT of Linux 4.15; older headers lack it.
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
