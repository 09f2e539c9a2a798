#include "capture/v4l2/v4l2_source.h"

#include <utility>

#include "capture/file/pass_on.h"
#include "capture/v4l2/v4l2_camera.h"
#include "capture/v4l2/v4l2_exposure.h"
#include "capture/v4l2/v4l2_negotiation.h"
#include "isp/base/text.h"

namespace lowlux::capture {
namespace {

Result<void> check_range(const std::optional<double>& value, double least, double most, const char* what) {
  if (!value || (*value >= least && *value <= most)) return {};
  return fail(ErrorCode::invalid_argument, std::string(what) + " of " + number_text(*value) + ", expected " +
                                               number_text(least) + " to " + number_text(most));
}

Result<void> check_request(const V4l2Options& options) {
  const CameraRequest& request = options.request;
  if (request.width.has_value() != request.height.has_value()) {
    return fail(ErrorCode::invalid_argument, "a size needs both width and height");
  }
  if (auto ok = check_range(request.width, 1, 65536, "a width"); !ok) return ok;
  if (auto ok = check_range(request.height, 1, 65536, "a height"); !ok) return ok;
  if (auto ok = check_range(request.buffers, 2, 32, "a number of buffers"); !ok) return ok;
  if (auto ok = check_range(request.frame_rate_hz, 1e-3, 1e5, "a frame rate [Hz]"); !ok) return ok;
  if (auto ok = check_range(request.exposure_s, 1e-7, 1e5, "an exposure time [s]"); !ok) return ok;
  if (auto ok = check_range(request.analogue_gain, 1, 1e4, "an analogue gain"); !ok) return ok;
  if (request.analogue_gain && options.gain_code) {
    return fail(ErrorCode::invalid_argument, "a gain is given both as a factor and as a code: give only one");
  }
  return {};
}

/// Warns of flips for which the driver does not state whether they change the order of the mosaic.
void warn_of_order(const std::vector<std::string>& flips, const CameraFormat& format,
                   std::vector<std::string>& warnings) {
  if (format.raw.layout != SensorLayout::bayer) return;
  for (const std::string& flip : flips) {
    warnings.push_back(
        "the driver does not state that its " + flip +
        " changes the order of the mosaic: the order of its format is used; if colours are wrong, do not use the flip");
  }
}

}  // namespace

Result<std::unique_ptr<Camera>> open_v4l2(const std::string& device, const V4l2Options& options,
                                          const V4l2System& system) {
  if (auto ok = check_request(options); !ok) {
    ok.error().where = device;
    return pass_on(ok);
  }
  auto opened = V4l2Device::open(system, device);
  if (!opened) return pass_on(opened);
  V4l2Device& node = **opened;

  std::vector<std::string> warnings;
  const std::vector<std::string> silent_flips = apply_flips(node, options.request, warnings);
  auto agreement = negotiate(node, options.request);
  if (!agreement) return pass_on(agreement);
  warnings.insert(warnings.end(), agreement->warnings.begin(), agreement->warnings.end());
  warn_of_order(silent_flips, agreement->format, warnings);
  apply_frame_rate(node, options.request, agreement->format, warnings);
  if (auto ok = apply_exposure(node, options, agreement->format, warnings); !ok) return pass_on(ok);
  // Refused settings are warnings; that the device has vanished is an error.
  if (node.gone()) return tl::make_unexpected(node.disconnected_error());
  agreement->warnings = std::move(warnings);
  return std::make_unique<V4l2Camera>(*std::move(opened), *std::move(agreement), options);
}

std::vector<CameraListing> list_v4l2_cameras(const V4l2System& system) {
  std::vector<CameraListing> out;
  for (const std::string& path : system.devices(system.context)) {
    auto device = V4l2Device::open(system, path);
    if (device) {
      out.push_back({.id = path, .name = (*device)->name(), .formats = raw_offers_text(**device)});
    } else if (device.error().code == ErrorCode::unreadable) {
      out.push_back({.id = path, .name = device.error().message, .formats = {}});
    }
  }
  return out;
}

}  // namespace lowlux::capture
