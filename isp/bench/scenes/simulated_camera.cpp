#include "isp/bench/scenes/simulated_camera.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <filesystem>
#include <string>
#include <utility>

#include "capture/synthetic/sensor_sim.h"
#include "isp/model/spectrum/spectral_response.h"

namespace lowlux::isp {
namespace {

// Returns the matrix, which cannot fail for constants.
const Matrix3& rec709_to_xyz() {
  static const Matrix3 matrix = rgb_to_xyz(primaries_rec709).value();
  return matrix;
}

int blocks_of(int pixels) { return (pixels + effect_block - 1) / effect_block; }

BoxStatistics statistics_of(const PlaneView<const float>& box, BayerPhase phase) {
  BoxStatistics out;
  std::array<int, 3> count{};
  for (int y = 0; y < box.height; ++y) {
    for (int x = 0; x < box.width; ++x) {
      const auto k = static_cast<std::size_t>(colour_at(phase, x, y));
      out.mean[k] += static_cast<double>(box.at(x, y));
      ++count[k];
    }
  }
  for (std::size_t k = 0; k < 3; ++k) out.mean[k] /= count[k];
  for (int y = 0; y < box.height; ++y) {
    for (int x = 0; x < box.width; ++x) {
      const auto k = static_cast<std::size_t>(colour_at(phase, x, y));
      const double off = static_cast<double>(box.at(x, y)) - out.mean[k];
      out.variance[k] += off * off / (count[k] - 1);
    }
  }
  return out;
}

}  // namespace

NamedSensor bench_camera() {
  SensorFigures figures;
  figures.dark_current_e_per_s = {0.3, 0.3, 0.3};
  figures.prnu = 0.005;
  figures.dsnu = 0.2;
  figures.hot_pixel_fraction = 1e-5;
  figures.hot_pixel_current_e_per_s = 50;
  figures.row_noise_e = 0.05;
  figures.column_noise_e = 0.03;
  return sensor_named("ELD_NikonD850", "ISO 1600", figures).value();  // cannot fail for an entry of the table
}

NamedSensor effects_camera() {
  NamedSensor camera = bench_camera();
  camera.model.hot_pixel_fraction = 2e-4;  // a few in the smallest images too
  camera.model.telegraph_fraction = 0.01;
  camera.model.telegraph_e = 3;
  camera.model.glow_e_per_s = 5;
  camera.model.crosstalk = 0.01;
  return camera;
}

SpectralResponse bench_response() {
  return spectral_response(bench_camera(), {.f_number = 2, .white_luminance_cd_m2 = bench_full_cd_m2}).value();
}

capture::Scene bench_scene(const BenchPicture& picture, double white_cd_m2) {
  SceneLinear xyz(picture.linear.width(), picture.linear.height());
  for (std::size_t i = 0; i < xyz.plane[0].size(); ++i) {
    Vector3 rgb{};
    for (std::size_t c = 0; c < 3; ++c) rgb[c] = std::max(0.0, static_cast<double>(picture.linear.plane[c].data()[i]));
    const Vector3 light = rec709_to_xyz() * rgb;
    for (std::size_t c = 0; c < 3; ++c) xyz.plane[c].data()[i] = static_cast<float>(light[c]);
  }
  return capture::picture_scene(std::move(xyz), white_cd_m2).value();  // the image is finite and not empty
}

Result<std::vector<BenchPicture>> read_bench_pictures(const BenchOptions& options, int crop_width, int crop_height,
                                                      std::size_t most, Executor& executor) {
  auto files = files_of(options.pictures);
  if (most > 0) files = files.first(std::min(most, files.size()));
  std::vector<BenchPicture> out;
  out.reserve(files.size());
  for (const std::string_view file : files) {
    const std::string path = (std::filesystem::path(options.pictures_folder) / file).string();
    auto picture = read_bench_picture(path, crop_width, crop_height, executor);
    if (!picture) return tl::make_unexpected(picture.error());
    out.push_back(*std::move(picture));
  }
  return out;
}

NoiseSourcePlan plan_keeping(NoiseSourceSet kept, int width, int height) {
  NoiseSourcePlan plan;
  plan.regions.resize(1);
  plan.regions.front().kept = kept;
  plan.region_of_block.assign(static_cast<std::size_t>(blocks_of(width)) * blocks_of(height), 0);
  return plan;
}

RawDn even_frame(const EvenLight& light, std::uint32_t frame, Executor& executor) {
  assert(light.width > 0 && light.height > 0 && light.masked_columns >= 0 && light.masked_columns % 2 == 0);
  Plane<float> rate(light.masked_columns + light.width, light.height);
  for (int y = 0; y < rate.height(); ++y) {
    std::fill_n(rate.row(y), light.masked_columns, 0.0F);
    for (int x = light.masked_columns; x < rate.width(); ++x) {
      rate.row(y)[x] =
          static_cast<float>(light.rate_e_per_s[static_cast<std::size_t>(colour_at(BayerPhase::rggb, x, y))]);
    }
  }
  RawDn raw;
  raw.dn = Plane<std::uint16_t>(rate.width(), rate.height());
  capture::read_out({.sensor = light.sensor,
                     .exposure = light.exposure,
                     .rate_e_per_s = rate.view(),
                     .seed = light.seed,
                     .pattern_seed = light.seed,
                     .frame = frame},
                    plan_keeping(NoiseSourceSet::all(), rate.width(), rate.height()), executor, raw.dn.view());
  raw.active = {light.masked_columns, 0, light.width, light.height};
  raw.default_crop = {0, 0, light.width, light.height};
  if (light.masked_columns > 0) raw.masked = {{0, 0, light.masked_columns, light.height}};
  raw.masked_is_stated = light.masked_columns > 0;
  raw.white_dn.fill(light.sensor.white_level_dn);
  raw.info.exposure_s = light.exposure.time_s;
  raw.info.temperature_c = light.exposure.temperature_c;
  return raw;
}

std::vector<BoxStatistics> box_statistics(const PlaneView<const float>& mosaic, BayerPhase phase, int box_px) {
  assert(box_px >= 4 && box_px % 2 == 0);
  const int across = mosaic.width / box_px, down = mosaic.height / box_px;
  std::vector<BoxStatistics> out;
  out.reserve(static_cast<std::size_t>(across) * down);
  for (int y = 0; y < down; ++y) {
    for (int x = 0; x < across; ++x) {
      out.push_back(statistics_of(mosaic.crop(x * box_px, y * box_px, box_px, box_px), phase));
    }
  }
  return out;
}

Lab developed_lab(const Developing& developing, const Vector3& mean_e) {
  static const Xyz white = xyz_of(white_d65).value();  // cannot fail for a constant
  Vector3 camera{};
  for (std::size_t k = 0; k < 3; ++k) camera[k] = mean_e[k] / developing.white_e[k];
  return lab_of(xyz_of(developing.camera_to_xyz * camera), white);
}

Plane<float> charge_of(const Plane<float>& dn, const SensorModel& sensor) {
  Plane<float> out(dn.width(), dn.height());
  const auto black = static_cast<float>(sensor.black_level_dn);
  const auto e_per_dn = static_cast<float>(1 / sensor.system_gain_dn_per_e);
  std::transform(dn.data(), dn.data() + dn.size(), out.data(), [&](float v) { return (v - black) * e_per_dn; });
  return out;
}

SceneLinear binned_picture(const PlaneView<const float>& charge_e, const Developing& developing) {
  static const Matrix3 from_xyz = inverse(rec709_to_xyz()).value();  // cannot fail for constants
  const Matrix3 matrix = from_xyz * developing.camera_to_xyz;
  SceneLinear out(charge_e.width / 2, charge_e.height / 2);
  for (int y = 0; y < out.height(); ++y) {
    const float* upper = charge_e.row(2 * y);
    const float* lower = charge_e.row(2 * y + 1);
    for (int x = 0; x < out.width(); ++x) {
      Vector3 camera{static_cast<double>(upper[2 * x]),
                     (static_cast<double>(upper[2 * x + 1]) + static_cast<double>(lower[2 * x])) / 2,
                     static_cast<double>(lower[2 * x + 1])};
      for (std::size_t k = 0; k < 3; ++k) camera[k] /= developing.white_e[k];
      const Vector3 rgb = matrix * camera;
      for (std::size_t c = 0; c < 3; ++c) out.plane[c].at(x, y) = static_cast<float>(rgb[c]);
    }
  }
  return out;
}

}  // namespace lowlux::isp
