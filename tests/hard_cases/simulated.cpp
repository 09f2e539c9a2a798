#include "tests/hard_cases/simulated.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <span>
#include <utility>

#include "denoise/picture/resaturate.h"
#include "isp/model/sensor/photon.h"
#include "isp/pipeline/live/live_pipeline.h"

namespace lowlux::hard_cases {
namespace {

isp::NamedSensor sensor_of(const Simulated& how) {
  isp::NamedSensor sensor = test::plain_sensor();
  sensor.model.system_gain_dn_per_e = 1;
  sensor.model.full_well_e = 15000;
  sensor.model.dark_current_e_per_s.fill(how.dark_e_per_s);
  return sensor;
}

const Spectrum& light_of(const Simulated& how) {
  static const Spectrum d65 = *isp::light_named("D65");
  return how.light != nullptr ? *how.light : d65;
}

/// Mean photo-electrons of green at 1 cd/m2 in 1 s: photons of each bin times efficiency, half the way to each of its
/// neighbours wide.
double green_e_by_hand(const Simulated& how) {
  const SpectralResponse response = test::response_of(sensor_of(how));
  const Spectrum radiance = *isp::radiance_of(light_of(how), 1);
  const auto nm = radiance.wavelengths_nm();
  double sum = 0;
  for (std::size_t i = 0; i < nm.size(); ++i) {
    const double width_nm = (nm[std::min(i + 1, nm.size() - 1)] - nm[i > 0 ? i - 1 : 0]) / 2;
    const double photons = nm[i] * 1e-9 * radiance.values()[i] * width_nm / (6.62607015e-34 * 299792458);
    sum += photons * response.etendue_m2_sr * response.quantum_efficiency[1].at(nm[i]);
  }
  return sum;
}

double luminance_of(const Simulated& how) {
  return how.green_e ? *how.green_e / how.time_s / green_e_by_hand(how) : how.luminance_cd_m2;
}

Result<capture::SyntheticSource> source_of(const Simulated& how, Executor& executor) {
  capture::SceneSetup setup{how.width, how.height, light_of(how), "test", luminance_of(how)};
  capture::SyntheticOptions options;
  options.exposure = {how.time_s, how.temperature_c};
  if (!how.clips) options.effects.effects = isp::NoiseSourceSet::all().without(isp::Effect::clipping);
  const isp::NamedSensor sensor = sensor_of(how);
  auto scene = setup.luminance_cd_m2 > 0 ? capture::flat_scene(setup) : capture::dark_scene(setup);
  if (!scene) return tl::make_unexpected(scene.error());
  return capture::SyntheticSource::of(*std::move(scene), sensor, test::response_of(sensor), options, executor);
}

}  // namespace

RawFrame simulated(const Simulated& how, Denormals mode) {
  PoolExecutor pool(2);
  test::ExecutorInMode executor(pool, mode);
  return in_mode(mode, [&] {
    const auto source = source_of(how, executor);
    EXPECT_TRUE(source) << source.error().message;
    return source ? source->frame(0, executor) : RawFrame{};
  });
}

std::optional<Error> refusal_of(const Simulated& how, Denormals mode) {
  InlineExecutor executor;
  const auto source = in_mode(mode, [&] { return source_of(how, executor); });
  return source ? std::nullopt : std::optional(source.error());
}

double error_of_green(const Simulated& how, Denormals mode) {
  const double dark_e = how.dark_e_per_s * how.time_s * std::pow(2, (how.temperature_c - 20) / 7);
  const double mean_e = luminance_of(how) * how.time_s * green_e_by_hand(how) + dark_e;
  const RawFrame frame = simulated(how, mode);
  double sum = 0, count = 0;
  for (int y = 0; y < frame.raw.dn.height(); ++y) {
    for (int x = 1 - y % 2; x < frame.raw.dn.width(); x += 2) {
      sum += frame.raw.dn.at(x, y) - 512.0;
      count += 1;
    }
  }
  return std::abs(sum / count - mean_e) / std::sqrt(mean_e / count);
}

std::array<bool, 3> saturated_flags(double gain_dn_per_e, double share, Denormals mode) {
  PoolExecutor pool(2);
  test::ExecutorInMode executor(pool, mode);
  isp::NamedSensor sensor = test::plain_sensor();
  sensor.model.system_gain_dn_per_e = gain_dn_per_e;
  sensor.model.read_noise_e = 5;
  sensor.model.full_well_e = 20000;
  const double saturation_cd_m2 = 100 * isp::saturation_charge_e(sensor.model) / sensor.model.full_well_e;
  return in_mode(mode, [&] {
    auto source = capture::SyntheticSource::of(*capture::flat_scene(test::setup_of(64, 64, saturation_cd_m2 * share)),
                                               sensor, test::response_of(sensor), {}, executor);
    const RawFrame frame = source->frame(0, executor);
    Vector3 largest{};
    for (int y = 0; y < 64; ++y) {
      for (int x = 0; x < 64; ++x) {
        double& code = largest[static_cast<std::size_t>(colour_at(BayerPhase::rggb, x, y))];
        code = std::max<double>(code, frame.raw.dn.at(x, y));
      }
    }
    return isp::saturated_channels(sensor.model, largest);
  });
}

bool live_takes(isp::LiveSetup setup, const isp::LiveFacts& facts, Denormals mode) {
  setup.format = {.bits = 14};
  if (setup.width == 0) setup.width = setup.height = 64;
  setup.active = {0, 0, setup.width, setup.height};
  PoolExecutor pool(2);
  test::ExecutorInMode executor(pool, mode);
  return in_mode(mode, [&] {
    auto live = isp::LivePipeline::make(setup, executor);
    if (!live) return false;
    const Plane<std::uint16_t> dn = test::plain_frame(setup.width, setup.height).raw.dn.clone();
    (*live)->read(std::as_bytes(std::span(dn.data(), dn.size())), 2 * static_cast<std::size_t>(setup.width), facts,
                  true);
    return (*live)->plan(facts).has_value();
  });
}

isp::Xy resaturated_flat(const std::array<float, 3>& xyz, const isp::Xyz& dark, double chroma_noise, Denormals mode) {
  SceneLinear picture(9, 9);
  for (int c = 0; c < 3; ++c) std::fill_n(picture.plane[c].data(), picture.plane[c].size(), xyz[c]);
  denoise::Resaturation how;
  how.dark = dark;
  how.neutral = isp::white_e;
  how.chroma_noise = chroma_noise;
  in_mode(mode, [&] { denoise::resaturate(std::as_const(picture).view(), how, picture.view()); });
  const double x = picture.plane[0].at(4, 4), y = picture.plane[1].at(4, 4), z = picture.plane[2].at(4, 4);
  return {x / (x + y + z), y / (x + y + z)};
}

}  // namespace lowlux::hard_cases
