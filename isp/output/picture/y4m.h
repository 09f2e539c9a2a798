#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "isp/base/plane.h"
#include "isp/base/result.h"

namespace lowlux::isp {

/// A film of 8 bits with chroma at half size in the middle of 2 x 2 pixels (4:2:0, as JPEG has it), in video range
/// (luma 16..235). Odd sizes have one more row or column of chroma.
struct Y4mFormat {
  int width = 0;
  int height = 0;
  double frame_rate_hz = 30;  // 0.001..1e6
};

/// The first line of a YUV4MPEG2 stream (mjpegtools, yuv4mpeg(5)): progressive, square pixels, C420jpeg and the
/// comment XCOLORRANGE=LIMITED by which ffmpeg knows the range. The frame rate is a fraction: whole, of 1001 where it
/// is a television's, else of 1000.
std::string y4m_header(const Y4mFormat& format);

/// Writes a film to a file descriptor of the caller's, which stays open. SIGPIPE is to be ignored.
class Y4mWriter {
 public:
  Y4mWriter(int file, const Y4mFormat& format);

  enum class Written : std::uint8_t {
    whole,
    reader_left,  // of the pipe: nothing more can be written
    interrupted   // `stop` was set and the reader took nothing for a second: the frame is not whole
  };

  /// One frame, before the first the header. Waits for the reader, in `stop`'s sight.
  /// @param luma    height x width
  /// @param chroma  Cb and Cr by turns, (height + 1) / 2 x 2 ((width + 1) / 2), as NV12 has them
  /// Errors: unwritable.
  Result<Written> write(PlaneView<const std::uint8_t> luma, PlaneView<const std::uint8_t> chroma,
                        const std::atomic<bool>& stop);

 private:
  Result<Written> write_all(const std::atomic<bool>& stop);

  int file_;
  std::size_t piece_bytes_;  // that may be written at once without being held up
  Y4mFormat format_;
  std::vector<char> bytes_;
  bool begun_ = false;
};

}  // namespace lowlux::isp
