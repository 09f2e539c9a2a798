#pragma once

#include <array>

#include "capture/synthetic/rigid_motion.h"
#include "isp/base/executor.h"
#include "isp/base/image.h"
#include "isp/base/plane.h"

namespace lowlux::capture {

/// Light of a scene that continues between its samples, as pixels of the sensor integrate it at any position.
/// The lens turns every sample into a cubic B-spline of the samples' pitch, and a pixel averages over a square of
/// `reduction` samples:
///     light(u) = sum_k s_k beta3(u - k),  value(x) = mean of light over the samples of pixel x
/// on each axis, evaluated in closed form: a cubic B-spline averaged over whole samples is a sum of quartic B-splines.
/// The modulation transfer at f cycles per pixel is sinc(f) sinc(f / reduction)^4 on each axis, for every position.
/// Values never fall below the smallest sample nor exceed the largest one, and constants are kept. The square stays
/// parallel to the axes of the scene where a frame is rotated.
class LightGrid {
 public:
  /// @param samples   at least one row and column; borrowed for the call
  /// @param reduction samples for each pixel and axis, 1..8
  /// @param top_px    row of the image at which the first row of samples lies
  LightGrid(const RgbView<const float>& samples, int reduction, int top_px, Executor& executor);

  /// Returns the mean of one channel over the pixel whose centre is at a position of frame 0. Outside of the samples
  /// the scene is mirrored.
  float at(int channel, ImagePoint centre) const;

 private:
  /// One axis: pixel x covers the samples reduction x to reduction x + reduction - 1, which are mirrored at the outer
  /// edges of the first and the last one. Stored are means of `reduction` samples in succession, as far as they differ.
  struct Axis {
    int samples;
    int reduction;
    int first;   // mean m is that of the samples m - reduction + 1 to m; this one is stored first
    int stored;  // number of stored means

    Axis(int samples, int reduction);
    /// Returns the samples in the stored mean `index`: sample(index, i) for i in 0..reduction - 1.
    int sample(int index, int i) const;
  };
  struct Taps;
  static Taps taps(const Axis& axis, double position_px);

  Axis columns_;
  Axis rows_;
  double top_px_;
  std::array<Plane<float>, 3> means_;  // rows x columns of stored means
};

}  // namespace lowlux::capture
