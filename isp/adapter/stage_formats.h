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

/// What a picture is made of.
enum class StageOutput : std::uint8_t { rgbx, bgrx, rgb, bgr, nv12, rgb48, mosaic };

/// By its four-character code; nullopt for another.
std::optional<StageOutput> stage_output(std::uint32_t fourcc);

/// By one of the two ways to name raw formats; nullopt where none is known.
std::optional<RawFormat> stage_input(std::int32_t api, std::uint32_t fourcc, std::uint64_t modifier);

/// What lowlux_stage_query answers, its size aside.
void describe(const RawFormat& format, lowlux_stage_format_info& info);

/// Fills in planes, strides that are 0 or too small, and bytes. @return whether something that was asked for (not 0) is
/// not had
bool lay_out(StageOutput kind, int width, int height, lowlux_stage_output& out);

/// Bytes of a row of a plane, and rows of it.
std::size_t plane_row_bytes(StageOutput kind, int width, int plane);
int plane_rows(StageOutput kind, int height, int plane);
int planes_of(StageOutput kind);

/// Rows of 8-bit codes as one of the stage's outputs. Takes its memory in the constructor.
class StageWriter {
 public:
  /// @param kind  of 8 bits
  StageWriter(StageOutput kind, YuvStandard standard, int width, int height, int threads);

  /// A sink for one picture; `planes` must outlive it.
  RowSink sink(const lowlux_stage_plane* planes);

 private:
  void write(int thread, int y, const std::uint8_t* rgb);
  std::uint8_t* row(int plane, int y) const;

  StageOutput kind_;
  YuvMatrix matrix_;
  int width_, height_;
  std::unique_ptr<std::uint8_t[]> above_;  // each thread's last even row
  const lowlux_stage_plane* planes_ = nullptr;
};

}  // namespace lowlux::isp
