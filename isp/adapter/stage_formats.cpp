#include "isp/adapter/stage_formats.h"

#include <algorithm>
#include <array>
#include <cstring>

namespace lowlux::isp {
namespace {

constexpr std::array<std::uint32_t, 7> pictures{LOWLUX_STAGE_XBGR8888, LOWLUX_STAGE_XRGB8888, LOWLUX_STAGE_BGR888,
                                                LOWLUX_STAGE_RGB888,   LOWLUX_STAGE_NV12,     LOWLUX_STAGE_RGB48,
                                                LOWLUX_STAGE_BAYER16};
constexpr std::array kinds{StageOutput::rgbx, StageOutput::bgrx,  StageOutput::rgb,   StageOutput::bgr,
                           StageOutput::nv12, StageOutput::rgb48, StageOutput::mosaic};

}  // namespace

std::optional<StageOutput> stage_output(std::uint32_t fourcc) {
  const auto* const found = std::ranges::find(pictures, fourcc);
  if (found == pictures.end()) return std::nullopt;
  return kinds[static_cast<std::size_t>(found - pictures.begin())];
}

std::optional<RawFormat> stage_input(std::int32_t api, std::uint32_t fourcc, std::uint64_t modifier) {
  if (api == LOWLUX_STAGE_DRM) return raw_format_of_drm(fourcc, modifier);
  if (api == LOWLUX_STAGE_V4L2) return raw_format_of_v4l2(fourcc);
  return std::nullopt;
}

void describe(const RawFormat& format, lowlux_stage_format_info& info) {
  const RawGroup group = group_of(format);
  const bool mosaic = format.layout == SensorLayout::bayer;
  info.bits = format.bits;
  info.packed = group.pixels > 1 ? 1 : 0;
  info.mosaic = mosaic ? static_cast<std::int32_t>(format.phase) : -1;
  info.group_pixels = group.pixels;
  info.group_bytes = group.bytes;
  info.alignment = 1;
  info.margin = 0;
  info.outputs = 0;
  for (const std::uint32_t fourcc : pictures) {
    if (mosaic || fourcc != LOWLUX_STAGE_BAYER16) info.output[info.outputs++] = fourcc;
  }
}

int planes_of(StageOutput kind) { return kind == StageOutput::nv12 ? 2 : 1; }

std::size_t plane_row_bytes(StageOutput kind, int width, int plane) {
  const auto pixels = static_cast<std::size_t>(width);
  switch (kind) {
    case StageOutput::rgbx:
    case StageOutput::bgrx:
      return 4 * pixels;
    case StageOutput::rgb:
    case StageOutput::bgr:
      return 3 * pixels;
    case StageOutput::nv12:
      return plane == 0 ? pixels : 2 * ((pixels + 1) / 2);
    case StageOutput::rgb48:
      return 6 * pixels;
    case StageOutput::mosaic:
      break;
  }
  return 2 * pixels;
}

int plane_rows(StageOutput kind, int height, int plane) {
  return kind == StageOutput::nv12 && plane == 1 ? (height + 1) / 2 : height;
}

bool lay_out(StageOutput kind, int width, int height, lowlux_stage_output& out) {
  const auto differs = [](std::int32_t asked, std::int32_t had) { return asked != 0 && asked != had; };
  bool adjusted = differs(out.width, width) || differs(out.height, height) || differs(out.planes, planes_of(kind));
  out.width = width;
  out.height = height;
  out.planes = planes_of(kind);
  for (int plane = 0; plane < LOWLUX_STAGE_MAX_PLANES; ++plane) {
    if (plane >= out.planes) {
      out.stride[plane] = out.bytes[plane] = 0;
      continue;
    }
    const std::size_t row = plane_row_bytes(kind, width, plane);
    const bool wide = kind == StageOutput::rgb48 || kind == StageOutput::mosaic;
    std::size_t& stride = out.stride[plane];
    const bool usable = stride >= row && stride <= (std::size_t{1} << 24) && !(wide && stride % 2 != 0);
    adjusted = adjusted || (stride != 0 && !usable);
    if (!usable) stride = row;
    out.bytes[plane] = stride * static_cast<std::size_t>(plane_rows(kind, height, plane) - 1) + row;
  }
  return adjusted;
}

PixelView pixels_in(const lowlux_stage_plane& plane, StageOutput kind, int width, int height) {
  return {.data = static_cast<std::uint8_t*>(plane.data),
          .width = width,
          .height = height,
          .stride_bytes = static_cast<std::ptrdiff_t>(plane.stride),
          .pixel_bytes = kind == StageOutput::rgbx || kind == StageOutput::bgrx ? 4 : 3,
          .is_bgr = kind == StageOutput::bgrx || kind == StageOutput::bgr};
}

Nv12Writer::Nv12Writer(YuvStandard standard, int width, int height, int threads)
    : matrix_(yuv_matrix(standard)),
      width_(width),
      height_(height),
      above_(
          std::make_unique<std::uint8_t[]>(3 * static_cast<std::size_t>(width) * static_cast<std::size_t>(threads))) {}

RowSink Nv12Writer::sink(const lowlux_stage_plane* planes) {
  planes_ = planes;
  return {[](void* context, int thread, int y, const std::uint8_t* rgb, int) {
            static_cast<Nv12Writer*>(context)->write(thread, y, rgb);
          },
          this};
}

std::uint8_t* Nv12Writer::row(int plane, int y) const {
  return static_cast<std::uint8_t*>(planes_[plane].data) + planes_[plane].stride * static_cast<std::size_t>(y);
}

void Nv12Writer::write(int thread, int y, const std::uint8_t* rgb) {
  luma_row(matrix_, rgb, width_, row(0, y));
  const std::size_t bytes = 3 * static_cast<std::size_t>(width_);
  std::uint8_t* const above = above_.get() + bytes * static_cast<std::size_t>(thread);
  if ((y & 1) != 0) {
    chroma_row(matrix_, above, rgb, width_, row(1, y / 2));  // NOLINT(readability-suspicious-call-argument)
  } else if (y + 1 == height_) {
    chroma_row(matrix_, rgb, rgb, width_, row(1, y / 2));
  } else {
    std::memcpy(above, rgb, bytes);
  }
}

}  // namespace lowlux::isp
