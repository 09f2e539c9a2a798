#pragma once

#include <cstddef>
#include <memory>
#include <vector>

#include "denoise/denoiser.h"
#include "isp/base/executor.h"
#include "isp/base/frame.h"
#include "isp/pipeline/noise_reduction.h"
#include "isp/pipeline/render/level_parts.h"

namespace lowlux::isp {

/// Subtracts dark charge from a mosaic and reduces its noise as decided. Owns the denoisers and their memory
/// (see Denoiser and TemporalMean), which the first frame of a size allocates.
///
/// Where a level and previous frames both take part, each site is the mean of both results, weighted by the inverse of
/// their predicted variances: what moves is left to the level, what stands still to the previous frames. The variance
/// of the level counts variance_penalty() times, because it does not include the detail that the level removes.
class NoiseReducer {
 public:
  explicit NoiseReducer(Executor& executor) : executor_(executor) {}

  /// Describes a tile of a frame, or all of it, in pixels of its active area. The corner of `whole` is on the lattice
  /// of frame_tiles.h.
  struct Piece {
    Rect core;   // region that is requested
    Rect whole;  // padded tile: the region that is known, margin included
    int frame_width = 0;
    int frame_height = 0;
    BayerPhase phase = BayerPhase::rggb;  // of the frame
  };
  /// Reduces the noise of a tile of a frame, or of all of it. Where regions differ, each rectangle with a level is
  /// reduced with a margin of its own, and the others keep their noise.
  /// @param raw_e     the padded tile, without the lines of `how`
  /// @param signal_e  as large; the core is set
  /// @param maps      of the cells of the padded tile, those of the core are set; none if they are not wanted
  /// Precondition: how.reduces(); with previous frames, the piece is the whole frame.
  void run(const Piece& piece, const NoiseReduction& how, PlaneView<const float> raw_e, PlaneView<float> signal_e,
           const denoise::DenoiseMaps& maps = {});
  /// Returns the bytes for a frame of width x height pixels, without previous frames.
  /// @param maps  whether they are requested; their own memory is not included
  static std::size_t bytes(int width, int height, const NoiseReduction& how, bool maps, int threads);
  /// Returns the bytes of the NoiseMaps of a frame.
  static std::size_t maps_bytes(int width, int height);
  /// Allocates memory for tiles of up to width x height pixels, so that later ones need none.
  void reserve_pieces(int width, int height, const NoiseReduction& how);

  /// Returns the factor of the level's variance: 1 where only this frame is known, 4 where many previous ones are:
  /// noise of a single frame that comes back is visible, and a mean of few frames may be of something that moved too
  /// little to be detected. Chosen on the images of tests/scenarios/temporal_blend_test.cpp, which prints the results
  /// of other factors.
  /// @param share  variance of the mean over frames, as a fraction of a raw value's, 0..1
  static constexpr float variance_penalty(float share) { return 1 + 3 * (1 - share) * (1 - share); }

  /// Returns the fraction of the blocks that moved in the last frame; 0 where no previous frames took part.
  double moved() const { return moved_; }

 private:
  void reserve_level(int width, int height, denoise::Level most);
  void reserve_time(int width, int height);
  void reduce_by_level(const Piece& piece, const NoiseReduction& how, PlaneView<const float> raw_e,
                       PlaneView<float> signal_e, const denoise::DenoiseMaps& maps);
  void reduce_part(const LevelPart& part, const Piece& piece, const NoiseReduction& how, PlaneView<const float> raw_e,
                   PlaneView<float> signal_e, const denoise::DenoiseMaps& maps);
  void reduce_by_time(const denoise::RawElectronsView& raw, const NoiseReduction& how);
  void blend(BayerPhase phase, const NoiseReduction& how, const denoise::DenoiseMaps& level, PlaneView<float> signal_e);

  Executor& executor_;
  std::unique_ptr<denoise::Denoiser> denoiser_;
  int width_ = 0;
  int height_ = 0;
  std::unique_ptr<denoise::TemporalMean> temporal_;
  int temporal_width_ = 0;
  int temporal_height_ = 0;
  Plane<float> mean_e_;             // mean over frames, dark charge included
  Plane<float> variance_fraction_;  // of mean_e_ over a raw value's, one for each 2x2 cell
  NoiseMaps level_maps_;
  double moved_ = 0;
  denoise::Level most_ = denoise::Level::high;  // highest level that there is memory for
  std::vector<LevelPart> parts_;
  Plane<float> part_e_;  // of a tile and its margin
  NoiseMaps part_maps_;
};

}  // namespace lowlux::isp
