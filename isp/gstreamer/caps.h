#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>

#include <gst/video/video.h>

#include "isp/adapter/lowlux_stage.h"

namespace lowlux::gst {

/// Describes the frames of video/x-bayer caps, or of monochrome video/x-raw caps.
struct InputCaps {
  std::uint32_t fourcc = 0;  // V4L2's
  int bits = 0;
  bool is_mosaic = true;  // false: monochrome
  int width = 0;
  int height = 0;
  std::size_t row_bytes = 0;  // bytes of the samples of a row
  std::size_t stride = 0;     // GStreamer's of such frames: rows are padded to 4 pixels as bayer2rgb has it, monochrome
                              // ones to 4 bytes

  /// Returns the stride of a frame without metadata. Sources hand on the rows of drivers, which are padded to 4 bytes
  /// or not at all: frames of exactly that size have them.
  std::size_t stride_of(std::size_t bytes) const;
};

/// Describes the frames of the source pad: pictures, or mosaics of 16 bits.
struct OutputCaps {
  std::uint32_t fourcc = 0;  // format code of lowlux_stage.h
  GstVideoInfo picture{};    // format of images
  std::size_t stride = 0;    // stride of mosaics, in bytes
  int width = 0;
  int height = 0;

  bool is_mosaic() const { return fourcc == LOWLUX_STAGE_BAYER16; }
  std::size_t bytes() const { return is_mosaic() ? stride * static_cast<std::size_t>(height) : picture.size; }
};

/// Returns what the sink pad accepts: mosaics of 8 to 16 bits, GRAY8 and GRAY16_LE. The caller owns the caps.
GstCaps* sink_template();
/// Returns what the source pad offers: RGBx, BGRx, RGB, BGR, NV12, and mosaics of 16 bits. The caller owns the caps.
GstCaps* source_template();

/// Returns the caps of the other pad that go with these: the same size, rate and pixels; of mosaics the same order of
/// colours; of monochrome frames images only. The caller owns the caps.
GstCaps* other_caps(GstPadDirection direction, const GstCaps* caps);

/// Returns what fixed caps describe; nullopt if they are not such caps, or not of a size of 2 to 65,535 pixels each
/// way.
std::optional<InputCaps> read_input_caps(const GstCaps* caps);
std::optional<OutputCaps> read_output_caps(const GstCaps* caps);

}  // namespace lowlux::gst
