#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>

#include "isp/adapter/lowlux_stage.h"
#include "isp/base/frame.h"
#include "isp/base/packed/raw_format.h"
#include "isp/raw/kernel/raw_to_rgb.h"
#include "isp/render/pixel_rows.h"

namespace lowlux::isp {

/// Lists the outputs of the stage.
enum class StageOutput : std::uint8_t { rgbx, bgrx, rgb, bgr, nv12, rgb48, mosaic };

/// Returns the output of a four-character code; nullopt for an unknown code.
std::optional<StageOutput> stage_output(std::uint32_t fourcc);

/// Returns the format for a code of one of the two APIs; nullopt for an unknown code.
std::optional<RawFormat> stage_input(std::int32_t api, std::uint32_t fourcc, std::uint64_t modifier);

/// Fills in the answer of lowlux_stage_query, except its size.
void describe(const RawFormat& format, lowlux_stage_format_info& info);

/// Fills in planes, strides that are 0 or too small, and bytes. @return whether a requested value (not 0) was changed
bool lay_out(StageOutput kind, int width, int height, lowlux_stage_output& out);

/// Both functions measure a plane: the bytes of a row, and the number of rows.
std::size_t plane_row_bytes(StageOutput kind, int width, int plane);
int plane_rows(StageOutput kind, int height, int plane);
int planes_of(StageOutput kind);

/// Returns an image of R, G and B of 8 bits in the memory of a plane.
/// @param kind  rgbx, bgrx, rgb or bgr
PixelView pixels_in(const lowlux_stage_plane& plane, StageOutput kind, int width, int height);

/// Converts rows of R, G and B to NV12. Allocates its memory in the constructor.
class Nv12Writer {
 public:
  /// Makes a writer for images of one size.
  Nv12Writer(YuvStandard standard, int width, int height, int threads);

  /// Returns a sink for one image; `planes` must outlive it.
  RowSink sink(const lowlux_stage_plane* planes);

 private:
  void write(int thread, int y, const std::uint8_t* rgb);
  std::uint8_t* row(int plane, int y) const;

  YuvMatrix matrix_;
  int width_, height_;
  std::unique_ptr<std::uint8_t[]> above_;  // last even row of each thread
  const lowlux_stage_plane* planes_ = nullptr;
};

}  // namespace lowlux::isp
