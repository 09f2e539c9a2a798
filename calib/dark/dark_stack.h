#pragma once

#include <vector>

#include "calib/frame_setting.h"
#include "isp/base/cfa.h"
#include "isp/base/frame.h"
#include "isp/base/plane.h"
#include "isp/base/result.h"

namespace lowlux::calib {

/// Dark frames of one exposure time and temperature, reduced to two planes of the active area.
struct DarkGroup {
  FrameSetting setting;
  int frames = 0;             // files; each may itself be a mean of several exposures, a master dark
  bool rounded = true;        // the files hold whole codes
  Plane<float> mean_dn;       // mean of the frames, for each pixel
  Plane<float> variance_dn2;  // temporal, for each pixel, about the mean of its site in each frame, as EMVA 1288 has
                              // it: drift and flicker of whole frames are not in it; quantisation included; unbiased
  PerSite<double> row_variance_dn2{};    // the part of it that whole rows have in common; unbiased, may be negative
  PerSite<double> frame_variance_dn2{};  // temporal, common to whole frames; unbiased, may be negative
  PerSite<double> fraction_at_zero{};    // fraction of the samples at code 0
};

/// Returns an error for a single frame, which contains no information about noise.
Result<void> check_noise_is_known(const DarkGroup& group);

/// Code above which a pixel may be saturated, as a fraction of the white level.
inline constexpr double full_fraction = 0.95;

/// Returns the fraction of the pixels whose mean is above a code.
double saturated_fraction(const DarkGroup& group, double full_dn);

/// Frames that a DarkStack holds. The temperature of flats does not matter: their signal is light.
enum class StackedFrames : unsigned char { darks, flats };

/// Accumulates dark frames, or flats, as they are added: 10 bytes for each pixel, for any number of frames.
class DarkStack {
 public:
  explicit DarkStack(StackedFrames kind = StackedFrames::darks) : kind_(kind) {}

  /// Adds a frame. Errors: those of setting_of; a frame that differs from the first in camera, size,
  /// mosaic, white level, gain, exposure time, or, among darks, by more than a degree; more than 32,768 frames.
  Result<void> add(const RawDn& raw);

  /// Returns the group of the added frames. Errors: fewer than two frames, which contain no information about noise.
  Result<DarkGroup> group() const;

  /// Returns the group of one frame or more. Of a single frame the variances are 0 and without meaning.
  DarkGroup average() const;

  int frames() const { return frames_; }
  /// Returns the setting of the first frame; there must be one.
  const FrameSetting& setting() const { return setting_; }

 private:
  Result<void> begin(const RawDn& raw, FrameSetting setting);
  PerSite<double> mean_difference(const RawDn& raw) const;
  void add_row(const RawDn& raw, int y, const PerSite<double>& frame_dn);
  PerSite<double> frame_variance() const;

  StackedFrames kind_;
  FrameSetting setting_;
  int frames_ = 0;
  Plane<std::uint16_t> first_;  // the accumulated values are differences to it, to avoid cancellation
  Plane<std::int32_t> sum_;
  Plane<float> squares_;
  std::vector<double> row_sum_, row_squares_;      // sums of row means, two for each row: even and odd columns
  PerSite<double> frame_sum_{}, frame_squares_{};  // sums of the means of frames, about which all squares are computed
  PerSite<std::int64_t> at_zero_{};
};

}  // namespace lowlux::calib
