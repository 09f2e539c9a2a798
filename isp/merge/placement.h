#pragma once

#include <array>
#include <vector>

#include "isp/base/executor.h"
#include "isp/base/image.h"
#include "isp/base/plane.h"
#include "isp/merge/frame.h"
#include "isp/merge/motion.h"

/// Brings the values of a frame to the sites of the reference that show the same content.
///
/// What is at site q of a frame is at position u of the reference, where u + shift(u) = q. With a prediction P of the
/// reference, only the differences
///     D(q) = y(q) / light - P(u)
/// are moved, and P(p) is added at the site p they are brought to: a value is wrong only by the difference of the
/// errors of P at u and at p. P is interpolated by cubic convolution (R. G. Keys, IEEE Trans. ASSP 29, 1981).
namespace lowlux::merge {

/// Computes the differences D of a frame to the prediction, at the frame's own sites.
/// @param light        ratio of the frame's signal to that of the reference
/// @param prediction   R, G, B of the reference at every pixel [e-]; three empty views: it is 0 everywhere
/// @param differences  as large as the frame, in the light of the reference; NaN where the frame has no value. It may
///                     be the memory of the frame's signal.
void subtract_prediction(const FrameView& frame, double light, const Motion& motion,
                         const RgbView<const float>& prediction, PlaneView<float> differences, Executor& executor);

/// Places differences in whole CFA cells: each site p gets P(p) + D(q) of the site q of its colour that is nearest to
/// p + shift(p), at most one pixel away along each axis. Noise stays white, each value being a sample of its own.
/// @param placed  as large; NaN where there is no value
void place_nearest(PlaneView<const float> differences, BayerPhase phase, const Motion& motion,
                   const RgbView<const float>& prediction, PlaneView<float> placed, Executor& executor);

inline constexpr float min_red_blue_px = 4.0F / 3;  // radius of drops of red and blue

/// Places differences as drops, row by row, after drizzling (A. S. Fruchter, R. N. Hook, PASP 114, 2002): each site p
/// gets the mean of all differences of its colour, weighted by a tent of the distance to p + shift(p),
///     t = max(1 - |dx| / radius, 0) max(1 - |dy| / radius, 0).
/// Both greens count as one colour. Drops of red and blue, whose samples are two pixels apart, have a radius of at
/// least 4/3 pixels: within smaller ones a frame weighs so much less at some sites than at others that the variance of
/// the mean grows, 1.78 times at a radius of 1 and 1.13 times at 4/3. Over many frames with different displacements,
/// the drops fill the space between the sites, so that detail finer than a colour's own mosaic survives. A drop
/// averages the noise of neighbours too, which it then shares with them: over larger areas the noise is that of one
/// sample for each site, as `weight` counts them, times what add_drops returns. Each thread needs an object of its own.
class DropRows {
 public:
  /// @param radius_px  0.5..2
  DropRows(PlaneView<const float> differences, BayerPhase phase, const Motion& motion,
           const RgbView<const float>& prediction, double radius_px);

  /// Holds the values of a row of the reference.
  struct Row {
    std::vector<float> value;   // P(p) + sum t D / sum t; NaN where the sum of t is 0
    std::vector<float> weight;  // sum t over its mean over all displacements: on average 1
  };
  const Row& row(int y);

 private:
  PlaneView<const float> differences_;
  BayerPhase phase_;
  const Motion& motion_;
  RgbView<const float> prediction_;
  float radius_;
  Row row_;
  std::vector<float> dx_px_, dy_px_;
};

/// Places differences as drops for all three colours of each pixel, row by row. Drops are smaller than those of
/// DropRows: over frames with different displacements each pixel gets samples of each colour.
class ColourDropRows {
 public:
  static constexpr float green_px = 0.75F, red_blue_px = 0.9F;  // radii

  /// Each argument as in DropRows.
  ColourDropRows(PlaneView<const float> differences, BayerPhase phase, const Motion& motion,
                 const RgbView<const float>& prediction);

  /// Holds the values of a row of the reference, for R, G and B.
  struct Row {
    std::array<std::vector<float>, 3> value;   // sum t (P(p) + D)
    std::array<std::vector<float>, 3> weight;  // sum t, in multiples of 1/256, at most 1
  };
  const Row& row(int y);

 private:
  PlaneView<const float> differences_;
  BayerPhase phase_;
  const Motion& motion_;
  RgbView<const float> prediction_;
  Row row_;
  std::vector<float> dx_px_, dy_px_;
};

}  // namespace lowlux::merge
