// What frames before and a level of noise reduction make together, on pictures that stand still and that move.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <random>
#include <span>
#include <utility>
#include <vector>

#include "isp/pipeline/render/map_views.h"
#include "isp/pipeline/render/noise_reducer.h"
#include "tests/denoise/draws.h"
#include "tests/denoise/frames.h"
#include "tests/sensor_bench/picture_raw.h"

namespace lowlux::isp::temporal_blend_test {
namespace {

constexpr double gain_dn_per_e = 4, black_dn = 400, read_noise_e = 2, read_e2 = read_noise_e * read_noise_e;
constexpr BayerPhase phase = BayerPhase::rggb;

SensorModel sensor() {
  return {.name = "temporal blend",
          .system_gain_dn_per_e = gain_dn_per_e,
          .read_noise_e = read_noise_e,
          .full_well_e = 15000,
          .bits = 16,
          .black_level_dn = black_dn,
          .white_level_dn = 65535};
}

/// Part of a picture, which moves by so many pixels (an even number) from frame to frame.
struct Film {
  const test::PictureLight& light;
  double mean_e;
  int shift_px = 0;
  int side = 256;

  test::PictureLight rates(int frame) const {
    const int left = (((light.rate_e.width() - side) / 2 - 4 * shift_px) & ~1) + shift_px * frame;
    const int top = ((light.rate_e.height() - side) / 2) & ~1;
    test::PictureLight out{light.name, Plane<float>(side, side)};
    for (int y = 0; y < side; ++y) std::copy_n(light.rate_e.row(top + y) + left, side, out.rate_e.row(y));
    return out;
  }
  RawElectrons raw(int frame, Executor& executor) const {
    const auto seed = static_cast<std::uint64_t>(frame);
    const RawDn dn = test::take_picture(rates(frame), sensor(), {.mean_green_e = mean_e, .seed = seed}, executor);
    RawElectrons out{Plane<float>(side, side), phase};
    for (std::size_t i = 0; i < dn.dn.size(); ++i) {
      out.value.data()[i] = static_cast<float>((dn.dn.data()[i] - black_dn) / gain_dn_per_e);
    }
    return out;
  }
};

/// Mean squared difference of codes with a gamma of 2.2, white at five times the mean of green [dB].
double psnr_db(const Plane<float>& signal_e, const Film& film, int frame) {
  const Plane<float> rate = film.rates(frame).rate_e;
  const auto code = [](double of_white) { return std::pow(std::clamp(of_white, 0.0, 1.0), 1 / 2.2); };
  double sum = 0;
  for (std::size_t i = 0; i < rate.size(); ++i) {
    const double d = code(static_cast<double>(signal_e.data()[i]) / (5 * film.mean_e)) -
                     code(static_cast<double>(rate.data()[i]) / 5);
    sum += d * d;
  }
  return -10 * std::log10(sum / static_cast<double>(rate.size()));
}

NoiseReduction how(bool level, bool temporal, bool restart) {
  NoiseReduction out;
  if (level) out.level = denoise::Level::draft;
  out.options.level = denoise::Level::draft;
  out.options.white_gain = {1.9, 1, 1.5};
  out.noise.variance_e2 = {read_e2, read_e2, read_e2};
  if (temporal) out.temporal.emplace().restart = restart;
  return out;
}

/// The mean of both, where detail that the level has lost counts up to max_detail times its noise.
Plane<float> blended(const Plane<float>& level, const Plane<float>& mean, const Plane<float>& share,
                     const NoiseMaps& maps, double max_detail) {
  Plane<float> out(level.width(), level.height());
  for (int top = 0; top < out.height(); top += 8) {
    for (int left = 0; left < out.width(); left += 8) {
      const auto each = [&](const auto& work) {
        for (int y = top; y < std::min(top + 8, out.height()); ++y) {
          for (int x = left; x < std::min(left + 8, out.width()); ++x) {
            const auto colour = static_cast<std::size_t>(colour_at(phase, x, y));
            const auto l = static_cast<double>(level.at(x, y)), s = static_cast<double>(share.at(x / 2, y / 2));
            const double mean_e2 = s * (std::max(l, 0.0) + read_e2);  // by the level's result, which is smooth
            work(x, y, s, mean_e2, static_cast<double>(maps.site_variance_e2[colour].at(x / 2, y / 2)));
          }
        }
      };
      double detail = 0, sites = 0;
      std::array<double, 3> difference{}, of_colour{};
      each([&](int x, int y, double s, double mean_e2, double level_e2) {
        const auto d = static_cast<double>(mean.at(x, y)) - static_cast<double>(level.at(x, y));
        // The covariance of both is s level_e2: the frame's noise is in both.
        detail += d * d - mean_e2 - level_e2 + 2 * s * level_e2;
        const auto colour = static_cast<std::size_t>(colour_at(phase, x, y));
        difference[colour] += d;
        of_colour[colour] += 1;
        sites += 1;
      });
      for (std::size_t c = 0; c < 3; ++c) {  // a level keeps the means of blocks
        if (of_colour[c] > 0) detail -= difference[c] * difference[c] / of_colour[c];
      }
      detail = std::max(detail / sites, 0.0);
      each([&](int x, int y, double s, double mean_e2, double level_e2) {
        const double own = (1 - s) * (level_e2 + std::min(detail, max_detail * level_e2));
        const auto m = static_cast<double>(mean.at(x, y)), l = static_cast<double>(level.at(x, y));
        out.at(x, y) = static_cast<float>((own * m + mean_e2 * l) / (own + mean_e2));
      });
    }
  }
  return out;
}

NoiseReducer::Piece whole(int width, int height) {
  return {{0, 0, width, height}, {0, 0, width, height}, width, height, phase};
}

/// One film through all that is compared.
class Reducers {
 public:
  explicit Reducers(const Film& film)
      : film_(film), mean_of_frames_(film.side, film.side, 1), fraction_((film.side + 1) / 2, (film.side + 1) / 2) {
    for (Plane<float>* plane : {&time_, &level_, &both_}) *plane = Plane<float>(film.side, film.side);
    fit(maps_, film.side, film.side);
  }

