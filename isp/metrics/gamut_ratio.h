#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "isp/model/colour/colorimetry.h"

namespace lowlux::isp {

/// Colours are counted up to this distance from neutral in a* and in b*: no colour that is as bright as white or darker
/// is beyond 500.
inline constexpr int gamut_reach = 1024;

/// A bin counts as part of a gamut if it holds at least this many pixels and gamut_min_fraction of those counted.
inline constexpr double gamut_min_pixels = 3;
/// A bin counts as part of a gamut if it holds at least this fraction of the pixels counted: the larger of the two
/// bounds decides. The bound of gamut_min_pixels alone would have no effect in large images, the fraction alone none
/// in images below 0.3 megapixels.
inline constexpr double gamut_min_fraction = 1e-5;

/// Histogram of the colours of pixels: bins of one unit of a* by one unit of b*; 16 MB.
class GamutBins {
 public:
  GamutBins();

  /// Counts colours; several threads may call it at once.
  void add(std::span<const Lab> colours);

  std::uint64_t counted() const;
  std::uint64_t not_finite() const { return not_finite_; }  // dropped: L*, a* or b* is not a finite number
  std::uint64_t beyond() const { return beyond_; }          // dropped: farther than gamut_reach

  /// Returns whether each bin is kept, row by row of b*.
  std::vector<bool> kept() const;

 private:
  std::vector<std::uint32_t> count_;
  std::uint64_t not_finite_ = 0;
  std::uint64_t beyond_ = 0;
};

/// The effective gamut ratio of an image: the fraction of the reference's colours that it has (the thesis names the
/// ratio and not the outline; the bins are this project's).
struct GamutRatio {
  /// 100 area(hull of test and hull of reference) / area(hull of reference), hulls of the centres of kept bins; not a
  /// number if the reference's are on one line, 0 if only the test's are.
  double convex_percent = 0;
  /// 100 (bins kept of both) / (bins kept of the reference): a gamut ratio for outlines of any shape. It is not a
  /// number if the reference has none.
  double occupancy_percent = 0;
  std::size_t reference_bins = 0;  // number of kept bins
  std::size_t test_bins = 0;
};

GamutRatio gamut_ratio(const GamutBins& reference, const GamutBins& test);

/// Returns the gamut ratio of two sets of colours, which may differ in size.
GamutRatio gamut_ratio(std::span<const Lab> reference, std::span<const Lab> test);

}  // namespace lowlux::isp
