#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "isp/base/plane.h"
#include "isp/base/result.h"

namespace lowlux::isp {

/// Describes an 8-bit video with chroma at half size, sited at the centre of 2 x 2 pixels (4:2:0, as in JPEG), in video
/// range (luma 16..235). Odd sizes have one more row or column of chroma.
struct Y4mFormat {
  int width = 0;
  int height = 0;
  double frame_rate_hz = 30;  // 0.001..1e6
};

/// Returns the first line of a YUV4MPEG2 stream (mjpegtools, yuv4mpeg(5)): progressive, square pixels, C420jpeg and the
/// comment XCOLORRANGE=LIMITED by which ffmpeg recognises the range. The frame rate is a fraction: an integer, over
/// 1001 for television rates, else over 1000.
std::string y4m_header(const Y4mFormat& format);

/// Writes a video to a file descriptor of the caller, which stays open. SIGPIPE must be ignored.
class Y4mWriter {
 public:
  Y4mWriter(int file, const Y4mFormat& format);

  enum class Written : std::uint8_t {
    whole,
    reader_left,  // the reader of the pipe has closed it: nothing more can be written
    interrupted   // `stop` was set and the reader read nothing for a second: the frame is incomplete
  };

  /// Writes one frame, and the header before the first one. Waits for the reader and checks `stop` while waiting.
  /// @param luma    height x width
  /// @param chroma  interleaved Cb and Cr, (height + 1) / 2 x 2 ((width + 1) / 2), as in NV12
  /// Errors: unwritable.
  Result<Written> write(PlaneView<const std::uint8_t> luma, PlaneView<const std::uint8_t> chroma,
                        const std::atomic<bool>& stop);

 private:
  Result<Written> write_all(const std::atomic<bool>& stop);

  int file_;
  std::size_t piece_bytes_;  // bytes that may be written at once without blocking
  Y4mFormat format_;
  std::vector<char> bytes_;
  bool begun_ = false;
};

}  // namespace lowlux::isp
