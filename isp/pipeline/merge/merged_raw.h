#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "isp/base/frame.h"
#include "isp/base/result.h"
#include "isp/merge/stars/drizzle.h"
#include "isp/pipeline/options.h"
#include "isp/pipeline/stage_clock.h"

namespace lowlux::isp {

/// Lists how frames are brought to the place of the reference.
enum class MergeAlignment : std::uint8_t {
  none,      // the camera did not move
  cells,     // by tiles, in whole CFA cells; detail is blurred by up to a pixel
  subpixel,  // like `cells`, and fractions of a cell by predicted differences of the developed reference
  stars,     // by the stars, at any distance, to a fraction of a pixel
};

/// Describes how frames are merged.
struct MergeOptions {
  std::optional<bool> robust;               // false: plain mean of all frames; absent: robust, unless a budget decides
  std::optional<MergeAlignment> alignment;  // absent: none if the camera stood still, else subpixel
  /// Index of the frame that the others are brought to. Absent: the first; in a bracket FrameLoader::brightest.
  std::optional<int> reference;
  double false_alarm = 1e-3;     // fraction of the blocks of a static scene that are left out, 1e-6..0.5
  bool keep_foreground = false;  // with stars: what stands still on the ground is averaged in its place
  std::optional<merge::DrizzleOptions> drizzle;  // makes a LinearRaw image; frames move, and their exposure is one
  bool developed_after = false;                  // a budget is for developing the merged frame too
  std::optional<double> memory_limit_bytes;      // memory limit of a drizzled image, which is larger than its frames
};

/// Describes the work that a merge does on each frame.
struct MergeMethod {
  MergeAlignment alignment = MergeAlignment::none;
  bool robust = true;
};

/// Holds the method that was chosen by a budget, see merge_budget.h.
struct MergePlan {
  MergeMethod method;
  double budget_s = 0;
  double predicted_s = 0;  // without waiting for files
  double taken_s = 0;
  bool motion_measured = false;       // there was time to find out whether the camera moved
  bool fits = true;                   // false: nothing was predicted to fit, and the cheapest method is used
  std::optional<MergeMethod> better;  // cheapest of the better methods that were open to choice, none of which fits
  double better_s = 0;                // its predicted time
};

/// States how much of a frame was used, and why not more.
struct FrameUse {
  double used_fraction = 1;    // fraction of the comparable sites that were used
  bool is_compared = false;    // with the reference; false: it is averaged as it is
  std::int64_t outliers = 0;   // single sites left out: cosmic rays, satellites
  double mean_chi_square = 1;  // squared difference to the reference over its variance; 1 for a static scene
  double largest_shift_px = 0;
  double shift_error_px = 0;  // standard error of the displacement, each axis
  bool aligned = true;        // false: its displacement could not be found
  double light = 1;           // ratio of its signal to that of the reference, as measured
  int stars_matched = 0;      // in this frame and in the reference, if it was aligned by stars
};

/// Holds one raw frame made of several.
struct MergedRaw {
  RawFrame frame;  // the active area only, in 16-bit codes or floating-point samples
  MergeAlignment alignment = MergeAlignment::none;
  double baseline_exposure_ev = 0;  // for DNG: white of a bracket over that of its reference
  /// Set where frames show that the sensor saturates below white: the level of the reference, else the lowest of the
  /// frames of its gain in a bracket, else that of the first other frame that shows one.
  std::optional<SaturationLevel> saturation;
  bool bracket = false;  // exposures differ: weighted by inverse variance, saturated sites left out
  int reference = 0;
  std::optional<MergePlan> plan;  // set where there is a budget
  std::vector<FrameUse> frames;
  double mean_count = 0;  // frames averaged at a site, harmonic mean; 0 for a bracket
  /// Variance over larger areas over that of a mean of so many frames, of R, G and B; brackets do not use it.
  std::array<double, 3> drop_noise{1, 1, 1};
  int stars = 0;                           // found in the reference, if frames were aligned by stars
  double still_fraction = 0;               // fraction of the blocks that do not move while the stars move
  std::array<double, 3> empty_fraction{};  // fractions of the pixels of a drizzled image without data of R, G, B
  std::vector<std::string> warnings;
  std::vector<StageTime> times;
};

/// Holds a frame to merge, and its options: black level, dark frame, defects, line noise. Only the reference needs a
/// NoiseProfile: frames of its gain have its noise. The budget and the cost in the options of the reference
/// (ProcessingGoal) are those of the merge.
struct FrameToMerge {
  RawFrame frame;
  DevelopOptions options;
  std::string name;  // name of the frame in error messages
};

/// Returns the frame of an index, for the reference or as another one. It may be called more than once for each, always
/// returns the same, and is called on another thread while the previous frame is processed, once at a time.
using FrameReader = std::function<Result<FrameToMerge>(int index, bool is_reference)>;

/// Reports the fraction of the work that is done, 0..1.
using MergeProgress = std::function<void(double fraction)>;

}  // namespace lowlux::isp