  void next() {
    ++frame_;
    RawElectrons raw = film_.raw(frame_, one_);
    Plane<float> mean(film_.side, film_.side);
    mean_of_frames_.run({std::as_const(raw.value).view(), phase}, how(false, true, false).noise, 1, {}, mean.view(),
                        fraction_.view(), one_);
    const NoiseReducer::Piece all = whole(film_.side, film_.side);
    const PlaneView<float> raw_e = raw.value.view();
    time_only_.run(all, how(false, true, frame_ == 1), raw_e, time_.view());
    together_.run(all, how(true, true, frame_ == 1), raw_e, both_.view());
    level_only_.run(all, how(true, false, false), raw_e, level_.view(), views_of(maps_));
  }
  double time_db() const { return psnr_db(time_, film_, frame_); }
  double level_db() const { return psnr_db(level_, film_, frame_); }
  double both_db() const { return psnr_db(both_, film_, frame_); }
  Plane<float> with(double max_detail) const { return blended(level_, time_, fraction_, maps_, max_detail); }
  double db_with(double max_detail) const { return psnr_db(with(max_detail), film_, frame_); }
  const Plane<float>& both() const { return both_; }
  double moved() const { return together_.moved(); }

 private:
  const Film& film_;
  InlineExecutor one_;
  denoise::TemporalMean mean_of_frames_;  // for its shares
  Plane<float> fraction_;
  NoiseReducer time_only_{one_}, level_only_{one_}, together_{one_};
  Plane<float> time_, level_, both_;
  NoiseMaps maps_;
  int frame_ = 0;
};

constexpr double chosen = 4;

test::PictureLight light_of(const char* name, double lens_sigma_px = 0.9) {
  InlineExecutor one;
  auto light = test::picture_light(name, one, lens_sigma_px);
  EXPECT_TRUE(light) << name;
  return light ? *std::move(light) : test::PictureLight{};
}

TEST(TemporalBlend, EachSiteIsBlendedByTheVariancesOfBothAndTheDetailLost) {
  const test::PictureLight light = light_of("kodim19.png");
  const Film film{light, 20, 2, 151};  // blocks and strips that end early
  Reducers reducers(film);
  for (int i = 0; i < 3; ++i) reducers.next();
  const Plane<float> expected = reducers.with(chosen);
  for (std::size_t i = 0; i < expected.size(); ++i) {
    const float tolerance = 1e-4f + 1e-5f * std::fabs(expected.data()[i]);  // e-: floats of some 100 e-
    ASSERT_NEAR(reducers.both().data()[i], expected.data()[i], tolerance) << i;
  }
}

// A weight that goes by the noisy value itself would take 0.05 to 0.2 e- off.
TEST(TemporalBlend, KeepsTheMeanOfFewElectrons) {
  constexpr int side = 256;
  constexpr double signal_e = 3, read_e = 1.5;
  InlineExecutor one;
  NoiseReducer reducer(one);
  NoiseReduction how;
  how.level = how.options.level = denoise::Level::draft;
  how.noise.variance_e2.fill(read_e * read_e);
  how.temporal.emplace();
  std::mt19937 random(5);
  std::poisson_distribution<int> photons(signal_e);
  std::normal_distribution<double> read(0, read_e);
  Plane<float> out(side, side);
  for (int frame = 1; frame <= 6; ++frame) {
    RawElectrons raw{Plane<float>(side, side), BayerPhase::rggb};
    for (std::size_t i = 0; i < raw.value.size(); ++i) {
      raw.value.data()[i] = static_cast<float>(photons(random) + read(random));
    }
    how.temporal->restart = frame == 1;
    reducer.run(whole(side, side), how, raw.value.view(), out.view());
    double sum = 0;
    for (std::size_t i = 0; i < out.size(); ++i) sum += static_cast<double>(out.data()[i]);
    const double standard_error = std::sqrt(signal_e + read_e * read_e) / side;  // of one frame
    EXPECT_NEAR(sum / (side * side), signal_e, 5 * standard_error) << frame;
  }
}

TEST(TemporalBlend, OfASceneThatStandsStillIsAboveBothAlone) {
  for (const char* name : {"kodim19.png", "kodim05.png"}) {
    const test::PictureLight light = light_of(name);
    const Film film{light, 20};
    Reducers reducers(film);
    for (int frame = 1; frame <= 30; ++frame) {
      reducers.next();
      if (frame != 4 && frame != 8 && frame != 30) continue;
      EXPECT_GT(reducers.both_db(), std::max(reducers.time_db(), reducers.level_db())) << name << " frame " << frame;
      EXPECT_LT(reducers.moved(), 0.01) << name;  // a false alarm in 1000 blocks is meant
    }
  }
}

// What moves shows no more noise than a frame by itself: 0.3 dB is less than can be seen.
TEST(TemporalBlend, OfASceneThatMovesIsNotWorseThanTheLevelAlone) {
  for (const char* name : {"kodim19.png", "kodim05.png", "StillLife.exr"}) {
    const test::PictureLight light = light_of(name);
    const Film film{light, 20, 2};
    Reducers reducers(film);
    for (int frame = 1; frame <= 6; ++frame) reducers.next();
    EXPECT_GT(reducers.both_db(), reducers.level_db() - 0.3) << name;
  }
}

/// A glow without edges that moves over grey: a Gaussian, drawn at random.
struct SoftLight {
  double mean_e, contrast_e, sigma_px, speed_px, angle;

