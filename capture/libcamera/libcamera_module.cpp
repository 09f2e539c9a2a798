#include "capture/libcamera/libcamera_module.h"

#include <utility>

#include <libcamera/camera.h>
#include <libcamera/camera_manager.h>

#include "capture/camera/camera_request.h"
#include "capture/libcamera/libcamera_device.h"

namespace lowlux::capture {
namespace {

/// Returns the cameras without their formats, which need a configuration of each.
std::vector<CameraListing> names_of_cameras(const libcamera::CameraManager& manager) {
  std::vector<CameraListing> cameras;
  for (const auto& camera : manager.cameras()) {
    cameras.push_back({.id = camera->id(), .name = libcamera_name(*camera), .formats = {}});
  }
  return cameras;
}

Result<std::vector<CameraListing>> list_all() {
  const auto manager = libcamera_manager();
  if (!manager) return tl::make_unexpected(manager.error());
  std::vector<CameraListing> cameras = names_of_cameras(**manager);
  for (CameraListing& listing : cameras) {
    const auto camera = (*manager)->get(listing.id);
    if (camera) listing.formats = raw_stream_texts(offered_streams(raw_configuration(*camera).get()));
  }
  return cameras;
}

Result<std::unique_ptr<Camera>> open_one(const std::string& which, const CameraRequest& request) {
  if (const auto checked = check_camera_request(request); !checked) return tl::make_unexpected(checked.error());
  auto manager = libcamera_manager();
  if (!manager) return tl::make_unexpected(manager.error());
  const std::vector<CameraListing> cameras = names_of_cameras(**manager);
  const auto place = find_camera(cameras, which);
  if (!place) return tl::make_unexpected(place.error());
  auto camera = (*manager)->get(cameras[static_cast<std::size_t>(*place)].id);
  if (!camera) return fail(ErrorCode::not_found, "the camera is no longer available: was it unplugged?", which);

  OpenRequestDevice open{
      .completions = nullptr, .device = nullptr, .name = libcamera_name(*camera), .format = {}, .warnings = {}};
  auto device = std::make_unique<LibcameraDevice>(std::move(*manager), std::move(camera));
  if (const auto acquired = device->acquire(); !acquired) return tl::make_unexpected(acquired.error());
  const auto format = device->configure(request, open.warnings);
  if (!format) return tl::make_unexpected(format.error());
  const auto buffers = device->allocate(request, open.warnings);
  if (!buffers) return tl::make_unexpected(buffers.error());
  open.format = *format;
  open.buffers = *buffers;
  open.completions = device->completions();
  open.device = std::move(device);
  return std::make_unique<RequestCamera>(std::move(open));
}

template <class Work>
auto without_exceptions(const Work& work) noexcept -> decltype(work()) {
  try {
    return work();
  } catch (...) {
    return fail(ErrorCode::unreadable, "libcamera or lowlux ran out of memory");
  }
}

Result<std::vector<CameraListing>> list_cameras() noexcept { return without_exceptions(list_all); }

Result<std::unique_ptr<Camera>> open_camera(const std::string& which, const CameraRequest& request) noexcept {
  return without_exceptions([&] { return open_one(which, request); });
}

}  // namespace

const LibcameraModule* lowlux_libcamera_1() noexcept {
  static constexpr LibcameraModule functions{.list = list_cameras, .open = open_camera};
  return &functions;
}

}  // namespace lowlux::capture
