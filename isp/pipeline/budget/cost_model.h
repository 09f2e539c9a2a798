#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "isp/base/frame.h"

/// How long developing takes on this machine.

namespace lowlux::isp {

/// Parts of the work that plans differ in.
enum class CostPart : std::uint8_t {
  planning,  // black point, thumbnail, white, exposure, effects, signal to noise ratio: what every plan begins with
  samples,   // of the frame, looked into for hot pixels, row and column noise
  defects,   // the search in the whole frame
  lines,     // row and column noise looked for in the whole frame
  offsets,   // what it takes more where it stands out
  check,     // of the noise model, where noise is reduced
  codes,     // rendering straight from codes
  floats,    // rendering from electrons
  draft_0,   // the same with noise reduced, chroma starting on level 0, 1 or 2
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
  codes_16,  // what 16-bit codes take more than 8-bit ones
  floats_32,
  look,     // what the look of the eye takes more
  display,  // what the change for a display takes more
};
inline constexpr int cost_parts = 23;

/// "planning", "draft-1" and so on.
std::string_view name_of(CostPart part);
constexpr bool is_denoising(CostPart part) { return part >= CostPart::draft_0 && part <= CostPart::best_2; }

/// Of the active area of a frame.
struct CostSize {
  double megapixels = 0;
  double denoised_megapixels = 0;  // with what the denoiser appends, and what pieces of a large frame share
};
/// Of a frame that is worked on as a whole.
CostSize cost_size(int width, int height);
/// Of any, in pieces where TileLimits say so.
CostSize cost_size(const RawDn& raw);

/// Measured at some sizes.
struct CostPoint {
  double megapixels = 0;  // denoised ones for draft_0 to best_2
  double seconds = 0;
};

/// Times of one machine with one number of threads.
struct CostModel {
  std::string machine;  // that was measured; see isp/cli/develop/cost_file.h
  int threads = 1;
  double pace_s = 0;  // what a fixed piece of work took meanwhile (isp/bench/pace.h); 0: not known
  double pace = 1;    // what it takes at the moment, in units of that: factor of all times
  std::array<std::vector<CostPoint>, cost_parts> points;  // of each part, by rising size; none: the part is free

  /// Seconds of a part for a frame of this size: linear between two points, which is exact for a fixed time and one for
  /// each pixel; beyond them the seconds per megapixel of the nearest. @param size  > 0
  double seconds(CostPart part, const CostSize& size) const;
};

/// One part of a plan's work.
struct CostShare {
  CostPart part;
  double share = 1;  // of the frame
};

/// The sum over parts.
double predicted_s(const CostModel& model, const CostSize& size, const std::vector<CostShare>& work);

inline constexpr std::string_view reference_machine = "two cores of an AMD EPYC with AVX-512";

/// The times of large frames on the reference machine, measured by `lowlux bench --calibrate-cost` when nothing else
/// ran on it. In units of its pace they are an estimate for a machine that was not measured: parts limited by memory
/// and parts limited by arithmetic do not scale alike from one processor to another.
const CostModel& reference_cost();

}  // namespace lowlux::isp
