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

/// What a driver says a buffer holds, single- and multi-planar alike. Nothing of it is checked.
struct V4l2Layout {
  std::uint32_t fourcc = 0;
  std::uint32_t width = 0;
  std::uint32_t height = 0;
  std::uint32_t stride_bytes = 0;
  std::uint32_t buffer_bytes = 0;
  std::uint32_t field = 0;   // V4L2_FIELD_...
  std::uint32_t planes = 1;  // of memory
  friend bool operator==(const V4l2Layout&, const V4l2Layout&) = default;
};

/// The layout in force (VIDIOC_G_FMT).
Result<V4l2Layout> read_layout(V4l2Device& device);
/// Asks for a format and size, progressive, with strides as the driver likes them (VIDIOC_S_FMT). What comes back is
/// what the driver made of it: it may be anything.
Result<V4l2Layout> set_layout(V4l2Device& device, std::uint32_t fourcc, std::uint32_t width, std::uint32_t height);

struct V4l2Size {
  std::uint32_t width = 0;
  std::uint32_t height = 0;
};

/// Sizes of one format: single ones, or all from the first to the last where `range`; none where the driver lists none.
struct V4l2Sizes {
  std::vector<V4l2Size> sizes;
  bool range = false;
};
V4l2Sizes list_sizes(V4l2Device& device, std::uint32_t fourcc);

/// One format that the driver lists.
struct V4l2Offer {
  std::uint32_t fourcc = 0;
  std::optional<RawFormat> raw;  // absent: none that lowlux unpacks
};
std::vector<V4l2Offer> list_offers(V4l2Device& device);

/// libcamera's name of a raw format ("SRGGB10_CSI2P"), else the four characters ("YUYV").
std::string format_text(std::uint32_t fourcc);
/// "640x480 1280x720", "16x16 to 4096x4096", or "" where nothing is known.
std::string sizes_text(const V4l2Sizes& sizes);
/// "SRGGB10 640x480 1280x720" for each raw format.
std::vector<std::string> raw_offers_text(V4l2Device& device);

struct V4l2Agreement {
  CameraFormat format;
  V4l2Layout layout;                  // as the driver gave it; checked
  std::vector<std::string> warnings;  // what differs from what was to be expected
};

/// Sets format and size. What was asked for is had exactly or is an error that names what the driver offers. A format
/// that was not asked for is the deepest Bayer one, else the deepest monochrome one; a size, the largest listed. Where
/// the driver lists a range of sizes or none, the size in force is kept, and where the media controller has the say
/// also a raw format. The frame rate is left alone.
/// Errors: no such raw format or size (unsupported), a driver that contradicts itself (malformed), more than 2 GiB for
/// all buffers (too_large), and those of the device.
Result<V4l2Agreement> negotiate(V4l2Device& device, const CameraRequest& request);

/// Memory of all buffers of a camera [bytes] at most.
inline constexpr std::size_t most_buffer_bytes = std::size_t{2} << 30;

}  // namespace lowlux::capture
