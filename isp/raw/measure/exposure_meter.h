#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

#include "isp/base/cfa.h"
#include "isp/base/frame.h"
#include "isp/base/packed/raw_format.h"
#include "isp/model/sensor/exposure_controller.h"

namespace lowlux::isp {

/// Holds the black level of each site of a frame.
struct MeteredBlack {
  PerSite<double> dn{};
  /// States that black is only an upper bound: the dark pixels of a scene, which may have no dark area. Frames of
  /// another exposure then have another bound, and predictions above it would be wrong.
  bool is_bound = false;
};

/// Counts the codes of some rows of a frame, by site of the mosaic, to set the exposure of the next frames by. All
/// memory is allocated in the constructor.
class ExposureMeter {
 public:
  explicit ExposureMeter(const RawFormat& format);

  void clear();
  /// Counts the codes of row y.
  void add_row(const std::uint16_t* dn, int width, int y);

  /// Returns the code of each site that 99 % of its pixels exceed.
  PerSite<double> darkest_dn() const;

  /// Returns the median and the highlight above black. Values are interpolated within their bins: codes, or the 2^(bits
  /// - 12) codes of a bin for more than 12 bits. Sensors may saturate below the largest code: where twice `fraction` of
  /// the pixels, and 32 or more, have the largest code of the frame, four times as many as have the code below, and it
  /// lies in the upper half of the range, it counts as white for this frame and those after it.
  /// @param black  where it is a bound, highlight and range count from code 0: codes are then never predicted too low
  /// for more light, and exposures that approach white do so from below
  /// @param fraction  fraction of the pixels, which exceed the highlight
  MeteredCodes codes(const MeteredBlack& black, double white_dn, double fraction);

 private:
  static constexpr int bits = 12;
  struct Site {
    std::array<std::uint32_t, std::size_t{1} << bits> count{};
    std::uint64_t pixels = 0;
    std::uint64_t sum = 0;
  };
  double exceeded_dn(const Site& site, double fraction) const;
  void find_saturation(const Site& site, double white_dn, double fraction);

  int shift_;
  int largest_;
  bool is_bayer_;
  double saturation_dn_ = std::numeric_limits<double>::infinity();  // where frames have shown it
  std::vector<Site> sites_;                                         // four; their counts are too much for a stack
};

/// Returns the rows of a frame that a meter needs: pairs of rows, so far apart that there are at most 128 pairs.
/// @return whether row y is one of them
bool is_metered_row(int y, int height);

}  // namespace lowlux::isp