  static SoftLight draw(std::uint32_t seed) {
    std::mt19937 random(seed);
    const auto between = [&random](double min, double max) {
      return std::uniform_real_distribution<double>(min, max)(random);
    };
    const double mean_e = std::exp(between(std::log(4.0), std::log(100.0)));
    return {mean_e, std::sqrt(mean_e + read_e2) * between(0.5, 2), between(20, 60), between(1, 6), between(0, 6.28)};
  }
  /// Returns the signal of white, and the distance from the middle in units of sigma.
  std::pair<double, double> at(int x, int y, int side, int step) const {
    const double u = x - 0.5 * side - speed_px * step * std::cos(angle);
    const double v = y - 0.5 * side - speed_px * step * std::sin(angle);
    const double distance = std::hypot(u, v) / sigma_px;
    return {mean_e + contrast_e * std::exp(-0.5 * distance * distance), distance};
  }
  /// Returns R, G, B of a light that is white, or of more red and less blue.
  std::array<double, 3> colours(double white_e, bool red) const {
    return red ? std::array{white_e, mean_e, 2 * mean_e - white_e} : std::array{white_e, white_e, white_e};
  }
};

/// Expects that within two sigma of its middle, a light's error does not exceed that of the level, except by chance: 5
/// standard errors of the mean over lights.
void expect_not_worse_than_the_level(std::uint32_t lights, bool red) {
  constexpr int side = 320, frames = 18, measured = 6;
  InlineExecutor one;
  test::MeanOf excess;  // of each light: mean square error over that of the level, less 1
  for (std::uint32_t seed = 1; seed <= lights; ++seed) {
    const SoftLight light = SoftLight::draw(seed);
    NoiseReducer together(one), level_only(one);
    Plane<float> both(side, side), level(side, side);
    double both_e2 = 0, level_e2 = 0;
    for (int frame = 1; frame <= frames; ++frame) {
      const denoise_testing::Camera camera{.phase = phase, .read_noise_e = read_noise_e};
      const auto signal = [&](int x, int y) { return light.at(x, y, side, frame - frames + measured); };
      const denoise_testing::Scene scene = [&](int x, int y) { return light.colours(signal(x, y).first, red); };
      const auto raw = denoise_testing::exposed(camera, scene, side, side, 1000 * seed + static_cast<unsigned>(frame));
      const auto reduce = [&](NoiseReducer& reducer, bool temporal, Plane<float>& out) {
        NoiseReduction with = how(true, temporal, frame == 1);
        with.level = with.options.level = denoise::Level::standard;
        reducer.run(whole(side, side), with, raw.view(), out.view());
      };
      reduce(together, true, both);
      if (frame <= frames - measured) continue;
      reduce(level_only, false, level);
      for (int y = 0; y < side; ++y) {
        for (int x = 0; x < side; ++x) {
          const auto [white_e, distance] = signal(x, y);
          if (distance > 2) continue;
          const double truth_e = light.colours(white_e, red)[static_cast<std::size_t>(colour_at(phase, x, y))];
          both_e2 += std::pow(static_cast<double>(both.at(x, y)) - truth_e, 2);
          level_e2 += std::pow(static_cast<double>(level.at(x, y)) - truth_e, 2);
        }
      }
    }
    excess.add(both_e2 / level_e2 - 1);
    EXPECT_LT(10 * std::log10(both_e2 / level_e2), 0.25) << "less than can be seen; seed " << seed;
    std::printf("seed %2u: %5.1f e-, contrast %4.1f e-, sigma %2.0f px, %.1f px each frame: %5.2f dB\n", seed,
                light.mean_e, light.contrast_e, light.sigma_px, light.speed_px, 10 * std::log10(both_e2 / level_e2));
  }
  EXPECT_LT(excess.mean(), 5 * excess.standard_error());
}

TEST(TemporalBlend, OfASoftLightThatMovesIsNotWorseThanTheLevelAlone) { expect_not_worse_than_the_level(12, false); }

TEST(TemporalBlend, OfASoftRedLightThatMovesIsNotWorseThanTheLevelAlone) { expect_not_worse_than_the_level(4, true); }

// Nightly: the table behind the largest detail, PSNR [dB] as means over all pictures.
TEST(TemporalBlend, OtherLimitsOfDetailAreNotBetterByAQuarterDecibel) {
  if (std::getenv("LOWLUX_NIGHTLY") == nullptr) GTEST_SKIP() << "runs with LOWLUX_NIGHTLY";
  constexpr std::array limits{0.0, 1.0, 2.0, 8.0, 1e9};
  struct Case {
    int shift_px;
    int frames;
  };
  std::printf("   e-  px  frame   time  level   both | limit 0      1      2      8   none\n");
  for (const double mean_e : {5.0, 20.0, 100.0}) {
    for (const Case of : {Case{0, 2}, Case{0, 8}, Case{0, 30}, Case{2, 8}}) {
      std::array<double, 8> db{};
      for (const char* name : test::clean_pictures) {
        const test::PictureLight light = light_of(name);
        const Film film{light, mean_e, of.shift_px};
        Reducers reducers(film);
        for (int frame = 1; frame <= of.frames; ++frame) reducers.next();
        db[0] += reducers.time_db(), db[1] += reducers.level_db(), db[2] += reducers.both_db();
        for (std::size_t i = 0; i < limits.size(); ++i) db[3 + i] += reducers.db_with(limits[i]);
      }
      for (double& sum : db) sum /= static_cast<double>(test::clean_pictures.size());
      std::printf("%5.0f %3d %6d", mean_e, of.shift_px, of.frames);
      for (const double mean : db) std::printf(" %6.2f", mean);
      std::printf("\n");
      EXPECT_GT(db[2], *std::max_element(db.begin() + 3, db.end()) - 0.25);
    }
  }
}

}  // namespace
}  // namespace lowlux::isp::temporal_blend_test
