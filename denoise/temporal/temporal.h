#pragma once

#include <memory>

#include "denoise/denoise_options.h"
#include "isp/base/executor.h"
#include "isp/base/plane.h"

namespace lowlux::denoise {

/// Holds the options of TemporalMean.
struct TemporalOptions {
  double false_alarm = 1e-3;      // fraction of blocks of a still scene that are detected as moving, 1e-6..0.5
  int max_frames = 32;            // 2..256: the newest frame has a weight of at least 1 / max_frames
  bool compensate_motion = true;  // displaces the mean with the scene
};

/// Recursive mean over the frames of a video, in electrons, of what stands still or whose motion is found. README.md
/// has the equations, and tests/reference/temporal_ref.h is a plain double implementation.
///
/// Blocks of 8 x 8 sites are compared with the mean of the previous frames. Those that differ by more than the noise
/// model explains, and their neighbours at a lower threshold, start anew. In scenes that move, the mean is first
/// displaced by what FrameMotion finds, if frames have at least FrameMotion::min_side pixels each way. Areas of 32 x 32
/// sites that differ by less, but by more than their noise from what the frame differs by as a whole, have a larger
/// variance from then on. After n <= max_frames still frames of equal light the mean's variance is 1 / n of a raw
/// value's; with more frames it falls to 1 / (2 max_frames - 1).
///
/// Owns its memory, allocates only in the constructor, and processes one frame at a time. The result is bit-identical
/// for every number of threads and every instruction set.
class TemporalMean {
 public:
  /// Allocates for mosaics of up to max_width x max_height pixels, each 2..65536, and up to `threads` of an executor's
  /// threads: 10 bytes for each pixel, rows rounded up to 128 pixels, and 13 KB for each thread.
  TemporalMean(int max_width, int max_height, int threads);
  ~TemporalMean();
  TemporalMean(const TemporalMean&) = delete;
  TemporalMean& operator=(const TemporalMean&) = delete;

  /// Forgets all frames. Call it where a stream starts, frames are missing, or the mode changes.
  void reset();

  /// Adds a frame to the mean. If its size or phase differs from that of the previous frame, it is the first, as after
  /// reset().
  /// @param raw  at least 2 x 2 pixels; any phase, odd sizes too; without a noise ratio
  /// @param noise  noise of this frame; the dark charge and the variance may change from frame to frame
  /// @param light  ratio of the signal [e-] of a scene in this frame to that in the previous frame: the ratio of
  /// exposure times, where only they change. > 0 and finite; beyond 1e-6..1e6 the frame is the first
  /// @param mean_e  as large as `raw`: the mean scaled to this frame's light, with this frame's dark charge in it, as
  /// `raw` has. Sites that are saturated in this frame, and blocks that start anew, are as in `raw`. May not overlap
  /// `raw`
  /// @param variance_fraction  variance of mean_e over that of `raw`, for each 2x2 cell, ceil(width / 2) x ceil(height
  /// / 2); without data it is not written
  /// @return the fraction of blocks that started anew; 1 for the first frame
  double run(const RawElectronsView& raw, const RawNoise& noise, double light, const TemporalOptions& options,
             PlaneView<float> mean_e, PlaneView<float> variance_fraction, Executor& executor);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace lowlux::denoise
