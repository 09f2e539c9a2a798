#include "tests/sensor_bench/picture_raw.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <span>
#include <utility>
#include <variant>
#include <vector>

#include "capture/file/picture_colour.h"
#include "capture/file/picture_light.h"
#include "capture/file/picture_source.h"
#include "capture/synthetic/exposed_scene.h"
#include "capture/synthetic/scene.h"
#include "capture/synthetic/sensor_sim.h"
#include "isp/codec/exr.h"
#include "isp/model/sensor/noise_source_plan.h"
#include "isp/model/spectrum/spectral_lift.h"
#include "isp/model/spectrum/spectral_response.h"

namespace lowlux::test {
namespace {

Result<SpectralResponse> nikon_response() {
  isp::NamedSensor sensor;
  sensor.model.full_well_e = 30000;
  sensor.camera = "Nikon_D5100";
  return isp::spectral_response(sensor, {2, 100.0});
}

/// The picture, and of those with primaries of their own what read_picture refuses: negative light, as 0.
Result<SceneLinear> picture_xyz(const std::string& path, Executor& executor) {
  std::ifstream file(path, std::ios::binary);
  const std::string text((std::istreambuf_iterator<char>(file)), {});
  auto decoded = isp::decode_exr(std::as_bytes(std::span(text)));
  if (!decoded || !decoded->metadata.chromaticities) {
    auto picture = capture::read_picture(path, executor);
    if (!picture) return tl::make_unexpected(picture.error());
    return std::move(picture->xyz);
  }
  auto& linear = std::get<SceneLinear>(decoded->picture);
  for (Plane<float>& plane : linear.plane) {
    std::for_each(plane.data(), plane.data() + plane.size(), [](float& v) { v = std::max(v, 0.0F); });
  }
  const auto to_xyz = capture::primaries_to_xyz(*decoded->metadata.chromaticities);
  if (!to_xyz) return tl::make_unexpected(to_xyz.error());
  std::vector<std::string> warnings;
  return capture::light_of(linear, *to_xyz, Orientation::normal, executor, warnings);
}

/// Each row of `in` blurred, as a column of the result; the picture goes on as its mirror image beyond its sides.
Plane<float> blurred_and_turned(const Plane<float>& in, std::span<const double> kernel) {
  const int reach = static_cast<int>(kernel.size()) - 1, width = in.width();
  Plane<float> out(in.height(), width);
  for (int y = 0; y < in.height(); ++y) {
    for (int x = 0; x < width; ++x) {
      double sum = kernel[0] * in.at(x, y);
      for (int i = 1; i <= reach; ++i) {
        const int left = std::abs(x - i), right = std::min(x + i, 2 * (width - 1) - x - i);
        sum += kernel[i] * (in.at(std::min(left, width - 1), y) + in.at(std::max(right, 0), y));
      }
      out.at(y, x) = static_cast<float>(sum);
    }
  }
  return out;
}

/// A lens that spreads every point over a Gaussian.
void blur(SceneLinear& picture, double sigma_px) {
  std::vector<double> kernel(static_cast<std::size_t>(std::ceil(4 * sigma_px)) + 1);
  double sum = 0;
  for (std::size_t i = 0; i < kernel.size(); ++i) {
    const double z = static_cast<double>(i) / sigma_px;
    kernel[i] = std::exp(-z * z / 2);
    sum += (i == 0 ? 1 : 2) * kernel[i];
  }
  for (double& k : kernel) k /= sum;
  for (Plane<float>& plane : picture.plane) plane = blurred_and_turned(blurred_and_turned(plane, kernel), kernel);
}

}  // namespace

Result<PictureLight> picture_light(const std::string& name, Executor& executor, double lens_sigma_px,
                                   BayerPhase phase) {
  auto xyz = picture_xyz(std::string(LOWLUX_TESTDATA "/pictures/") + name, executor);
  if (!xyz) return tl::make_unexpected(xyz.error());
  if (lens_sigma_px > 0) blur(*xyz, lens_sigma_px);
  auto scene = capture::picture_scene(*std::move(xyz), 1);
  if (!scene) return tl::make_unexpected(scene.error());
  const auto response = nikon_response();
  if (!response) return tl::make_unexpected(response.error());
  const isp::LiftTable table(*response);
  PictureLight out{name, capture::charge_rate(*scene, *response, &table, phase, executor).e_per_s};
  double green = 0, pixels = 0;
  for (int y = 0; y < out.rate_e.height(); ++y) {
    for (int x = 0; x < out.rate_e.width(); ++x) {
      if (colour_at(phase, x, y) != CfaColour::green) continue;
      green += out.rate_e.at(x, y);
      pixels += 1;
    }
  }
  const auto scale = static_cast<float>(pixels / green);
  for (std::size_t i = 0; i < out.rate_e.size(); ++i) out.rate_e.data()[i] *= scale;
  return out;
}

RawDn take_picture(const PictureLight& light, const SensorModel& sensor, const PictureShot& shot, Executor& executor) {
  const int width = shot.crop > 0 ? shot.crop : light.rate_e.width() & ~1;
  const int height = shot.crop > 0 ? shot.crop : light.rate_e.height() & ~1;
  const int left = (light.rate_e.width() - width) / 2 & ~1, top = (light.rate_e.height() - height) / 2 & ~1;
  Plane<float> rate(width, height);
  const auto per_s = static_cast<float>(shot.mean_green_e / shot.dark_time_s);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) rate.at(x, y) = per_s * light.rate_e.at(left + x, top + y);
  }
  isp::NoiseSourcePlan plan;
  plan.regions.resize(1);  // one region that keeps every effect
  const auto blocks = [](int pixels) { return (pixels + isp::effect_block - 1) / isp::effect_block; };
  plan.region_of_block.assign(static_cast<std::size_t>(blocks(width)) * blocks(height), 0);
  RawDn raw;
  raw.dn = Plane<std::uint16_t>(width, height);
  capture::read_out({.sensor = sensor,
                     .exposure = {.time_s = shot.dark_time_s, .temperature_c = sensor.dark_temperature_c},
                     .phase = BayerPhase::rggb,
                     .rate_e_per_s = rate.view(),
                     .seed = shot.seed,
                     .pattern_seed = shot.seed},
                    plan, executor, raw.dn.view());
  raw.active = raw.default_crop = {0, 0, width, height};
  raw.white_dn = {sensor.white_level_dn, sensor.white_level_dn, sensor.white_level_dn};
  return raw;
}

}  // namespace lowlux::test
