#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "isp/base/executor.h"
#include "isp/base/frame.h"
#include "isp/base/image.h"

namespace lowlux::isp {

/// Represents a frame as means over square blocks, for decisions based on the entire image.
struct Thumbnail {
  CameraRgb mean;  // block means, fraction of white, signed, not white balanced; at most 256 x 256. A colour without a
                   // pixel in a block at an odd edge takes the value of the preceding block
  /// Fraction of the samples of each block that are at white or above. Blocks of live frames are not examined: 0.
  Plane<float> clipped;
  double black_noise_std = 0;  // noise of one raw pixel without light, fraction of white; 0 if unknown
  double light_range = 1;      // from black to white, where `mean` is 1, fraction of the range from pedestal to white:
                               // below 1 where dark charge is known to fill part of it
};

/// Accumulates the sums of a thumbnail row by row, while a frame is being read. It reserves its memory in the
/// constructor and allocates nothing later.
class ThumbnailSums {
 public:
  /// Prepares for active areas of the size of `raw`'s, in its layout; only layout, active area and white level of `raw`
  /// are read.
  explicit ThumbnailSums(const RawDn& raw);

  /// Returns the rows of one block; a multiple of them starts with row 0.
  int block() const { return block_; }
  int block_rows() const { return rows_; }
  void clear();
  /// Adds row y of the active area, samples interleaved. Rows of one block of rows come from one thread.
  void add_row(const std::uint16_t* dn, int y);
  void add_row(const float* dn, int y);
  /// Adds a complete block of rows of a mosaic at once, from sums of its columns, separate for even and odd rows. It
  /// does not contribute to the noise estimate.
  /// @param rows  rows in the block: block() except in the last
  void add_columns(const std::array<const std::uint32_t*, 2>& columns, int block_row, int rows);
  PerSite<std::uint64_t> sums() const;  // sums of all codes of a mosaic
  /// Makes `out` from the sums and resizes it if needed. `frame` has the format of the constructor's `raw`.
  void make(const RawFrame& frame, const BlackPoint& black, Thumbnail& out);

 private:
  struct Block {
    std::array<double, 4> sum{};  // per colour sample: site of a Bayer cell, or R, G, B of linear_rgb; exact of codes
    std::array<std::int64_t, 4> n{};
    std::int64_t clipped = 0;
    double difference = 0;
    std::int64_t differences = 0;
  };
  template <class Sample>
  void add_samples(const Sample* dn, int y, Sample white);
  template <class Sample>
  static void add_mosaic(const Sample* dn, int width, int y, Sample white, Block& block);
  template <class Sample>
  void add_rgb(const Sample* dn, int width, Block& block) const;
  double black_noise(const RawFrame& frame, const BlackPoint& black);
  static std::array<double, 3> colour_means(const RawDn& raw, const BlackPoint& black, const PerSite<double>& per_dn,
                                            const Block& block, const std::array<double, 3>& beside);

  int block_ = 2;    // side in pixels, even
  int samples_ = 1;  // per pixel
  int width_ = 0;    // width of the active area
  int columns_ = 0;
  int rows_ = 0;
  std::array<double, 3> white_dn_{};
  std::vector<Block> blocks_;
  std::vector<double> differences_dn_;
};

/// Computes block means of the active area, saturated samples included. One thread sums each block, so any thread count
/// gives the same. The noise of black pixels is measured on masked pixels, else sqrt(NoiseProfile offset), else
/// estimated as the lowest twentieth of the blocks' mean absolute difference of same-colour neighbours (times sqrt(pi)
/// / 2, for a normal distribution); blocks with clipped samples or without any difference do not count. Gain maps are
/// not applied: exposure and white balance do not need them.
Thumbnail make_thumbnail(const RawFrame& frame, const BlackPoint& black, Executor& executor);

}  // namespace lowlux::isp
