#include "capture/libcamera/libcamera_values.h"

#include <algorithm>

#include <libcamera/camera.h>
#include <libcamera/control_ids.h>
#include <libcamera/controls.h>
#include <libcamera/framebuffer.h>
#include <libcamera/version.h>

// All differences between libcamera's versions are in this file; all other code compiles with 0.0.3 to 0.7. Orientation
// replaced transform in 0.2.
#define LOWLUX_LIBCAMERA_HAS_ORIENTATION (LIBCAMERA_VERSION_MAJOR > 0 || LIBCAMERA_VERSION_MINOR >= 2)

namespace lowlux::capture {
namespace {

namespace controls = libcamera::controls;

/// FrameMetadata::FrameStartup, new in 0.6: older headers do not define it.
constexpr int frame_startup = libcamera::FrameMetadata::FrameCancelled + 1;

std::optional<double> number_of(const libcamera::ControlValue& value) {
  if (value.isArray()) return std::nullopt;
  if (value.type() == libcamera::ControlTypeInteger32) return value.get<std::int32_t>();
  if (value.type() == libcamera::ControlTypeInteger64) return static_cast<double>(value.get<std::int64_t>());
  if (value.type() == libcamera::ControlTypeFloat) return value.get<float>();
  return std::nullopt;
}

OfferedControl offered(const libcamera::ControlInfoMap& infos, const libcamera::ControlId& id) {
  const auto found = infos.find(id.id());
  if (found == infos.end()) return {};
  const auto least = number_of(found->second.min()), largest = number_of(found->second.max());
  OfferedControl control{.offered = true, .range = std::nullopt};
  if (least && largest && *least <= *largest) control.range = {*least, *largest};
  return control;
}

template <class T, std::size_t N, class List>
std::optional<std::array<T, N>> array_of(const List& list) {
  if (!list || list->size() != N) return std::nullopt;
  std::array<T, N> values{};
  std::copy(list->begin(), list->end(), values.begin());
  return values;
}

struct Flips {
  bool horizontal;
  bool vertical;
};

bool asks_for_flips(const CameraRequest& request) { return request.flip_horizontal || request.flip_vertical; }

Flips flips_of(const CameraRequest& request) {
  return {request.flip_horizontal.value_or(false), request.flip_vertical.value_or(false)};
}

#if LOWLUX_LIBCAMERA_HAS_ORIENTATION
libcamera::Orientation orientation_of(const Flips& flips) {
  if (flips.horizontal && flips.vertical) return libcamera::Orientation::Rotate180;
  if (flips.horizontal) return libcamera::Orientation::Rotate0Mirror;
  if (flips.vertical) return libcamera::Orientation::Rotate180Mirror;
  return libcamera::Orientation::Rotate0;
}
auto& orientation_in(libcamera::CameraConfiguration& configuration) { return configuration.orientation; }
const auto& orientation_in(const libcamera::CameraConfiguration& configuration) { return configuration.orientation; }
#else
libcamera::Transform orientation_of(const Flips& flips) {
  return (flips.horizontal ? libcamera::Transform::HFlip : libcamera::Transform::Identity) |
         (flips.vertical ? libcamera::Transform::VFlip : libcamera::Transform::Identity);
}
auto& orientation_in(libcamera::CameraConfiguration& configuration) { return configuration.transform; }
const auto& orientation_in(const libcamera::CameraConfiguration& configuration) { return configuration.transform; }
#endif

}  // namespace

LibcameraValues libcamera_values(const libcamera::ControlList& metadata) {
  LibcameraValues values;
  values.exposure_us = metadata.get(controls::ExposureTime);
  values.analogue_gain = metadata.get(controls::AnalogueGain);
  values.digital_gain = metadata.get(controls::DigitalGain);
  values.black_levels = array_of<std::int32_t, 4>(metadata.get(controls::SensorBlackLevels));
  values.colour_gains = array_of<float, 2>(metadata.get(controls::ColourGains));
  values.colour_matrix = array_of<float, 9>(metadata.get(controls::ColourCorrectionMatrix));
  values.colour_temperature_k = metadata.get(controls::ColourTemperature);
  values.lux = metadata.get(controls::Lux);
  values.temperature_c = metadata.get(controls::SensorTemperature);
  return values;
}

OfferedControls offered_controls(const libcamera::ControlInfoMap& infos) {
  return {.ae_enable = offered(infos, controls::AeEnable).offered,
          .exposure_us = offered(infos, controls::ExposureTime),
          .analogue_gain = offered(infos, controls::AnalogueGain),
          .frame_duration_us = offered(infos, controls::FrameDurationLimits)};
}

void add_controls(const StartControls& wanted, libcamera::ControlList& list) {
  if (wanted.ae_off) list.set(controls::AeEnable, false);
  if (wanted.exposure_us) list.set(controls::ExposureTime, *wanted.exposure_us);
  if (wanted.analogue_gain) list.set(controls::AnalogueGain, *wanted.analogue_gain);
  if (wanted.frame_duration_us) {
    const auto [shortest_us, longest_us] = *wanted.frame_duration_us;
    list.set(controls::FrameDurationLimits, {shortest_us, longest_us});
  }
}

void set_flips(const CameraRequest& request, libcamera::CameraConfiguration& configuration) {
  if (asks_for_flips(request)) orientation_in(configuration) = orientation_of(flips_of(request));
}

bool has_flips(const CameraRequest& request, const libcamera::CameraConfiguration& configuration) {
  return !asks_for_flips(request) || orientation_in(configuration) == orientation_of(flips_of(request));
}

CompletionState completion_state(int frame_status) {
  if (frame_status == libcamera::FrameMetadata::FrameSuccess) return CompletionState::filled;
  if (frame_status == libcamera::FrameMetadata::FrameCancelled) return CompletionState::cancelled;
  if (frame_status == frame_startup) return CompletionState::startup;
  return CompletionState::damaged;
}

}  // namespace lowlux::capture
