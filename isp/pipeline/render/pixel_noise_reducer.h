#pragma once

#include <array>
#include <cstddef>
#include <span>

#include "denoise/denoise_options.h"
#include "isp/base/executor.h"
#include "isp/base/frame.h"
#include "isp/base/noise_ratio.h"
#include "isp/base/plane.h"
#include "isp/pipeline/noise_reduction.h"
#include "isp/pipeline/render/frame_tiles.h"
#include "isp/pipeline/render/noise_reducer.h"

namespace lowlux::isp {

/// Reduces the noise of frames that are no mosaics, in cells of pixel_cells.h, tile by tile. The memory for the cells
/// is that of one tile; the first frame of a size allocates.
class PixelNoiseReducer {
 public:
  /// @param side_px  maximum side of a tile's core, in sites: see TileLimits
  explicit PixelNoiseReducer(Executor& executor, int side_px = TileLimits{}.side_px)
      : executor_(executor), side_px_(side_px) {}

  /// Reduces the noise of the planes of a frame, which are fractions of white.
  /// @param planes  three, or one
  /// @param noise   does the work
  /// @param maps    filled if not null: a value for each pixel, of the sites of its cell (scale_to_pixels)
  /// Precondition: how.level, how.cell_e.
  void run(std::span<Plane<float>> planes, const NoiseReduction& how, NoiseReducer& noise, NoiseMaps* maps = nullptr);

  /// Returns the bytes for a frame of width x height pixels, those of the NoiseReducer included.
  static std::size_t bytes(const RawDn& raw, const NoiseReduction& how, int threads);

 private:
  /// Holds a frame whose noise is reduced.
  struct Frame {
    std::span<const Plane<float>> planes;
    NoiseRatioView noise_ratio;  // noise ratio of the pixels
    NoiseReduction of_sites;     // the decision in sites
    denoise::DenoiseMaps maps;   // maps of all pixels; none if they are not wanted
  };
  /// Reduces the noise of a tile, whose regions are in sites, to clean_.
  void reduce_tile(const Frame& frame, const NoiseReducer::Piece& piece, NoiseReducer& noise);

  Executor& executor_;
  int side_px_;
  std::array<Plane<float>, 3> clean_;
  Plane<float> cells_;   // cells of a tile and its margin
  NoiseMaps tile_maps_;  // likewise, where maps are wanted
};

/// Scales the residual variance of maps from the sites of cells to pixels [e-^2]: that of white-balanced luma
/// 0.2 R + 0.6 G + 0.2 B, or of the one value of a monochrome pixel.
void scale_to_pixels(const RawDn& raw, NoiseMaps& maps);

/// Propagates the gains g of green, or of monochrome pixels, to the residual variance of each pixel: V -> g^2 V.
void apply_gains_to_maps(const RawCorrections& corrections, NoiseMaps& maps, Executor& executor);

}  // namespace lowlux::isp
