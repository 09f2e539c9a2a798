#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "capture/synthetic/scene.h"
#include "isp/base/cfa.h"
#include "isp/base/executor.h"
#include "isp/base/frame.h"
#include "isp/base/plane.h"
#include "isp/base/result.h"
#include "isp/base/sensor.h"
#include "isp/bench/bench_stages.h"
#include "isp/model/colour/colorimetry.h"
#include "isp/model/sensor/noise_source_plan.h"
#include "isp/model/sensor/sensor_db.h"
#include "isp/reproduce/bench_picture.h"

/// Camera of the stages of simulation and calibration, and the scenes in front of it.
namespace lowlux::isp {

/// Returns ELD_NikonD850 at ISO 1600, with assumed values for effects missing in its source: all are simulated.
NamedSensor bench_camera();

/// Returns bench_camera() with assumed values for the effects that are absent or rare in other stages' frames: hot
/// pixels, random telegraph noise, amplifier glow and crosstalk.
NamedSensor effects_camera();
inline constexpr double effects_lens_px = 0.5;  // blur of the lens in front of it, in addition to that of the images

/// Returns the response of both: a white of bench_full_cd_m2 under D65 fills it in 1 s.
SpectralResponse bench_response();
inline constexpr double bench_full_cd_m2 = 100;

/// Returns the scene of an image whose white has a luminance; bench_response() converts it to charge.
capture::Scene bench_scene(const BenchPicture& picture, double white_cd_m2);

/// Lights of the scenes: white gives about 1200, 24 and 2.4 e-; the exposure of the last is long enough for dark
/// current to matter.
struct BenchLight {
  const char* name;
  double white_cd_m2;
  double time_s;

  Exposure exposure() const { return {.time_s = time_s, .temperature_c = 20}; }
};
inline constexpr std::array bench_lights{BenchLight{"bright", 1500, 1.0 / 30}, BenchLight{"dim", 30, 1.0 / 30},
                                         BenchLight{"very dark", 0.1, 1}};

/// Reads central crops of the requested images.
/// @param most  number of images, the first ones; 0: all
Result<std::vector<BenchPicture>> read_bench_pictures(const BenchOptions& options, int crop_width, int crop_height,
                                                      std::size_t most, Executor& executor);

/// Returns a plan that keeps these effects in every block of a frame of that size.
NoiseSourcePlan plan_keeping(NoiseSourceSet kept, int width, int height);

/// Uniform light on a sensor, all of its effects included; RGGB.
struct EvenLight {
  SensorModel sensor;
  Exposure exposure;
  std::array<double, 3> rate_e_per_s{};  // rates of R, G and B
  int width = 0;                         // width of the active area
  int height = 0;
  int masked_columns = 0;  // dark columns to the left of it; even
  std::uint64_t seed = 1;
};

/// Returns frame number `frame` of the light: the fixed pattern of the seed, and noise of its own.
RawDn even_frame(const EvenLight& light, std::uint32_t frame, Executor& executor);

/// Mean and variance of the R, G and B pixels of a box.
struct BoxStatistics {
  Vector3 mean{};
  Vector3 variance{};
};

/// Returns the statistics of all complete boxes of a mosaic, row by row. @param box_px  even
std::vector<BoxStatistics> box_statistics(const PlaneView<const float>& mosaic, BayerPhase phase, int box_px);

/// Returns the colour that a mean charge above the pedestal is developed to.
Lab developed_lab(const Developing& developing, const Vector3& mean_e);

/// Returns the charge above the pedestal [e-] of values in DN.
Plane<float> charge_of(const Plane<float>& dn, const SensorModel& sensor);

/// Returns a mosaic of charge [e-] as a half-size image, one pixel per cell of 2 x 2: linear Rec. 709, signed.
SceneLinear binned_picture(const PlaneView<const float>& charge_e, const Developing& developing);

}  // namespace lowlux::isp
