#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <deque>
#include <optional>
#include <random>
#include <utility>
#include <vector>

#include "capture/synthetic/readout.h"
#include "isp/model/sensor/exposure_controller.h"
#include "isp/raw/measure/exposure_meter.h"

namespace lowlux::test {

/// A scene of few levels in front of a simulated sensor whose controls take effect late: for closed loops of
/// isp::ExposureController.
struct MeteredCamera {
  static constexpr int width = 192, height = 128;

  /// Part of the scene's area, and electrons per second of its green pixels for light 1.
  struct Level {
    double area = 0;
    double e_per_s = 0;
  };

  isp::ExposureController::Setup setup;
  RawFormat format{12, RawPacking::little16, SensorLayout::bayer, BayerPhase::rggb};
  std::vector<Level> scene;
  std::array<double, 4> channel{0.6, 1, 1, 0.5};  // of the sites, relative to green
  double light = 1;
  double flicker_depth = 0, flicker_hz = 100, frame_s = 1.0 / 30;
  int latency = 2;
  bool states = false;  // the exposure of each frame
  std::uint64_t seed = 0;

  std::deque<isp::ExposureSetting> waiting;  // settings not in effect yet
  std::uint32_t frame = 0;

  /// Returns the light of a frame: the mean of 1 + depth cos(2 pi F t) over its exposure.
  double light_of_frame(double exposure_s) const {
    const double pi = 3.14159265358979323846, begin_s = frame * frame_s;
    const double a = 2 * pi * flicker_hz;
    const double ripple = (std::sin(a * (begin_s + exposure_s)) - std::sin(a * begin_s)) / (a * exposure_s);
    return light * (1 + flicker_depth * ripple);
  }

  /// Returns the largest light of frames of a given exposure, relative to `light`.
  double peak(double exposure_s) const {
    const double a = 3.14159265358979323846 * flicker_hz * exposure_s;
    return 1 + flicker_depth * std::abs(std::sin(a) / a);
  }

  /// Reads out one frame and lets the controller decide.
  void step(isp::ExposureController& controller, isp::ExposureMeter& meter) {
    const isp::ExposureSetting at = waiting.size() > static_cast<std::size_t>(latency) ? take_one() : waiting.front();
    const SensorModel& sensor = setup.gains[at.gain].sensor;
    read_out(at, meter);
    PerSite<double> black{};
    black.fill(sensor.black_level_dn);
    std::optional<isp::StatedExposure> stated;
    if (states) stated = {at.exposure_s, setup.gains[at.gain].factor};
    controller.take(meter.codes({black}, sensor.white_level_dn, setup.limits.clipped_fraction), stated);
    waiting.push_back(controller.setting());
    in_effect = at;
    ++frame;
  }

  isp::ExposureSetting in_effect;

  isp::MeteredLight truth() const {
    double highlight = 0;
    for (const Level& level : scene) highlight = std::max(highlight, level.e_per_s);
    return {light * scene.front().e_per_s, light * highlight};
  }

  /// Returns the expected fraction of the pixels of green beyond the code that highlights may reach.
  double clipped_fraction(const isp::ExposureSetting& at, double brightness = 1) const {
    const isp::GainStep& gain = setup.gains[at.gain];
    const SensorModel& s = gain.sensor;
    const double range_e = (s.white_level_dn - s.black_level_dn) / s.system_gain_dn_per_e;
    double out = 0;
    for (const Level& level : scene) {
      const double mean_e =
          (brightness * light * level.e_per_s + isp::dark_e_per_s(gain, setup.limits)) * at.exposure_s;
      const auto above = [&](double limit_e, double noise_e) {
        return 0.5 * std::erfc((limit_e - mean_e) / std::sqrt(2 * (mean_e + noise_e * noise_e)));
      };
      out +=
          level.area * std::max(above((1 - isp::metering_headroom) * range_e, s.read_noise_e), above(s.full_well_e, 0));
    }
    return out;
  }

 private:
  isp::ExposureSetting take_one() {
    const isp::ExposureSetting out = waiting.front();
    waiting.pop_front();
    return out;
  }

