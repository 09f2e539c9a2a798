#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "capture/synthetic/burst_motion.h"
#include "capture/synthetic/exposed_sensor.h"
#include "capture/synthetic/light_grid.h"
#include "capture/synthetic/scene.h"
#include "capture/synthetic/synthetic_camera.h"
#include "isp/base/executor.h"
#include "isp/base/frame.h"
#include "isp/base/image.h"
#include "isp/base/matrix3.h"
#include "isp/base/plane.h"
#include "isp/base/result.h"
#include "isp/base/sensor.h"
#include "isp/model/sensor/sensor_db.h"
#include "isp/model/spectrum/spectral_lift.h"

namespace lowlux::capture {

/// Holds the true motion and content of one frame of a burst.
struct BurstTruth {
  RigidMotion motion;         // motion of the scene from frame 0 to this frame; with a horizon, of the sky above it
  RigidMotion camera_motion;  // motion of the foreground, and the origin of the motion of objects
  double exposure_s = 0;
  std::vector<ImageBox> movers;  // in the coordinates of frame 0, not cut to the image
};

/// A point source as one frame has it.
struct BurstPoint {
  ImagePoint place;
  double spread_px = 0;  // standard deviation, the blur of the lens included
  Vector3 signal_e{};    // all of its light in the frame's exposure time, under the filters R, G and B
};

struct BurstView;

/// A camera that takes a burst of frames of one scene, see BurstOptions. Frame i is a pure function of the options and
/// of i: any index, in any order, the same for every number of threads. Frames are instants: nothing is blurred by
/// motion.
class BurstSource {
 public:
  /// Makes a source. With a reduction, the image is smaller than the scene by it, and the scene's points and star
  /// fields are in pixels of the image.
  /// Errors: those of make_camera and check_burst; points without position or spread; published sampling; an exposure
  /// time of the bracket outside the range of exposures.
  static Result<BurstSource> of(Scene scene, isp::NamedSensor sensor, SpectralResponse response,
                                const SyntheticOptions& options, const BurstOptions& burst, Executor& executor);

  ImageSize size() const { return size_; }
  std::int64_t moved_pixels() const { return moved_pixels_; }  // see ChargeRate

  /// Returns the sensor under the light of a frame. Errors: those of ExposedSensor::of.
  Result<ExposedSensor> exposed(std::uint32_t index, Executor& executor) const;
  /// Returns a frame as its file has it. Errors: those of exposed().
  Result<RawFrame> frame(std::uint32_t index, Executor& executor) const;

  /// The truth of a frame: its motion and exposure; its points, those outside of the image included whose light reaches
  /// into it, without those that the foreground or a moving object hides.
  BurstTruth truth(std::uint32_t index) const;
  std::vector<BurstPoint> points(std::uint32_t index) const;

  /// The noise-free truth of a frame, with the blur of the lens if that is simulated: mean signal electrons under each
  /// pixel's own filter, and of R, G and B at every pixel, in its own exposure time; and the XYZ of the scene [cd/m2].
  Plane<float> mosaic_e(std::uint32_t index, Executor& executor) const;
  CameraRgb signal_e(std::uint32_t index, Executor& executor) const;
  SceneLinear xyz_cd_m2(std::uint32_t index, Executor& executor) const;

 private:
  /// Light of the scene on a grid, the sky apart from the foreground.
  struct Grids {
    std::unique_ptr<LightGrid> sky, foreground;
  };

  BurstSource(Scene scene, SpectralResponse response, SyntheticCamera camera, const BurstOptions& burst);
  Grids grids_of(const RgbView<const float>& samples, Executor& executor) const;
  BurstView view_of(const Grids& grids, std::uint32_t index) const;
  SensorLight light(std::uint32_t index, Executor& executor) const;
  CameraRgb rate_rgb_e_per_s(std::uint32_t index, Executor& executor) const;
  std::vector<PointSource> points_in_frame(std::uint32_t index) const;
  std::vector<PointSource> stars_around(const RigidMotion& motion) const;

  Scene scene_;
  SpectralResponse response_;
  SyntheticCamera camera_;
  BurstOptions burst_;
  ImageSize size_;
  std::vector<Mover> movers_;
  std::unique_ptr<isp::LiftTable> table_;  // for scenes whose spectra are lifted
  std::int64_t moved_pixels_ = 0;
  Grids grids_;         // charge rates [e- per s]; none without a reduction
  Plane<float> still_;  // charge rate of all frames without a reduction, and without points
};

}  // namespace lowlux::capture
