#include "isp/bench/scenes/develop_scene.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <utility>

#include "capture/synthetic/scene.h"
#include "capture/synthetic/synthetic_source.h"
#include "isp/model/sensor/noise_source_plan.h"
#include "isp/model/sensor/sensor_db.h"
#include "isp/model/spectrum/spectral_response.h"

namespace lowlux::isp {
namespace {

constexpr double white_cd_m2 = 100;
constexpr int masked_columns = 64;
constexpr double exposure_s = 1;

NamedSensor sensor_of(const DevelopLight& light) {
  NamedSensor out;
  out.camera = "Nikon_D5100";
  out.gain_setting = light.name;
  out.model = {.name = "bench",
               .system_gain_dn_per_e = light.gain_dn_per_e,
               .read_noise_e = light.read_noise_e,
               .full_well_e = 1.1 * 15871 / light.gain_dn_per_e,
               .bits = 14,
               .black_level_dn = 512,
               .white_level_dn = 16383,
               .dark_current_e_per_s = {light.dark_e, light.dark_e, light.dark_e},
               .prnu = 0.005,
               .dsnu = 0.01,
               .hot_pixel_fraction = 2e-4,
               .hot_pixel_current_e_per_s = 40 * (light.mean_e + light.read_noise_e),
               .row_noise_e = 0.2 * light.read_noise_e,
               .column_noise_e = 0.1 * light.read_noise_e};
  return out;
}

Result<capture::SyntheticSource> source_of(const BenchPicture& picture, const DevelopLight& light, double luminance,
                                           const capture::SyntheticOptions& options, Executor& executor) {
  const Matrix3 to_xyz = rgb_to_xyz(primaries_rec709).value();  // cannot fail for constants
  SceneLinear xyz(picture.linear.width() & ~1, picture.linear.height() & ~1);
  for (int y = 0; y < xyz.height(); ++y) {
    for (int x = 0; x < xyz.width(); ++x) {
      Vector3 rgb{};
      for (std::size_t c = 0; c < 3; ++c) rgb[c] = picture.linear.plane[c].at(x, y);
      const Vector3 v = to_xyz * rgb;
      for (std::size_t c = 0; c < 3; ++c) xyz.plane[c].at(x, y) = static_cast<float>(v[c]);
    }
  }
  auto scene = capture::picture_scene(std::move(xyz), luminance);
  if (!scene) return tl::make_unexpected(scene.error());
  const NamedSensor sensor = sensor_of(light);
  const auto response = spectral_response(sensor, {2, white_cd_m2});
  if (!response) return tl::make_unexpected(response.error());
  return capture::SyntheticSource::of(*std::move(scene), sensor, *response, options, executor);
}

double mean_of(const Plane<float>& plane, int first_column) {
  double sum = 0, pixels = 0;
  for (int y = 0; y < plane.height(); ++y) {
    for (int x = first_column; x < plane.width(); ++x, ++pixels) sum += static_cast<double>(plane.at(x, y));
  }
  return sum / pixels;
}

/// Returns a demosaiced frame of mean electrons, with the colour and crop of a mosaic of the same scene.
RawFrame demosaiced_frame(const CameraRgb& signal_e, const RawFrame& mosaic, const DevelopLight& light) {
  constexpr double black_dn = 2048, white_dn = 65535;
  const NamedSensor sensor = sensor_of(light);
  const double white_e =
      (sensor.model.white_level_dn - sensor.model.black_level_dn) / sensor.model.system_gain_dn_per_e;
  const Rect& active = mosaic.raw.active;
  RawFrame out;
  out.raw.dn = Plane<std::uint16_t>(3 * active.width, active.height);
  for (int y = 0; y < active.height; ++y) {
    for (int x = 0; x < active.width; ++x) {
      for (int c = 0; c < 3; ++c) {
        const double e = signal_e.plane[static_cast<std::size_t>(c)].at(x, y);
        const double dn = black_dn + e / white_e * (white_dn - black_dn);
        out.raw.dn.at(3 * x + c, y) = static_cast<std::uint16_t>(std::lround(std::clamp(dn, 0.0, white_dn)));
      }
    }
  }
  out.raw.layout = SensorLayout::linear_rgb;
  out.raw.active = out.raw.default_crop = {0, 0, active.width, active.height};
  out.raw.black_tag = BlackLevel{.pattern_dn = {black_dn}};
  out.raw.white_dn.fill(white_dn);
  out.raw.info = mosaic.raw.info;
  out.colour = mosaic.colour;
  return out;
}

}  // namespace

std::vector<DevelopLight> develop_lights(bool quick) {
  const std::vector<DevelopLight> all{
      {.name = "2000 e-", .mean_e = 2000, .dark_e = 2, .read_noise_e = 1.5, .gain_dn_per_e = 0.5, .scene_cd_m2 = 5},
      {.name = "20 e-", .mean_e = 20, .dark_e = 2, .read_noise_e = 1.5, .gain_dn_per_e = 16, .scene_cd_m2 = 0.05},
      {.name = "4 e- over 200 e-",
       .mean_e = 4,
       .dark_e = 200,
       .read_noise_e = 4,
       .gain_dn_per_e = 16,
       .scene_cd_m2 = 0.01}};
  return quick ? std::vector<DevelopLight>{all[1]} : all;
}

Result<SimulatedRaws> simulated_raws(const BenchPicture& picture, const DevelopLight& light, std::uint64_t seed,
                                     Executor& executor) {
  capture::SyntheticOptions options{.exposure = {.time_s = exposure_s, .temperature_c = 20},
                                    .masked_columns = masked_columns,
                                    .seed = seed,
                                    .sensor_seed = seed};
  options.effects.effects = NoiseSourceSet{};
  const auto probe = source_of(picture, light, 1, options, executor);
  if (!probe) return tl::make_unexpected(probe.error());
  const double luminance = light.mean_e / (exposure_s * mean_of(probe->light().e_per_s, masked_columns));
  const auto mean = source_of(picture, light, luminance, options, executor);
  if (!mean) return tl::make_unexpected(mean.error());
  options.effects.effects = NoiseSourceSet::all();
  const auto noisy = source_of(picture, light, luminance, options, executor);
  if (!noisy) return tl::make_unexpected(noisy.error());
  SimulatedRaws out{noisy->frame(0, executor), mean->frame(0, executor), {}};
  out.truth = demosaiced_frame(mean->signal_e(executor), out.mean, light);
  return out;
}

double true_black_dn(const RawFrame& noisy, const DevelopLight& light) {
  return noisy.raw.black_tag->pattern_dn[0] + light.dark_e * light.gain_dn_per_e;
}

double noisy_exposure_ev(const RawFrame& noisy, const DevelopLight& light, double exposure_ev) {
  const double white_dn = noisy.raw.white_dn[0], pedestal_dn = noisy.raw.black_tag->pattern_dn[0];
  return exposure_ev + std::log2((white_dn - true_black_dn(noisy, light)) / (white_dn - pedestal_dn));
}

RawFrame tiled(const RawFrame& frame, int width, int height) {
  const Rect& area = frame.raw.active;
  assert(area.width % 2 == 0 && area.height % 2 == 0);
  RawFrame out;
  out.raw.dn = Plane<std::uint16_t>(width, height);
  for (int y = 0; y < height; ++y) {
    const std::uint16_t* const from = frame.raw.dn.row(area.y + y % area.height) + area.x;
    for (int x = 0; x < width; x += area.width) {
      std::copy_n(from, std::min(area.width, width - x), out.raw.dn.row(y) + x);
    }
  }
  out.raw.phase = frame.raw.phase;
  out.raw.active = out.raw.default_crop = {0, 0, width, height};
  out.raw.black_tag = frame.raw.black_tag;
  out.raw.white_dn = frame.raw.white_dn;
  out.raw.info = frame.raw.info;
  out.colour = frame.colour;
  out.noise = frame.noise;
  return out;
}

}  // namespace lowlux::isp
