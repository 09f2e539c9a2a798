#pragma once

#include <memory>
#include <optional>
#include <utility>

#include "isp/base/executor.h"
#include "isp/base/frame.h"
#include "isp/base/image.h"
#include "isp/pipeline/plan.h"
#include "isp/pipeline/render/noise_reducer.h"
#include "isp/pipeline/render/pixel_noise_reducer.h"
#include "isp/pipeline/render/tile_renderer.h"

namespace lowlux::isp {

/// Holds the probability of seeing of each cell of 4 x 4 pixels, and the fraction of cells above 0.5.
struct SeeingMap {
  Plane<float> probability;
  double seen_fraction = 0;
};

/// Renders raw frames to images as their plans state. Owns every buffer between the two: the first frame of a size
/// allocates them, later ones of that size allocate nothing. Processes one frame at a time.
class Pipeline {
 public:
  /// @param limits  from which size on frames are rendered in tiles, which bounds their memory: see is_tiled
  explicit Pipeline(Executor& executor, const TileLimits& limits = {})
      : executor_(executor),
        limits_(limits),
        noise_reducer_(executor),
        pixel_reducer_(executor),
        tiles_(executor, limits) {}

  /// Renders a frame to `out`, an image of the planned size and sample type: see make_picture(). Images that are
  /// cropped or shrunk allocate memory for the image before that.
  void render(const RawFrame& frame, const DevelopPlan& plan, Picture& out);
  /// Renders a frame to 8-bit codes, row by row; plan.display and plan.framing are ignored. This function and those
  /// that follow process frames of any size as a whole.
  void render(const RawFrame& frame, const DevelopPlan& plan, const RowSink& out);
  /// Renders a frame to 16-bit codes in the caller's memory, height x 3 width; plan.display and plan.framing are
  /// ignored.
  void render(const RawFrame& frame, const DevelopPlan& plan, PlaneView<std::uint16_t> out);

  /// Returns the mosaic of the active area as it is before corrections and white balance: electrons, signed, noise
  /// reduced and dark charge subtracted as planned. Valid until the next frame. Precondition: a Bayer frame,
  /// plan.levels.electrons_at_white.
  PlaneView<const float> signal(const RawFrame& frame, const DevelopPlan& plan);

  /// Returns the fraction of the image that moved, see NoiseReducer.
  double moved() const { return noise_reducer_.moved(); }

  /// Returns the noise maps of the active area of the frame rendered last; empty unless its noise was reduced and maps
  /// were requested or a look needed them.
  NoiseMaps take_noise_maps() {
    return std::exchange(has_noise_maps_, false) ? std::exchange(noise_maps_, {}) : NoiseMaps{};
  }

  /// Returns the map of seeing of the frame rendered last; absent unless the plan requested it.
  std::optional<SeeingMap> take_seeing_map() { return std::exchange(seeing_, std::nullopt); }

 private:
  template <class Encode>
  void render_to(const RawFrame& frame, const DevelopPlan& plan, const Encode& encode);
  void render_all(const RawFrame& frame, const DevelopPlan& plan, Picture& out);
  void render_shrunk(const RawFrame& frame, const DevelopPlan& plan, Picture& out);
  void reserve_kernel(int width);
  void reserve(const RawFrame& frame, const DevelopPlan& plan);
  RgbInput prepare_bayer(const RawFrame& frame, const DevelopPlan& plan);
  RgbInput prepare_planes(const RawFrame& frame, const DevelopPlan& plan);
  CameraPlanes finished_planes(const RgbInput& in, const RawFrame& frame, const DevelopPlan& plan);
  void sharpen(const RawFrame& frame, const DevelopPlan& plan, const RgbView<float>& planes);
  void measure_cells(const RgbInput& in, const RawFrame& frame, const DevelopPlan& plan);
  RgbView<const float> quarter_view() const;
  void map_seeing_of(const DevelopPlan& plan);
  LookGrid look_grid(const DevelopPlan& plan);
  CameraPlanes as_modelled(const RgbInput& in, const DevelopPlan& plan);
  SignalElectrons signal_electrons(const RawFrame& frame, const DevelopPlan& plan);
  void float_mosaic(const RawFrame& frame, const DevelopPlan& plan);

  Executor& executor_;
  TileLimits limits_;
  NoiseReducer noise_reducer_;
  PixelNoiseReducer pixel_reducer_;
  TileRenderer tiles_;
  std::unique_ptr<RawToRgb> kernel_;
  int kernel_width_ = 0;
  Plane<float> mosaic_;   // active area, black and dark charge subtracted
  Plane<float> noisy_;    // active area before noise reduction
  NoiseMaps noise_maps_;  // their memory is kept for later frames that have maps
  bool has_noise_maps_ = false;
  std::unique_ptr<NightLookGrid> look_;
  int look_width_ = 0;
  int look_height_ = 0;
  std::array<Plane<float>, 3> quarter_;  // for the look: means of 4 x 4 pixels
  Plane<float> luminance_noise_;         // variance, for the cells of quarter_
  Plane<float> signal_to_noise_;         // for the cells of quarter_
  std::optional<SeeingMap> seeing_;
  std::array<Plane<float>, 3> finished_;  // white-balanced camera RGB, highlights rebuilt or sharpened
  std::array<Plane<float>, 3> modelled_;  // light as changed by a model of appearance
  std::array<Plane<float>, 3> planes_;    // camera RGB of frames that need no demosaicing
  std::array<Plane<float>, 3> half_planes_;
};

/// Returns an uninitialised image for a plan.
Picture make_picture(const DevelopPlan& plan);

}  // namespace lowlux::isp
