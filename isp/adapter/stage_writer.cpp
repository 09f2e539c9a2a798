#include "isp/adapter/stage_writer.h"

#include <cstring>

namespace lowlux::isp {

StageWriter::StageWriter(StageOutput kind, YuvStandard standard, int width, int height, int threads)
    : kind_(kind),
      matrix_(yuv_matrix(standard)),
      width_(width),
      height_(height),
      above_(
          std::make_unique<std::uint8_t[]>(3 * static_cast<std::size_t>(width) * static_cast<std::size_t>(threads))) {}

RowSink StageWriter::sink(const lowlux_stage_plane* planes) {
  planes_ = planes;
  return {[](void* context, int thread, int y, const std::uint8_t* rgb, int) {
            static_cast<StageWriter*>(context)->write(thread, y, rgb);
          },
          this};
}

std::uint8_t* StageWriter::row(int plane, int y) const {
  return static_cast<std::uint8_t*>(planes_[plane].data) + planes_[plane].stride * static_cast<std::size_t>(y);
}

void StageWriter::write(int thread, int y, const std::uint8_t* rgb) {
  switch (kind_) {
    case StageOutput::rgbx:
      rgbx_row(rgb, width_, row(0, y));
      return;
    case StageOutput::bgrx:
      bgrx_row(rgb, width_, row(0, y));
      return;
    case StageOutput::bgr:
      bgr_row(rgb, width_, row(0, y));
      return;
    case StageOutput::rgb:
      std::memcpy(row(0, y), rgb, 3 * static_cast<std::size_t>(width_));
      return;
    case StageOutput::nv12:
      break;
    case StageOutput::rgb48:
    case StageOutput::mosaic:
      return;  // have no rows of 8 bits
  }
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
