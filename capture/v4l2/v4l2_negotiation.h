#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "capture/camera/camera.h"
#include "capture/v4l2/v4l2_device.h"
#include "isp/base/packed/raw_format.h"

namespace lowlux::capture {

/// Layout of a buffer as a driver reports it, single- and multi-planar alike. It is not checked.
struct V4l2Layout {
  std::uint32_t fourcc = 0;
  std::uint32_t width = 0;
  std::uint32_t height = 0;
  std::uint32_t stride_bytes = 0;
  std::uint32_t buffer_bytes = 0;
  std::uint32_t field = 0;   // V4L2_FIELD_...
  std::uint32_t planes = 1;  // number of memory planes
  friend bool operator==(const V4l2Layout&, const V4l2Layout&) = default;
};

/// Returns the current layout (VIDIOC_G_FMT).
Result<V4l2Layout> read_layout(V4l2Device& device);
/// Requests a format and size, progressive, with strides chosen by the driver (VIDIOC_S_FMT). Returns the driver's
/// response, which may differ in every respect.
Result<V4l2Layout> set_layout(V4l2Device& device, std::uint32_t fourcc, std::uint32_t width, std::uint32_t height);

/// Holds the size of a frame in pixels.
struct V4l2Size {
  std::uint32_t width = 0;
  std::uint32_t height = 0;
};

/// Sizes of one format: single ones, or all from the first to the last if `range`; empty if the driver lists none.
struct V4l2Sizes {
  std::vector<V4l2Size> sizes;
  bool range = false;
};
V4l2Sizes list_sizes(V4l2Device& device, std::uint32_t fourcc);

/// One format that the driver lists.
struct V4l2Offer {
  std::uint32_t fourcc = 0;
  std::optional<RawFormat> raw;  // absent: not a format that lowlux unpacks
};
std::vector<V4l2Offer> list_offers(V4l2Device& device);

/// Returns libcamera's name of a raw format ("SRGGB10_CSI2P"), else the four characters ("YUYV").
std::string format_text(std::uint32_t fourcc);
/// Returns "640x480 1280x720", "16x16 to 4096x4096", or "" if nothing is known.
std::string sizes_text(const V4l2Sizes& sizes);
/// Returns "SRGGB10 640x480 1280x720" for each raw format.
std::vector<std::string> raw_offers_text(V4l2Device& device);

/// Holds the format and the layout on which lowlux and the driver agreed.
struct V4l2Agreement {
  CameraFormat format;
  V4l2Layout layout;                  // layout that the driver reported; checked
  std::vector<std::string> warnings;  // deviations from the expected layout
};

/// Sets format and size. A requested value is set exactly, or there is an error that names what the driver offers. A
/// format that was not requested is the deepest Bayer one, else the deepest monochrome one; a size, the largest listed.
/// If the driver lists a range of sizes or none, the current size is kept, and under control of the media controller
/// also a raw format. The frame rate is left unchanged.
/// Errors: no such raw format or size (unsupported), a driver that contradicts itself (malformed), more than 2 GiB for
/// all buffers (too_large), and those of the device.
Result<V4l2Agreement> negotiate(V4l2Device& device, const CameraRequest& request);

/// Maximum memory of all buffers of a camera [bytes].
inline constexpr std::size_t max_buffer_bytes = std::size_t{2} << 30;

}  // namespace lowlux::capture
