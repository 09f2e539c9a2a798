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
#include "isp/reproduce/bench_picture.h"
#include "isp/model/colour/colorimetry.h"
#include "isp/model/sensor/effect_plan.h"
#include "isp/model/sensor/sensor_db.h"

/// The camera in front of which the stages of simulation and calibration put their scenes, and what they see of it.
namespace lowlux::isp {

/// ELD_NikonD850 at ISO 1600, with figures for the effects its source says nothing of: every effect there is.
NamedSensor bench_camera();

/// Its response: a white of bench_full_cd_m2 under D65 fills it in 1 s.
SpectralResponse bench_response();
inline constexpr double bench_full_cd_m2 = 100;

/// A picture whose white has a luminance; bench_response() makes a charge of it.
capture::Scene bench_scene(const BenchPicture& picture, double white_cd_m2);

/// The lights pictures are taken in: white gives about 1200, 24 and 2.4 e-; the last is exposed so long that dark
/// current shows.
struct SceneLight {
  const char* name;
  double white_cd_m2;
  double time_s;

  Exposure exposure() const { return {.time_s = time_s, .temperature_c = 20}; }
};
inline constexpr std::array scene_lights{SceneLight{"bright", 1500, 1.0 / 30}, SceneLight{"dim", 30, 1.0 / 30},
                                         SceneLight{"very dark", 0.1, 1}};

/// The middle of the pictures that were asked for.
/// @param most  of them, the first ones; 0: all
Result<std::vector<BenchPicture>> read_bench_pictures(const BenchOptions& options, int crop_width, int crop_height,
                                                      std::size_t most, Executor& executor);

/// A plan that keeps these effects in every block of a frame of that size.
EffectPlan plan_keeping(EffectSet kept, int width, int height);

/// Even light on a sensor, all of its effects included; RGGB.
struct EvenLight {
  SensorModel sensor;
  Exposure exposure;
  std::array<double, 3> rate_e_per_s{};  // of R, G and B
  int width = 0;                         // of the active area
  int height = 0;
  int masked_columns = 0;  // dark ones beside it, on the left; even
  std::uint64_t seed = 1;
};

/// Frame number `frame` of it: the fixed pattern of the seed, and noise of its own.
RawDn even_frame(const EvenLight& light, std::uint32_t frame, Executor& executor);

/// Mean and variance of the R, G and B pixels of a box.
struct BoxStatistics {
  Vector3 mean{};
  Vector3 variance{};
};

/// Of all whole boxes of a mosaic, row by row. @param box_px  even
std::vector<BoxStatistics> box_statistics(const PlaneView<const float>& mosaic, BayerPhase phase, int box_px);

/// What a mean charge above the pedestal is developed to.
Lab developed_lab(const Developing& developing, const Vector3& mean_e);

/// Charge above the pedestal [e-] of values in DN.
Plane<float> charge_of(const Plane<float>& dn, const SensorModel& sensor);

/// A mosaic of charge [e-] as a picture of half its size, one pixel for each cell of 2 x 2: linear Rec. 709, signed.
SceneLinear binned_picture(const PlaneView<const float>& charge_e, const Developing& developing);

}  // namespace lowlux::isp
