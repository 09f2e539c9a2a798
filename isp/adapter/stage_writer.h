#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>

#include "isp/adapter/lowlux_stage.h"
#include "isp/adapter/stage_formats.h"
#include "isp/raw/raw_to_rgb.h"
#include "isp/render/pixel_rows.h"

namespace lowlux::isp {

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
