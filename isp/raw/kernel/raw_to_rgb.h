#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>

#include "isp/base/executor.h"
#include "isp/base/image.h"
#include "isp/base/look_grid.h"
#include "isp/base/plane.h"
#include "isp/base/tone_table.h"
#include "isp/raw/kernel/rgb_input.h"

namespace lowlux::isp {

/// Converts white-balanced camera RGB c to the output's primaries, 0..1 being the display range:
///     out = matrix * min(c, clip)
/// and then, on request, moves it along its line to neutral until all channels are in 0..1. Colours below black move
/// first and keep their luminance Y, so that noise does not brighten the dark: Y <= 0 gives black, else
///     out' = Y + t (out - Y), t = Y / (Y - min(out)) where min(out) < 0.
/// Of colours brighter than the display the greatest channel becomes 1 and the least stays, if it is not above 1 too:
///     out'' = m + s (out' - m), m = min(out', 1), s = (1 - m) / (max(out') - m) where max(out') > 1.
/// Such a colour turns white as its least channel comes to 1, not as its luminance does.
struct RgbTransform {
  std::array<float, 9> matrix{1, 0, 0, 0, 1, 0, 0, 0, 1};  // rows; exposure included
  std::array<float, 3> luminance{};  // weights of Y, >= 0, sum 1; only read when colours are moved into the gamut
  float clip = 1;                    // 1 makes clipped highlights neutral; +infinity keeps all
  bool move_into_gamut = true;       // false: encoders clamp each channel, linear() leaves values as they are
  const LookGrid* look = nullptr;    // if set, changes `out` before it is moved into the gamut
};

/// Changes display codes before they are stored: each call converts one row of interleaved 16-bit codes, as rgb16 makes
/// them, to the codes written. It is called from several threads at once.
struct CodeChange {
  void (*to8)(const void* context, const std::uint16_t* rgb, int width, std::uint8_t* out) = nullptr;
  void (*to16)(const void* context, const std::uint16_t* rgb, int width, std::uint16_t* out) = nullptr;
  const void* context = nullptr;
};

/// Receives rows of interleaved 8-bit codes R G B as they are made. A thread's rows come in rising order and without
/// gaps, from an even one on; it is called from several threads at once, each for rows of its own. It must not throw.
struct RowSink {
  void (*row)(void* context, int thread, int y, const std::uint8_t* rgb, int width) = nullptr;
  void* context = nullptr;
};

/// Borrows an image of interleaved 8-bit codes in the caller's memory: pixels of 3 bytes, or of 4 with 255 in the last.
struct PixelView {
  std::uint8_t* data = nullptr;
  int width = 0;
  int height = 0;
  std::ptrdiff_t stride_bytes = 0;
  int pixel_bytes = 3;
  bool is_bgr = false;  // B G R in place of R G B

  std::uint8_t* row(int y) const { return data + stride_bytes * y; }
};

struct BandScratch;

/// Converts a mosaic or camera RGB to an image in one pass over row bands: Malvar-He-Cutler demosaic (ICASSP 2004, the
/// 5x5 filters of its figure 2; borders mirrored without repeating the edge), RgbTransform, tone.
///
/// It owns its scratch memory, allocates only in the constructor, and processes one frame at a time. The result does
/// not depend on the number of threads. Every coefficient and level that is not finite, or beyond +-1e9, counts as 0.
class RawToRgb {
 public:
  /// Prepares for images up to `max_width` pixels wide, and up to `threads` of an executor's threads.
  RawToRgb(int max_width, int threads);
  /// Returns the memory [bytes] that one instance takes.
  static std::size_t bytes(int max_width, int threads);

  /// Makes interleaved display codes: `out` is height x 3 width. The tone table must reach its last bin at 1.
  /// @param change  applied to the codes, row by row; null: none
  void rgb8(const RgbInput& in, const RgbTransform& transform, const ToneTable& tone, PlaneView<std::uint8_t> out,
            Executor& executor, const CodeChange* change = nullptr);
  /// Writes the codes of rgb8 in another order of bytes.
  void pixels8(const RgbInput& in, const RgbTransform& transform, const ToneTable& tone, const PixelView& out,
               Executor& executor);
  /// Makes 16-bit codes round(65535 tone), linear between the edges of a bin.
  void rgb16(const RgbInput& in, const RgbTransform& transform, const ToneTable& tone, PlaneView<std::uint16_t> out,
             Executor& executor, const CodeChange* change = nullptr);
  /// Passes the codes of rgb8 row by row to a sink; `thread` is below the number of threads.
  void rows8(const RgbInput& in, const RgbTransform& transform, const ToneTable& tone, const RowSink& sink,
             Executor& executor);
  /// Makes planar float values without applying a tone curve.
  void linear(const RgbInput& in, const RgbTransform& transform, RgbView<float> out, Executor& executor);

  /// Writes R, (G1 + G2) / 2 and B of each complete 2x2 cell: `out` is floor(height / 2) x floor(width / 2).
  void bin2x2(const DnMosaic& in, RgbView<float> out, Executor& executor);
  void bin2x2(const SignedMosaic& in, RgbView<float> out, Executor& executor);

  /// Writes the mean camera RGB, gains applied, of each block of 4 x 4 pixels, mirrored at the image's borders: `out`
  /// is ceil(height / 4) x ceil(width / 4).
  void quarter(const RgbInput& in, RgbView<float> out, Executor& executor);

 private:
  template <class Mosaic>
  void bin(const Mosaic& in, RgbView<float> out, Executor& executor);
  BandScratch scratch_of(int thread) const;
  template <class MakeSink>
  void convert(const RgbInput& in, const RgbTransform& transform, const MakeSink& make_sink, Executor& executor);
  template <class Codes, class Code>
  void to_codes(const RgbInput& in, const RgbTransform& transform, const ToneTable& tone, PlaneView<Code> out,
                Executor& executor, const CodeChange* change);

  int threads_;
  int max_width_;
  std::unique_ptr<std::byte[]> memory_;  // scratch of all threads
};

/// Returns the vector instruction set the kernels use on this machine, as Highway names it.
const char* raw_to_rgb_target();

/// Returns whether this processor has what the kernels need at least: SSSE3 on x86; always true elsewhere.
bool cpu_runs_raw_to_rgb();

}  // namespace lowlux::isp
