#pragma once

#include <memory>
#include <optional>
#include <utility>

#include "isp/base/executor.h"
#include "isp/base/frame.h"
#include "isp/base/image.h"
#include "isp/pipeline/plan.h"
#include "isp/pipeline/render/noise_reducer.h"
#include "isp/pipeline/render/tile_renderer.h"

namespace lowlux::isp {

/// Turns raw frames into pictures as their plans say. Owns every buffer between the two: the first frame of a size
/// allocates them, later ones of that size allocate nothing. One frame at a time.
class Pipeline {
 public:
  /// @param limits  from which size on frames go by tiles, which bounds their memory: see goes_by_tiles
  explicit Pipeline(Executor& executor, const TileLimits& limits = {})
      : executor_(executor), limits_(limits), noise_reducer_(executor), tiles_(executor, limits) {}

  /// `out` holds a picture of plan.width x plan.height of the planned sample type: see make_picture().
  void render(const RawFrame& frame, const DevelopPlan& plan, Picture& out);
  /// The picture's 8-bit codes, row by row; plan.display is not asked. This and what follows works on whole
  /// frames of any size.
  void render(const RawFrame& frame, const DevelopPlan& plan, const RowSink& out);
  /// The picture's 16-bit codes into memory of the caller's, height x 3 width; the same.
  void render(const RawFrame& frame, const DevelopPlan& plan, PlaneView<std::uint16_t> out);

  /// The mosaic of the active area as it is before corrections and white balance: electrons, signed, noise and dark
  /// charge off as planned. Valid until the next frame. Precondition: a Bayer frame, plan.levels.electrons_at_white.
  PlaneView<const float> signal(const RawFrame& frame, const DevelopPlan& plan);

  /// Share of the picture that moved, see NoiseReducer.
  double moved() const { return noise_reducer_.moved(); }

  /// Of the active area of the frame rendered last; empty unless its noise was reduced and maps were asked for or a
  /// look needed them.
  NoiseMaps take_noise_maps() {
    return std::exchange(has_noise_maps_, false) ? std::exchange(noise_maps_, {}) : NoiseMaps{};
  }

 private:
  template <class Encode>
  void render_to(const RawFrame& frame, const DevelopPlan& plan, const Encode& encode);
  void reserve(const RawFrame& frame, const DevelopPlan& plan);
  RgbInput prepare_bayer(const RawFrame& frame, const DevelopPlan& plan);
  RgbInput prepare_planes(const RawFrame& frame, const DevelopPlan& plan);
  LookGrid look_grid(const RgbInput& in, const RawFrame& frame, const DevelopPlan& plan);
  CameraPlanes as_modelled(const RgbInput& in, const DevelopPlan& plan);
  SignalElectrons signal_electrons(const RawFrame& frame, const DevelopPlan& plan);
  void float_mosaic(const RawFrame& frame, const DevelopPlan& plan);

  Executor& executor_;
  TileLimits limits_;
  NoiseReducer noise_reducer_;
  TileRenderer tiles_;
  std::unique_ptr<RawToRgb> kernel_;
  int kernel_width_ = 0;
  Plane<float> mosaic_;   // active area, black and dark off
  Plane<float> noisy_;    // before noise was reduced
  NoiseMaps noise_maps_;  // their memory stays for frames that have them again
  bool has_noise_maps_ = false;
  std::unique_ptr<NightLookGrid> look_;
  int look_width_ = 0;
  int look_height_ = 0;
  std::array<Plane<float>, 3> quarter_;  // for the look: means of 4 x 4 pixels
  Plane<float> luminance_noise_;
  std::array<Plane<float>, 3> modelled_;  // light, where a model of appearance changes it
  std::array<Plane<float>, 3> planes_;    // camera RGB of frames that need no demosaicing
  std::array<Plane<float>, 3> half_planes_;
};

/// An uninitialised picture for a plan.
Picture make_picture(const DevelopPlan& plan);

}  // namespace lowlux::isp
