#pragma once

#include <array>
#include <cstddef>
#include <span>

#include "isp/base/executor.h"
#include "isp/base/frame.h"
#include "isp/base/plane.h"
#include "isp/pipeline/plan.h"
#include "isp/pipeline/render/noise_reducer.h"
#include "isp/pipeline/render/pixel_noise_reducer.h"
#include "isp/pipeline/render/region.h"

namespace lowlux::isp {

/// The first stages of a frame: makes the signal of its codes, signed, as the plan states. Owns the memory for it,
/// which the first frame of a size allocates. Every result is valid until the next one.
class SignalStages {
 public:
  explicit SignalStages(Executor& executor) : executor_(executor), noise_reducer_(executor), pixel_reducer_(executor) {}

  /// Allocates memory for mosaics of up to that size.
  void reserve(const RegionSize& largest, const NoiseReduction& how);
  /// Allocates that of noise reduction, too, for tiles of up to that size.
  void reserve_tiles(const RegionSize& largest, const NoiseReduction& how);

  /// States the charge of the whole frame that electrons() processes next, dark charge included, without lines: as
  /// plan_develop returns it. It is then not computed again. An empty plane states nothing.
  void set_charge(Plane<float> charge_e);

  /// Returns the mosaic of a region of a Bayer frame, in which the sites of Region::signal are set.
  /// @param maps  maps of the active area, filled where not null
  /// Precondition: plan.levels.electrons_at_white; maps are null, or the region is the whole frame.
  SignalElectronsView electrons(const RawFrame& frame, const DevelopPlan& plan, const Region& region, NoiseMaps* maps);

  /// Returns the mosaic of a region of a Bayer frame whose gain is unknown, and whose noise therefore stays.
  SignalFractionView fractions(const RawFrame& frame, const DevelopPlan& plan, const Region& region);

  /// Returns the planes of the active area of a frame that is not a mosaic, in fractions of white: three, or one. The
  /// noise of noisy_pixels() stays.
  std::span<Plane<float>> noisy_pixels(const RawFrame& frame, const DevelopPlan& plan);
  /// @param maps  filled where not null, a value for each pixel
  std::span<Plane<float>> pixels(const RawFrame& frame, const DevelopPlan& plan, NoiseMaps* maps);

  /// Returns the charge of the sites of the region that electrons() returned last, dark charge included, without lines.
  PlaneView<const float> charge_e() const { return raw_e_; }

  /// Returns the fraction of the image that moved, see NoiseReducer.
  double moved() const { return noise_reducer_.moved(); }

 private:
  SignalElectronsView reduce_noise(const RawFrame& frame, const NoiseReduction& how, const Region& region,
                                   NoiseMaps* maps);

  Executor& executor_;
  NoiseReducer noise_reducer_;
  PixelNoiseReducer pixel_reducer_;
  Plane<float> raw_;         // mosaic of a region before noise reduction
  bool has_charge_ = false;  // raw_ holds the charge that was set
  Plane<float> signal_;      // after it, unless the result lies in the memory of noise_reducer_
  PlaneView<float> raw_e_;
  std::array<Plane<float>, 3> planes_;  // planes of frames that are not mosaics
};

}  // namespace lowlux::isp
