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
/// Where a level and previous frames both take part, each site is a mean of the level's result and of the mean over
/// frames. Its weights are those by inverse variances of the level's result and of the previous frames alone. The
/// variance of the level includes the detail it has lost: what both results differ by beyond their noise, around
/// the means of its colours in blocks of 8 x 8 sites, and at most 4 times the variance of the level's noise,
/// because something may have moved too little to be detected. denoise/README.md has the equations.
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
    BayerPhase phase = BayerPhase::rggb;  // phase of the frame
  };
  /// Reduces the noise of a tile of a frame, or of all of it. Where regions differ, each rectangle with a level is
  /// reduced with a margin of its own, and the others keep their noise.
  /// @param raw_e     the padded tile, without the lines of `how`
  /// @param signal_e  as large; the core is set; may be result_memory()
  /// @param maps      maps of the cells of the padded tile, those of the core are set; none if they are not wanted
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

  /// Returns whether the result of every tile can lie in result_memory(): all of the frame has one level.
  static bool has_result_memory(const NoiseReduction& how) { return how.has_level() && !how.regions; }
  /// Returns memory of the denoiser for the result of a padded tile of width x height pixels, valid until the next
  /// tile. Precondition: has_result_memory().
  PlaneView<float> result_memory(int width, int height, const NoiseReduction& how);

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
  Plane<float> variance_fraction_;  // variance of mean_e_ over a raw value's, one for each 2x2 cell
  NoiseMaps level_maps_;
  double moved_ = 0;
  denoise::Level most_ = denoise::Level::high;  // highest level that there is memory for
  std::vector<LevelPart> parts_;
  Plane<float> part_e_;  // values of a tile and its margin
  NoiseMaps part_maps_;
};

}  // namespace lowlux::isp
