#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "isp/base/frame.h"

/// This header predicts how long developing and merging take on this machine.

namespace lowlux::isp {

/// Lists the parts of the work in which plans differ.
enum class CostPart : std::uint8_t {
  planning,  // black point, thumbnail, white, exposure, effects, signal-to-noise ratio: common to all plans
  samples,   // samples of the frame, searched for row and column noise
  defects,   // search for defects in the whole frame
  lines,     // search for row and column noise in the whole frame
  offsets,   // additional time of `lines` where line noise is significant
  check,     // check of the noise model, where noise is reduced
  codes,     // rendering directly from codes
  floats,    // rendering from electrons
  draft_0,   // rendering with noise reduction, chroma starting on level 0, 1 or 2
  draft_1,
  draft_2,
  standard_0,
  standard_1,
  standard_2,
  high_0,
  high_1,
  high_2,
  best_0,
  best_2,
  codes_16,  // additional time of 16-bit codes over 8-bit ones
  floats_32,
  look,            // additional time of the look of the eye
  display,         // additional time of the change for a display
  encoded_malvar,  // additional time of demosaicing by this method over DemosaicMethod::malvar
  residual,
  residual_median,
  merge_frame,       // black level, noise and electrons of one frame of a merge
  merge_mean,        // adding a frame without motion to the mean
  merge_robust,      // robust mean of five frames, and its comparison with the reference frame
  merge_comparison,  // comparison of a frame with the reference
  merge_alignment,   // displacement of a frame
  merge_cells,       // placing a frame in whole cells, and adding it
  merge_subpixel,    // placing a frame by predicted differences, and adding it
  merge_prediction,  // developing the reference for that
  merge_codes,       // noise and codes of the merged frame
};
inline constexpr int cost_parts = 35;

/// Returns the name of a part: "planning", "draft-1" and so on.
std::string_view name_of(CostPart part);
constexpr bool is_denoising(CostPart part) { return part >= CostPart::draft_0 && part <= CostPart::best_2; }

/// Holds the size of the active area of a frame.
struct CostSize {
  double megapixels = 0;
  double denoised_megapixels = 0;       // with the denoiser's padding and the overlaps of tiles of a large frame
  double more_for_best_megapixels = 0;  // additional size by the larger overlaps of Level::best

  /// Returns the size that the time of a part grows with.
  double megapixels_of(CostPart part) const;
};
/// Returns the size of a frame that is processed as a whole.
CostSize cost_size(int width, int height);
/// Returns the size of any frame, in tiles where TileLimits require them. Where each pixel is a cell of four sites
/// (pixel_cells.h), the denoised size is four times as large.
CostSize cost_size(const RawDn& raw);

/// Holds a time measured at one size.
struct CostPoint {
  double megapixels = 0;  // denoised megapixels for draft_0 to best_2
  double seconds = 0;
};

/// Holds the times of one machine with one number of threads.
struct CostModel {
  std::string machine;  // machine that was measured; see isp/cli/develop/cost_file.h
  int threads = 1;
  double pace_s = 0;  // time of a fixed workload at that moment (isp/cost/speed_probe.h); 0: not known
  double pace = 1;    // current time of that workload over pace_s: factor of all times
  std::array<std::vector<CostPoint>, cost_parts> points;  // for each part, by ascending size; none: no time

  /// Returns the seconds of a part for a frame of this size: linear between two points, which is exact for the sum of a
  /// fixed time and one for each pixel; beyond them the seconds per megapixel of the nearest.
  /// @param size  > 0
  double seconds(CostPart part, const CostSize& size) const;
};

/// Holds one part of a plan's work.
struct CostTerm {
  CostPart part;
  double share = 1;  // fraction of the frame
};

/// Returns the predicted time: the sum over parts.
double predicted_s(const CostModel& model, const CostSize& size, const std::vector<CostTerm>& work);

inline constexpr std::string_view reference_machine = "two cores of an AMD EPYC with AVX-512";

/// Returns the times of large frames on the reference machine, measured by `lowlux bench --calibrate-cost` when nothing
/// else ran on it; those of merging, of frames of 0.01 to 9 MP, follow from its pace. In units of its pace they are an
/// estimate for a machine that was not measured: parts limited by memory and parts limited by arithmetic do not scale
/// alike from one processor to another.
const CostModel& reference_cost();

}  // namespace lowlux::isp
