#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <functional>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "isp/cli/noise/noise_source.h"
#include "isp/pipeline/finished/clean_raw.h"
#include "isp/raw/to_linear.h"
#include "tests/sensor_bench/picture_raw.h"
#include "tests/support/executors.h"
#include "tests/support/scratch_directory.h"

namespace lowlux::cli {
namespace {

using test::two_threads;

/// Replaces each pixel by `of` of the 3 x 3 pixels of its site around it, as a camera does that denoises its raws.
void filter(RawDn& raw, const std::function<double(const std::array<double, 9>&)>& of) {
  const Plane<std::uint16_t> before = raw.dn.clone();
  const auto at = [&](int x, int y) {
    const int last_x = before.width() - 1, last_y = before.height() - 1;
    const auto mirrored = [](int v, int last) { return v < 0 ? -v : v > last ? 2 * last - v : v; };
    return static_cast<double>(before.at(mirrored(x, last_x), mirrored(y, last_y)));
  };
  for (int y = 0; y < before.height(); ++y) {
    for (int x = 0; x < before.width(); ++x) {
      std::array<double, 9> around{};
      for (int i = 0; i < 9; ++i) around[i] = at(x + 2 * (i % 3 - 1), y + 2 * (i / 3 - 1));
      raw.dn.at(x, y) = static_cast<std::uint16_t>(std::lround(std::clamp(of(around), 0.0, 65535.0)));
    }
  }
}

double median_of(std::array<double, 9> around) {
  std::nth_element(around.begin(), around.begin() + 4, around.end());
  return around[4];
}

double gaussian_of(const std::array<double, 9>& around) {
  constexpr std::array<double, 9> weight{1, 2, 1, 2, 4, 2, 1, 2, 1};
  double sum = 0;
  for (int i = 0; i < 9; ++i) sum += weight[i] * around[i] / 16;
  return sum;
}

/// A bilateral filter, whose range is four standard deviations of the noise.
std::function<double(const std::array<double, 9>&)> bilateral(const SensorModel& sensor) {
  return [sensor](const std::array<double, 9>& around) {
    const double k = sensor.system_gain_dn_per_e, e = std::max(around[4] - sensor.black_level_dn, 0.0) / k;
    const double variance = 16 * k * k * (e + sensor.read_noise_e * sensor.read_noise_e);
    double sum = 0, weights = 0;
    for (const double v : around) {
      const double w = std::exp(-(v - around[4]) * (v - around[4]) / (2 * variance));
      sum += w * v, weights += w;
    }
    return sum / weights;
  };
}

struct Camera {
  const char* name;
  SensorModel sensor;
  std::optional<double> iso;
};

RawFrame frame_of(RawDn raw, const Camera& camera) {
  RawFrame frame;
  frame.raw = std::move(raw);
  frame.raw.black_tag = BlackLevel{.pattern_dn = {camera.sensor.black_level_dn}};
  frame.raw.white_dn.fill(camera.sensor.white_level_dn);
  frame.raw.info.iso = camera.iso;
  return frame;
}

/// Returns the rms error in electrons of a frame whose black and white are stated, over pixels of which less than nine
/// tenths of white are expected: above, the sensor clips, and saturated pixels are coded as white.
double error_e(const RawFrame& frame, const PerSite<double>& black_dn, const test::PictureLight& light, double mean_e,
               int crop, const SensorModel& sensor) {
  const double full_e = (sensor.white_level_dn - sensor.black_level_dn) / sensor.system_gain_dn_per_e;
  const int left = (light.rate_e.width() - crop) / 4 * 2, top = (light.rate_e.height() - crop) / 4 * 2;
  double sum = 0, pixels = 0;
  for (int y = 0; y < crop; ++y) {
    for (int x = 0; x < crop; ++x) {
      const int site = (y & 1) * 2 + (x & 1);
      const double range_dn = isp::white_at(frame.raw, site) - black_dn[site];
      const double code = frame.raw.dn.at(frame.raw.active.x + x, frame.raw.active.y + y);
      const double found_e = (code - black_dn[site]) / range_dn * full_e;
      const double true_e = mean_e * static_cast<double>(light.rate_e.at(left + x, top + y));
      if (true_e > 0.9 * std::min(full_e, sensor.full_well_e)) continue;
      sum += (found_e - true_e) * (found_e - true_e);
      pixels += 1;
    }
  }
  return std::sqrt(sum / pixels);
}

// Raws of known light, as read out and as a camera writes them that denoises its raws, of sensors whose prior is right,
// four times too noisy and four times too quiet. Noise reduction by a noise model that is found in the frame may not
// make any of them worse.
TEST(RawsDenoisedBefore, AreNeverFurtherFromTheTruthThanWithoutNoiseReduction) {
  const test::ScratchDirectory scratch;
  setenv("XDG_DATA_DIRS", scratch.path().c_str(), 1);  // without a table of darktable's
  constexpr int crop = 384;
  constexpr double rounding = 1e-3;  // relative: the clean frame is coded anew, in steps of its own
  const std::array cameras{Camera{"10 bits, no ISO",
                                  {.system_gain_dn_per_e = 0.8,
                                   .read_noise_e = 3,
                                   .full_well_e = 5000,
                                   .bits = 10,
                                   .black_level_dn = 64,
                                   .white_level_dn = 1023},
                                  {}},
                           Camera{"10 bits, low gain",
                                  {.system_gain_dn_per_e = 0.1,
                                   .read_noise_e = 5,
                                   .full_well_e = 20'000,
                                   .bits = 10,
                                   .black_level_dn = 16,
                                   .white_level_dn = 1023},
                                  {}},
                           Camera{"14 bits, ISO 1600",
                                  {.system_gain_dn_per_e = 6,
                                   .read_noise_e = 3,
                                   .full_well_e = 10'000,
                                   .bits = 14,
                                   .black_level_dn = 512,
                                   .white_level_dn = 15'872},
                                  1600}};
  isp::DevelopOptions options;
  options.denoise.mode = isp::DenoiseChoice::Mode::automatic;
  int reduced_of_unfiltered = 0;
  std::printf("%-18s %-12s %6s %-10s %-13s %6s  %9s %9s\n", "camera", "image", "mean", "filter", "source", "ratio",
              "before e-", "after e-");
  for (const char* name : {"kodim05.png", "kodim15.png", "kodim23.png"}) {
    const auto light = test::picture_light(name, two_threads, 0.9);
    ASSERT_TRUE(light) << light.error().message;
    for (const Camera& camera : cameras) {
      const std::vector<std::pair<const char*, std::function<double(const std::array<double, 9>&)>>> filters{
          {"none", {}}, {"gaussian", gaussian_of}, {"median", median_of}, {"bilateral", bilateral(camera.sensor)}};
      for (const double mean_e : {30.0, 100.0}) {
        for (const auto& [filter_name, of] : filters) {
          RawDn raw = test::take_picture(*light, camera.sensor, {.mean_green_e = mean_e, .crop = crop}, two_threads);
          if (of) filter(raw, of);
          if (of && filter_name == std::string("bilateral")) filter(raw, of);  // twice: strong
          RawFrame frame = frame_of(std::move(raw), camera);
          const PerSite<double> black_dn = [&] {
            PerSite<double> all;
            all.fill(camera.sensor.black_level_dn);
            return all;
          }();
          const double before = error_e(frame, black_dn, *light, mean_e, crop, camera.sensor);
          const auto origin = find_noise(options, {}, frame, two_threads);
          ASSERT_TRUE(origin && *origin) << name << filter_name;
          const auto clean = isp::clean_raw(frame, options, two_threads);
          double after = before;  // where noise is not reduced
          if (clean) {
            PerSite<double> clean_black;
            clean_black.fill(clean->frame.raw.black_tag->pattern_dn[0]);
            after = error_e(clean->frame, clean_black, *light, mean_e, crop, camera.sensor);
          }
          reduced_of_unfiltered += !of && clean ? 1 : 0;
          std::printf("%-18s %-12s %6.0f %-10s %-13s %6.3f  %9.3f %9.3f\n", camera.name, name, mean_e, filter_name,
                      std::string(name_of((*origin)->source)).c_str(), (*origin)->prior_ratio, before, after);
          EXPECT_LE(after, (1 + rounding) * before)
              << camera.name << ' ' << name << ' ' << mean_e << ' ' << filter_name;
        }
      }
    }
  }
  // The texture of kodim05 in coarse codes looks like a denoised raw; the other unfiltered ones are denoised.
  EXPECT_GE(reduced_of_unfiltered, 3 * 3 * 2 - 1);
  unsetenv("XDG_DATA_DIRS");
}

}  // namespace
}  // namespace lowlux::cli
