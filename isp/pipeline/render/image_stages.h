#pragma once

#include <array>
#include <memory>
#include <optional>
#include <utility>

#include "isp/base/executor.h"
#include "isp/base/frame.h"
#include "isp/base/image.h"
#include "isp/base/look_grid.h"
#include "isp/pipeline/plan.h"
#include "isp/pipeline/render/region.h"
#include "isp/raw/kernel/raw_to_rgb.h"
#include "isp/render/night/night_look.h"

namespace lowlux::isp {

/// Holds the probability of seeing of each cell of 4 x 4 pixels, and the fraction of cells above 0.5.
struct SeeingMap {
  Plane<float> probability;
  double seen_fraction = 0;
};

/// The last stages of a frame: makes an image of a mosaic or of camera RGB. Owns the memory for it, which the first
/// frame of a size allocates. Every result is valid until the next one.
class ImageStages {
 public:
  explicit ImageStages(Executor& executor) : executor_(executor) {}

  /// Holds what remains to be done in the one pass of the kernel: demosaicing if `in` is a mosaic, and `transform`.
  struct Light {
    RgbInput in;
    RgbTransform transform;
  };

  /// Allocates memory for regions of up to that size.
  void reserve(const RegionSize& largest, const DevelopPlan& plan);
  /// Returns the kernel, for images of at least that width.
  RawToRgb& kernel(int width);

  /// Returns camera RGB of half the size: each cell of a mosaic, or 2 x 2 pixels, become one pixel.
  CameraPlanes halve(const RgbInput& in);

  /// Rebuilds highlights, sharpens and changes local tone, as planned; returns white-balanced camera RGB. Precondition:
  /// finishes(plan).
  CameraPlanes finish(const RgbInput& in, const RawFrame& frame, const DevelopPlan& plan, const NoiseMaps& maps);

  /// Changes the light as the plan's look or profile requests, and returns what remains to be done.
  /// @param maps  maps of the active area, read where noise was reduced and the look needs it
  Light look(const RgbInput& in, const RawFrame& frame, const DevelopPlan& plan, const NoiseMaps& maps);

  /// Returns the map of seeing of the frame rendered last; absent unless the plan requested it.
  std::optional<SeeingMap> take_seeing_map() { return std::exchange(seeing_, std::nullopt); }

 private:
  void sharpen(const RawFrame& frame, const DevelopPlan& plan, const NoiseMaps& maps, const RgbView<float>& planes);
  void change_local_tone(const RawFrame& frame, const DevelopPlan& plan, const NoiseMaps& maps,
                         const RgbView<float>& planes);
  void measure_cells(const RgbInput& in, const RawFrame& frame, const DevelopPlan& plan, const NoiseMaps& maps);
  RgbView<const float> quarter_view() const;
  void map_seeing_of(const DevelopPlan& plan);
  const LookGrid* look_grid(const Rect& crop, const DevelopPlan& plan);
  CameraPlanes through_table(const RgbInput& in, const DevelopPlan& plan);
  CameraPlanes through_profile(const RgbInput& in, const DevelopPlan& plan);

  Executor& executor_;
  std::unique_ptr<RawToRgb> kernel_;
  int kernel_width_ = 0;
  std::array<Plane<float>, 3> half_;
  std::array<Plane<float>, 3> finished_;  // white-balanced camera RGB, finished
  std::array<Plane<float>, 3> modelled_;  // light as changed by a model of appearance or a profile
  std::array<Plane<float>, 3> quarter_;   // for the look: means of 4 x 4 pixels
  Plane<float> luminance_noise_;          // variance, for the cells of quarter_
  Plane<float> plain_noise_;              // luminance_noise_ as it is in plain areas
  Plane<float> signal_to_noise_;          // for the cells of quarter_
  std::unique_ptr<NightLookGrid> look_;
  int look_width_ = 0;
  int look_height_ = 0;
  LookGrid grid_;
  std::optional<SeeingMap> seeing_;
};

/// Returns the transform that remains for planes that are already light in the image's primaries.
RgbTransform transform_of_light(const DevelopPlan& plan, const LookGrid* look);

}  // namespace lowlux::isp
