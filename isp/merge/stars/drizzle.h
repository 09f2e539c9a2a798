#pragma once

#include <array>
#include <cstdint>

#include "isp/base/executor.h"
#include "isp/base/plane.h"
#include "isp/merge/frame.h"
#include "isp/merge/motion.h"

namespace lowlux::merge {

/// Holds the options of Drizzle.
struct DrizzleOptions {
  double scale = 1;    // 1..3: output pixels for each pixel of the reference, each way
  double pixfrac = 1;  // 0.05..1: side of a drop in pixels of the frame
};

/// States which places are used: those of block (x / block_px, y / block_px) if its value is not 0. Without a view,
/// all are.
struct AcceptedBlocks {
  PlaneView<const std::uint8_t> blocks;
  int block_px = 1;  // 1: one value for each pixel
};

/// Describes a frame that is drizzled.
struct DrizzleFrame {
  FrameView frame;
  const Motion& motion;       // from the reference to this frame
  PerSite<double> level_e{};  // light that the weight regards in addition to variance_e2: the background
  AcceptedBlocks accepted;    // by places of the reference, ceil(width / block_px) x ceil(height / block_px) at least
};

/// Counts the samples of one frame that lie within the output.
struct DrizzleCounts {
  std::int64_t used = 0;
  std::int64_t rejected = 0;  // not accepted
};

/// Holds the planes R, G, B of ceil(height * scale) x ceil(width * scale) pixels each. What is at (x, y) of the
/// reference is at ((x + 1/2) scale - 1/2, (y + 1/2) scale - 1/2).
struct DrizzleImage {
  int width = 0;
  int height = 0;
  std::array<Plane<float>, 3> rows;        // rows of values, weights and variances of each colour, side by side
  std::array<double, 3> empty_fraction{};  // pixels without data

  /// Returns electrons per pixel area of the reference; 0 without data.
  PlaneView<const float> value_e(int colour) const { return part(colour, 0); }
  /// Returns the sum over samples of part of the drop / variance [1/e^2]; 0: no data.
  PlaneView<const float> weight(int colour) const { return part(colour, 1); }
  /// Returns the variance of the values; 0 without data.
  PlaneView<const float> variance_e2(int colour) const { return part(colour, 2); }

 private:
  PlaneView<const float> part(int colour, int index) const {
    return rows[static_cast<std::size_t>(colour)].view().crop(index * width, 0, width, height);
  }
};

/// Combines mosaics that are displaced against each other into an image of three measured colours (drizzling:
/// Fruchter and Hook, PASP 114, 2002). Each sample y of colour c, its drop of pixfrac of its pixel placed on the output
/// by the motion, is added to the pixels of plane c that the drop covers:
///     value = sum a w y / A / sum a w,   variance = sum a^2 w^2 / A^2 (value + variance_e2) / (sum a w)^2,
/// a: part of the drop in the output pixel; w = 1 / (level + variance_e2); A: area of a pixel of this frame in pixels
/// of the reference. variance_e2 is the mean over the frames, by w^2: exact if they share it.
///
/// The drop is an axis-aligned square of the right area, whatever the rotation, and its overlap with output pixels
/// is exact. A square has the same second moments in all directions, so that the widths of stars grow as with rotated
/// drops; all parts add up to the drop.
/// Values of neighbouring pixels are correlated: see noise_correlation_ratio.
class Drizzle {
 public:
  /// @param width, height of the reference, at least 1
  Drizzle(int width, int height, const DrizzleOptions& options);

  /// Adds a frame. Output rows are divided among threads: the same bytes for any executor.
  DrizzleCounts add(const DrizzleFrame& frame, Executor& executor);

  /// Returns the image, which takes over the memory of the sums; afterwards nothing is left in this object.
  DrizzleImage finish(Executor& executor);

  /// Returns the memory [bytes] of the sums, whatever the number of frames: 36 for each output pixel. The image needs
  /// the same memory.
  static std::int64_t memory_bytes(int width, int height, const DrizzleOptions& options);

 private:
  struct Target;

  DrizzleOptions options_;
  int width_;
  int height_;
  std::array<Plane<float>, 3> sums_;         // sum a w y / A, sum a w and sum a^2 w^2 / A^2 of each output pixel
  std::array<double, 3> variance_sum_e2_{};  // sum of variance_e2 w^2
  std::array<double, 3> variance_weight_{};  // sum of w^2
};

/// Returns how many times the noise of means over many output pixels exceeds what the variance of the pixels states, as
/// if they were independent, for uniformly distributed drops (standard deviations; Fruchter and Hook 2002, Eq. 9, 10):
///     with r = pixfrac scale: r / (1 - 1 / (3 r)) for r >= 1, 1 / (1 - r / 3) below.
double noise_correlation_ratio(const DrizzleOptions& options);

}  // namespace lowlux::merge
