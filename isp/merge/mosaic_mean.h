#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "isp/base/executor.h"
#include "isp/base/image.h"
#include "isp/base/noise_ratio.h"
#include "isp/base/plane.h"
#include "isp/merge/block_test.h"

namespace lowlux::merge {

/// Returns the mean of a few mosaics of one light at every site, without values that are far from the median:
///     |y - median| > z sqrt(V), V = the noise of one mosaic at the median, z^2 = 16.
/// Values that differ from it are those of a minority: a walker, a satellite, a cosmic ray. NaN where no mosaic has a
/// value. The result replaces the first mosaic.
/// @param mosaics  1..16 of equal size
void robust_mean(std::span<Plane<float>> mosaics, const MosaicNoise& noise, Executor& executor);

/// Holds a row of a mosaic that is added to a mean. Pointers that are null stand for rows of 1.
struct WeightedRow {
  const float* value = nullptr;        // NaN: none
  const float* weight = nullptr;       // >= 0, samples for each site; may not depend on the noise of the value
  const float* site_weight = nullptr;  // inverse variance of one sample, which multiplies it
};

/// Adds weighted mosaics of one light, and returns their mean. Memory does not depend on their number: 8 bytes for
/// each site. NaN sites, and blocks that do not match, do not count.
class MosaicMean {
 public:
  MosaicMean(int width, int height);

  /// Adds a row of a mosaic. Different rows may be added at the same time.
  /// @param block_matches  as in Comparison; without data all count
  void add_row(int y, const WeightedRow& row, PlaneView<const std::uint8_t> block_matches);
  /// Adds a mosaic with the weight 1, as for frames of equal noise.
  void add(PlaneView<const float> mosaic, PlaneView<const std::uint8_t> block_matches, Executor& executor);

  /// Replaces everything that was added to a site; with a weight of 0 it has no value.
  void replace(int x, int y, float value, float weight) {
    sum_.at(x, y) = weight * value;
    weight_.at(x, y) = weight;
  }

  /// Returns the sum of the weights of each site: 1 / weight is the variance of the mean over that of one sample, or
  /// the variance itself where site weights are inverse variances.
  const Plane<float>& weight() const { return weight_; }

  /// Returns the mean, and fills sites without any value by the mean of the nearest sites of their colour that have
  /// one; 0 where there is none within 32 pixels. Empties the sum; the weights stay.
  Plane<float> take_mean(Executor& executor);

 private:
  Plane<float> sum_;
  Plane<float> weight_;
};

/// Holds the weighted sums of a row of R, G and B.
struct ColourRowSums {
  std::array<const float*, 3> value{};   // sum t y
  std::array<const float*, 3> weight{};  // sum t, in multiples of 1/256, at most 1
};

/// Adds frames at every pixel for each of three colours, and returns their mean: over frames that are displaced against
/// each other, every pixel gets samples of each colour. Memory does not depend on their number: 18 bytes for each
/// pixel.
///
/// Where displacements do not cover the pixels evenly, those of few samples keep a part of the prediction, and those
/// without any all of it. A sample then counts for no pixel more than for others, and over larger areas the variance is
/// that of the number of samples times the square of the mean share that samples have in pixels.
class ColourMean {
 public:
  static constexpr int max_frames = 255;  // largest number of frames whose weights fit into the sums

  ColourMean(int width, int height);

  int width() const { return sum_[0].width(); }
  int height() const { return sum_[0].height(); }

  /// Adds a row of a frame. Different rows may be added at the same time.
  /// @param block_matches  as in Comparison; without data all count
  void add_row(int y, const ColourRowSums& row, PlaneView<const std::uint8_t> block_matches);

  /// Returns the variance of R, G, B over that of a sample, as it is seen in means of larger areas. The noise of the
  /// prediction counts as small.
  std::array<double, 3> variance(Executor& executor) const;

  struct Image {
    Plane<float> samples;    // R, G, B of each pixel, interleaved
    NoiseRatio noise_ratio;  // noise ratio of the variance of a block to variance()
  };
  /// Returns the mean of some rows. Values without samples are those of the prediction.
  /// @param rows      begin at a block, and end at one or at the last row
  /// @param variance  variance()
  Image image(const RowBand& rows, const std::array<double, 3>& variance, const RgbView<const float>& prediction,
              Executor& executor) const;

 private:
  std::array<Plane<float>, 3> sum_;
  std::array<Plane<std::uint16_t>, 3> weight_;  // in multiples of 1/256
  Plane<std::uint8_t> frames_;                  // of each block
};

}  // namespace lowlux::merge
