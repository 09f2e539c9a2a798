#pragma once

#include <optional>
#include <utility>

#include "isp/base/executor.h"
#include "isp/base/frame.h"
#include "isp/base/image.h"
#include "isp/pipeline/plan.h"
#include "isp/pipeline/render/image_stages.h"
#include "isp/pipeline/render/picture_view.h"
#include "isp/pipeline/render/region.h"
#include "isp/pipeline/render/signal_stages.h"

namespace lowlux::isp {

/// Renders raw frames to images as their plans state: render_region() has every stage in order, and a frame is one
/// region or, above TileLimits, several. Without noise reduction tiles have the same bits as the whole frame; with it,
/// the difference is far below the noise (README.md). Owns every buffer in between: the first frame of a size allocates
/// them, later ones of that size allocate nothing. Processes one frame at a time.
class Pipeline {
 public:
  /// @param limits  from which size on frames are rendered in tiles, which bounds their memory: see is_tiled
  explicit Pipeline(Executor& executor, const TileLimits& limits = {})
      : executor_(executor), limits_(limits), signal_(executor), image_(executor) {}

  /// Renders a frame to `out`, an image of the planned size and sample type: see make_picture(). Images that are
  /// cropped or shrunk allocate memory for the image before that.
  /// @param charge  charge of the frame, as plan_develop returns it, so that it is not computed again; may be empty
  void render(const RawFrame& frame, const DevelopPlan& plan, Picture& out, RawElectrons charge = {});
  /// Renders a frame to 8-bit codes, row by row; plan.display and plan.framing are ignored. This function and those
  /// that follow process frames of any size as a whole.
  void render(const RawFrame& frame, const DevelopPlan& plan, const RowSink& out);
  /// Renders a frame to 8-bit codes in the caller's memory; plan.display and plan.framing are ignored.
  void render(const RawFrame& frame, const DevelopPlan& plan, const PixelView& out);
  /// Renders a frame to 16-bit codes in the caller's memory, height x 3 width; plan.display and plan.framing are
  /// ignored.
  void render(const RawFrame& frame, const DevelopPlan& plan, PlaneView<std::uint16_t> out);

  /// Returns the mosaic of the active area as it is before corrections and white balance: electrons, signed, noise
  /// reduced and dark charge subtracted as planned. Valid until the next frame. Precondition: a Bayer frame,
  /// plan.levels.electrons_at_white.
  PlaneView<const float> signal(const RawFrame& frame, const DevelopPlan& plan);

  /// Returns the fraction of the image that moved, see NoiseReducer.
  double moved() const { return signal_.moved(); }

  /// Returns the noise maps of the active area of the frame rendered last; empty unless its noise was reduced and maps
  /// were requested or a look needed them.
  NoiseMaps take_noise_maps() {
    return std::exchange(has_noise_maps_, false) ? std::exchange(noise_maps_, {}) : NoiseMaps{};
  }

  /// Returns the map of seeing of the frame rendered last; absent unless the plan requested it.
  std::optional<SeeingMap> take_seeing_map() { return image_.take_seeing_map(); }

 private:
  template <class Encode>
  void render_region(const RawFrame& frame, const DevelopPlan& plan, const Region& region, const Encode& encode);
  template <class Encode>
  void render_whole(const RawFrame& frame, const DevelopPlan& plan, const Encode& encode);
  void render_tiles(const RawFrame& frame, const DevelopPlan& plan, const PictureView& out);
  void render_unframed(const RawFrame& frame, const DevelopPlan& plan, Picture& out);
  void render_shrunk(const RawFrame& frame, const DevelopPlan& plan, Picture& out);
  RgbInput camera_rgb(const RawFrame& frame, const DevelopPlan& plan, const Region& region);
  NoiseMaps* maps_of(const DevelopPlan& plan);

  Executor& executor_;
  TileLimits limits_;
  SignalStages signal_;
  ImageStages image_;
  NoiseMaps noise_maps_;  // their memory is kept for later frames that have maps
  bool has_noise_maps_ = false;
  std::optional<Picture> tile_;  // image of a tile and a few pixels around it
};

/// Returns an uninitialised image for a plan.
Picture make_picture(const DevelopPlan& plan);

}  // namespace lowlux::isp
