#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <utility>

#include "isp/base/image.h"
#include "isp/base/plane.h"
#include "isp/base/result.h"
#include "isp/merge/add_to_mean.h"
#include "isp/merge/align/align.h"
#include "isp/merge/mosaic_mean.h"
#include "isp/merge/motion.h"
#include "isp/merge/stars/drizzle.h"
#include "isp/pipeline/merge/bracket_frames.h"
#include "isp/pipeline/merge/merge_context.h"
#include "isp/pipeline/merge/star_alignment.h"

namespace lowlux::isp {

/// Averages frames that are brought to the place of the reference: of a camera or of stars that moved, and of brackets.
class MovedMerge {
 public:
  /// @param motions  motions that are known, by frame
  MovedMerge(MergeContext& work, std::map<int, merge::Motion> motions)
      : work_(work), known_motions_(std::move(motions)) {}

  /// Adds the reference, and the others where they match it. Errors: those of reading; too few stars; a bracket that is
  /// drizzled or keeps the foreground apart. Unfinished if FrameLoader::exposures_differ() is set and
  /// MergedRaw::bracket is not.
  Result<void> add_frames();

  /// Encodes what was added as the frame of the result.
  void encode();

 private:
  /// Holds a frame with its values at the sites of the reference.
  struct MovedFrame {
    FrameElectrons& frame;
    const merge::Motion& motion;
    double light;
    const Plane<float>& differences;
    const Plane<float>& placed;
    const Plane<float>& site_weight;  // empty: all sites weigh the same
  };

  bool by_stars() const { return work_.out.alignment == MergeAlignment::stars; }
  /// Returns whether the reference is the robust mean of a few frames.
  bool has_robust_reference() const { return work_.compares() && !work_.out.bracket && by_stars(); }
  bool predicts() const;
  /// Returns whether frames get the shading of the reference. Frames at rest have it, and of those aligned by stars the
  /// foreground does.
  bool changes_shading() const { return work_.out.alignment != MergeAlignment::none && !by_stars(); }
  RgbView<const float> expected() const;

  Result<void> check_bracket() const;
  Result<void> prepare_alignment();
  Result<void> predict();
  bool averages_differences() const;
  bool predicts_again(int averaged) const;
  Result<void> predict_again();
  Result<void> average_reference();
  void begin_sum();
  void add_reference();
  Result<void> add(FrameElectrons& frame, int index);
  std::optional<merge::Motion> motion_of(const FrameElectrons& frame, double light, int index);
  std::optional<merge::Motion> measured_motion(const FrameElectrons& frame, double light, int index);
  void add_matching(const MovedFrame& moved, Plane<std::uint8_t>& matches, int index);
  void add_colours(const MovedFrame& moved, PlaneView<const std::uint8_t> block_matches);
  void add_drops(const MovedFrame& moved, const merge::MeanPart& part);
  Plane<std::uint8_t> take_still_blocks(Plane<std::uint8_t>& matches) const;
  PerSite<double> mean_level_e() const;

  MergeContext& work_;
  std::map<int, merge::Motion> known_motions_;
  std::optional<BracketFrames> bracket_;
  std::optional<merge::AlignReference> tiles_;  // how frames are aligned
  std::optional<StarAlignment> stars_;
  Plane<float> gain_;                      // gain of the result; empty: it has no shading
  CameraRgb prediction_;                   // prediction of the reference, without noise
  Plane<std::uint8_t> still_;              // blocks of the foreground: 1; empty: none
  std::optional<merge::MosaicMean> mean_;  // the sum is one of these
  std::optional<merge::Drizzle> drizzle_;
  std::optional<merge::ColourMean> colours_;  // from which the reference is predicted again
  int colour_frames_ = 0;
  PerSite<double> level_e_{};             // mean signal, for the weights of drizzling and the size of drops
  double frames_used_ = 0;                // number of frames, as drops, by the fraction of their blocks that match
  std::array<double, 3> excess_noise_{};  // sum of what their drops add to the variance, over that of a frame
  double drop_radius_px_ = 1;  // radius with stars, which have no prediction; a drop contains a sample of each colour
};

}  // namespace lowlux::isp
