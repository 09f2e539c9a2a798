#pragma once

#include <array>
#include <cstddef>
#include <memory>
#include <optional>

#include "isp/base/executor.h"
#include "isp/base/frame.h"
#include "isp/base/image.h"
#include "isp/pipeline/plan.h"
#include "isp/pipeline/render/frame_tiles.h"
#include "isp/pipeline/render/noise_reducer.h"
#include "isp/pipeline/render/picture_view.h"

namespace lowlux::isp {

/// Returns whether a frame is rendered in tiles: a Bayer frame above TileLimits::max_whole_px whose mosaic is
/// processed in floats. Frames rendered directly from codes need no mosaic. Never split, whatever their size, are
/// frames that are demosaiced or monochrome, looks that are made of the entire image or tabulated (`--look`), noise
/// that is held to a limit, maps of the noise, reconstructed highlights, sharpening, and frames in which previous ones
/// take part.
bool is_tiled(const RawDn& raw, const DevelopPlan& plan, const TileLimits& limits);

/// Renders Bayer frames in tiles: for each core and its margin the mosaic, its noise, its image. Without noise
/// reduction the image has the same bits as that of the whole frame; with it, the difference is far below the noise
/// (README.md). Owns its memory, which the first frame of a size allocates.
class TileRenderer {
 public:
  TileRenderer(Executor& executor, const TileLimits& limits) : executor_(executor), limits_(limits) {}

  /// Renders a frame in tiles. Precondition: is_tiled.
  void render(const RawFrame& frame, const DevelopPlan& plan, NoiseReducer& noise, Picture& out);

  /// Returns the bytes for such a frame, those of the NoiseReducer included; more than are taken only where regions
  /// differ.
  static std::size_t bytes(const RawDn& raw, const DevelopPlan& plan, const TileLimits& limits, int threads);

 private:
  void reserve(const RawFrame& frame, const DevelopPlan& plan);
  PlaneView<float> mosaic_of(const RawFrame& frame, const DevelopPlan& plan, const Rect& core, NoiseReducer& noise);
  void encode_core(const RgbInput& in, const DevelopPlan& plan, const PictureSize& size, const PictureView& out);
  void render_core(const RawFrame& frame, const DevelopPlan& plan, const Rect& core, PlaneView<const float> mosaic,
                   const PictureView& out);

  Executor& executor_;
  TileLimits limits_;
  Plane<float> noisy_;   // of a padded tile
  Plane<float> mosaic_;  // of a padded tile, where noise is reduced
  std::array<Plane<float>, 3> half_planes_;
  std::array<Plane<float>, 3> modelled_;  // light of a core, changed by the profile
  std::unique_ptr<RawToRgb> kernel_;
  int kernel_width_ = 0;
  std::optional<Picture> picture_;  // of a core and a few pixels around it
  SampleType picture_samples_ = SampleType::u8;
  int picture_width_ = 0;
  int picture_height_ = 0;
};

}  // namespace lowlux::isp