  void read_out(const isp::ExposureSetting& at, isp::ExposureMeter& meter) const {
    const isp::GainStep& gain = setup.gains[at.gain];
    const SensorModel& s = gain.sensor;
    const capture::ReadoutParameters parameters{.full_well_e = static_cast<float>(s.full_well_e),
                                                .read_noise_e = static_cast<float>(s.read_noise_e),
                                                .gain_dn_per_e = static_cast<float>(s.system_gain_dn_per_e),
                                                .black_dn = static_cast<float>(s.black_level_dn),
                                                .max_dn = static_cast<float>(s.white_level_dn)};
    const double now = light_of_frame(at.exposure_s);
    const double dark = isp::dark_e_per_s(gain, setup.limits);
    std::vector<float> mean(width);
    std::vector<std::uint16_t> dn(width);
    meter.clear();
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x) {
        const double e_per_s = now * level_at(x / 2, y / 2) * channel[static_cast<std::size_t>(site_of(x, y))] + dark;
        mean[static_cast<std::size_t>(x)] = static_cast<float>(std::min(e_per_s * at.exposure_s, 9e5));
      }
      capture::read_out_row({.seed = seed, .frame = frame}, 0, static_cast<std::uint32_t>(y), {mean, {}, {}},
                            parameters, dn);
      meter.add_row(dn.data(), width, y);
    }
  }

  /// Levels lie in strips, each of its area.
  double level_at(int x, int y) const {
    double place = (y * (width / 2) + x + 0.5) / (width / 2 * height / 2);
    for (const Level& level : scene) {
      if (place < level.area) return level.e_per_s;
      place -= level.area;
    }
    return scene.back().e_per_s;
  }
};

/// Draws a camera: gains in few or many steps, times in lines or 100 us, sensors of 10 and 12 bits.
inline MeteredCamera drawn_camera(std::mt19937& random) {
  const auto uniform = [&](double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random);
  };
  const auto one_of = [&](int count) { return std::uniform_int_distribution<int>(0, count - 1)(random); };
  MeteredCamera camera;
  camera.format.bits = one_of(2) == 0 ? 10 : 12;
  const double white = camera.format.bits == 10 ? 1023 : 4095, black = white / 16;
  const double full_well_e = std::exp(uniform(std::log(4000), std::log(60000)));
  const double before_gain_e = uniform(1, 12), after_gain_e = uniform(0.5, 2), largest = std::exp2(uniform(2, 6));
  const double step =
      std::array{2.0, std::exp2(1.0 / 2), std::exp2(1.0 / 6), std::exp2(1.0 / 16)}[static_cast<std::size_t>(one_of(4))];
  for (double factor = 1; factor <= largest; factor *= step) {
    isp::GainStep gain{.factor = factor, .sensor = {}};
    gain.sensor.bits = camera.format.bits;
    gain.sensor.white_level_dn = white;
    gain.sensor.black_level_dn = black;
    gain.sensor.full_well_e = full_well_e;
    gain.sensor.system_gain_dn_per_e = factor * (white - black) / full_well_e;
    gain.sensor.read_noise_e = std::hypot(after_gain_e, before_gain_e / factor);
    gain.sensor.dark_current_e_per_s = {2, 2, 2};
    camera.setup.gains.push_back(gain);
  }
  const double line_s = std::array{100e-6, uniform(8e-6, 30e-6)}[static_cast<std::size_t>(one_of(2))];
  isp::ExposureLimits& limits = camera.setup.limits;
  limits.times = {line_s, std::floor(0.2 / line_s) * line_s, line_s};
  limits.longest_s = std::array{1.0 / 60, 1.0 / 30, 0.1}[static_cast<std::size_t>(one_of(3))];
  limits.mains = std::array{isp::Mains::off, isp::Mains::hz50, isp::Mains::hz60,
                            isp::Mains::either}[static_cast<std::size_t>(one_of(4))];
  limits.clipped_fraction = 0.01;
  const double contrast = std::exp(uniform(std::log(3), std::log(200)));
  camera.scene = {{0.7, 1}, {0.25, 0.3}, {0.05, contrast}};
  camera.setup.at = {limits.times.min_s + limits.times.step_s * one_of(300),
                     static_cast<std::size_t>(one_of(static_cast<int>(camera.setup.gains.size())))};
  camera.latency = 1 + one_of(4);
  camera.states = one_of(2) == 0;
  camera.seed = random();
  camera.waiting.assign(static_cast<std::size_t>(camera.latency) + 1, camera.setup.at);
  return camera;
}

}  // namespace lowlux::test
