// Times and accuracy of the registration on stars, of drizzling and of merged nights: the figures of
// isp/merge/stars/README.md. Times are those of the processor, of all threads together.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <functional>
#include <vector>

#include "isp/merge/stars/drizzle.h"
#include "isp/merge/stars/find_stars.h"
#include "isp/merge/stars/match_stars.h"
#include "tests/bench/measure/measure.h"
#include "tests/merge/star_motion.h"
#include "tests/pipeline/merge/star_nights.h"

namespace {

using namespace lowlux;
using namespace lowlux::star_testing;

double median_ms(int rounds, const std::function<void()>& work) {
  std::vector<double> times_ms;
  times_ms.reserve(static_cast<std::size_t>(rounds));
  for (int i = 0; i < rounds; ++i) times_ms.push_back(test::ms_of(test::cpu_ms, work));
  return isp::median(times_ms);
}

/// Texture everywhere: a scene without stars.
Plane<float> texture(const StarCamera& camera) {
  Plane<float> frame = sky_of(camera);
  for (int y = 0; y < camera.height; ++y) {
    for (int x = 0; x < camera.width; ++x) {
      const double wave = std::sin(0.9 * x + 0.002 * y * y) * std::cos(0.7 * y + 0.001 * x * x);
      frame.at(x, y) *= static_cast<float>(10 + 8 * wave);
    }
  }
  expose(camera, 5, frame);
  return frame;
}

void print_detection_times(int rounds) {
  const StarCamera camera{.width = 4000, .height = 3000};
  Draw draw(1);
  const std::vector<TrueStar> stars = drawn_stars(camera, 3000, 200, draw);
  const Plane<float> frame = exposed(camera, stars, 2), noise = exposed(camera, {}, 3), edges = texture(camera);
  std::printf("find_stars, 12 MP [ms], 1 and 2 threads, and stars found\n");
  for (const Plane<float>* plane : {&noise, &frame, &edges}) {
    std::printf("  %-12s", plane == &frame ? "3000 stars" : plane == &noise ? "noise" : "texture");
    merge::StarField field;
    for (const int threads : {1, 2}) {
      PoolExecutor executor(threads);
      std::printf(" %6.1f", median_ms(rounds, [&] { field = find_stars(view_of(camera, *plane), {}, executor); }));
    }
    std::printf("  %zu\n", field.stars.size());
  }
}

void print_false_stars() {
  PoolExecutor executor(2);
  std::printf("false stars per megapixel in noise, of 10 that are allowed\n");
  for (const double sky : {0.05, 1.0, 60.0, 2000.0}) {
    const StarCamera camera{.width = 4000, .height = 3000, .sky_e = {sky / 2, sky, 0.7 * sky}, .read_noise_e = 1};
    std::size_t found = 0;
    for (std::uint64_t seed = 1; seed <= 4; ++seed) {
      const Plane<float> frame = exposed(camera, {}, seed);
      found += find_stars(view_of(camera, frame), {.false_stars_per_mp = 10}, executor).stars.size();
    }
    std::printf("  %7.2f e-  %5.2f\n", sky, static_cast<double>(found) / 48);
  }
}

/// Sums of the errors of the stars that were found.
struct Accuracy {
  double count = 0, place = 0, place_ratio = 0, flux = 0, flux_ratio = 0, width_ratio = 0;

  void add(const merge::Star& star, const TrueStar& truth, double sigma) {
    const auto ratio2 = [](const Estimate& e, double value) {
      return std::pow((e.value - value) / e.standard_error, 2);
    };
    count += 1;
    place += std::pow(star.x_px.value - truth.x, 2);
    place_ratio += ratio2(star.x_px, truth.x);
    flux += star.flux_e[1].value / truth.flux_e[1] - 1;
    flux_ratio += ratio2(star.flux_e[1], truth.flux_e[1]);
    width_ratio += ratio2(star.sigma_px, sigma);
  }
};

void print_accuracy() {
  constexpr int across = 50, spacing = 40;
  PoolExecutor executor(2);
  std::printf(
      "2500 stars of one brightness, sky 60 e-, read noise 3 e-: found, rms error of x [px], rms of errors over "
      "their standard errors of x, flux, width, and mean error of the flux\n");
  for (const double sigma : {0.8, 1.2, 1.8}) {
    for (const double snr : {4.0, 5.0, 6.0, 8.0, 10.0, 15.0, 30.0, 100.0}) {
      const StarCamera camera{.width = across * spacing, .height = across * spacing, .sigma_px = sigma};
      Draw draw(7);
      std::vector<TrueStar> stars;
      for (int k = 0; k < across * across; ++k) {
        const int column = k % across, row = k / across;
        TrueStar star{spacing * (column + 0.5) + draw.uniform(), spacing * (row + 0.5) + draw.uniform()};
        for (std::size_t c = 0; c < 3; ++c) star.flux_e[c] = snr / camera.snr_of(1) * camera.sky_e[c] / camera.sky_e[1];
        stars.push_back(star);
      }
      const Plane<float> frame = exposed(camera, stars, 11);
      Accuracy sum;
      for (const merge::Star& star : find_stars(view_of(camera, frame), {.max_stars = 4000}, executor).stars) {
        const int i = std::min(static_cast<int>(star.x_px.value / spacing), across - 1);
        const int j = std::min(static_cast<int>(star.y_px.value / spacing), across - 1);
        const int index = across * j + i;
        const TrueStar& truth = stars[static_cast<std::size_t>(index)];
        if (std::hypot(star.x_px.value - truth.x, star.y_px.value - truth.y) < 2.5) sum.add(star, truth, sigma);
      }
      const auto rms = [&](double squares) { return std::sqrt(squares / sum.count); };
      std::printf("  sigma %.1f px, snr %5.1f: %.3f  %.3f px  %.2f %.2f %.2f  %+.3f\n", sigma, snr,
                  sum.count / (across * across), rms(sum.place), rms(sum.place_ratio), rms(sum.flux_ratio),
                  rms(sum.width_ratio), sum.flux / sum.count);
    }
  }
}

/// Registration of frames of 3 MP whose truth is known.
void print_matching(int rounds) {
  PoolExecutor executor(2);
  std::printf(
      "match_stars: stars of both frames, matched, model, error in the common field [px], predicted, time [ms]\n");
  for (int trial = 0; trial < 8; ++trial) {
    const StarCamera camera{.width = 2048, .height = 1536};
    Draw draw(static_cast<std::uint64_t>(trial));
    const TrueMotion motion = drawn_motion(camera.width, camera.height, 2, draw);
    std::vector<TrueStar> first = drawn_stars(camera, 3000, 400, draw, 1500), second;
    for (TrueStar& star : first) {
      const merge::Point sky{star.x, star.y}, to = motion.distorted(motion.moved(sky)), from = motion.distorted(sky);
      second.push_back({to.x, to.y, star.flux_e});
      star.x = from.x;
      star.y = from.y;
    }
    const Plane<float> a = exposed(camera, first, 1), b = exposed(camera, second, 2);
    const merge::StarField reference = find_stars(view_of(camera, a), {}, executor);
    const merge::StarField frame = find_stars(view_of(camera, b), {}, executor);
    Result<merge::StarMatch> match = match_stars(reference, frame, {});
    const double ms = median_ms(rounds, [&] { match = match_stars(reference, frame, {}); });
    std::printf("  %6.1f degrees, %5.0f %5.0f px: %4zu %4zu  ", motion.angle_rad * 180 / std::numbers::pi, motion.dx,
                motion.dy, reference.stars.size(), frame.stars.size());
    if (!match) {
      std::printf("%s\n", match.error().message.c_str());
      continue;
    }
    double squares = 0, predicted = 0, count = 0;
    for (int k = 0; k < 1681; ++k) {
      const int column = k % 41, row = k / 41;
      const merge::Point sky{column * motion.width / 40, row * motion.height / 40};
      const merge::Point from = motion.distorted(sky), to = motion.distorted(motion.moved(sky));
      if (!motion.in_view(from) || !motion.in_view(to)) continue;
      const merge::Point p = match->transform.at(from);
      squares += (std::pow(p.x - to.x, 2) + std::pow(p.y - to.y, 2)) / 2;
      predicted += std::pow(match->transform.standard_error_px(from), 2);
      count += 1;
    }
    std::printf("%4d %-10s %.4f %.4f  %.1f\n", match->matched, name_of(match->transform.model),
                std::sqrt(squares / count), std::sqrt(predicted / count), ms);
  }
}

void print_drizzle_times(int rounds) {
  const StarCamera camera{.width = 4000, .height = 3000};
  const Plane<float> frame = exposed(camera, {}, 3);
  std::printf("drizzle, 12 MP, one thread: add [ns for each sample in view], finish [ms]\n");
  InlineExecutor one;
  for (const double degrees : {1.0, 45.0, 90.0}) {
    const merge::Motion motion =
        motion_of(rotation(camera.width, camera.height, degrees, 12.3, -4.5), camera.width, camera.height);
    for (const merge::DrizzleOptions options : {merge::DrizzleOptions{1, 1}, {1, 0.7}, {1.5, 0.7}, {2, 0.5}, {2, 1}}) {
      merge::Drizzle drizzle(camera.width, camera.height, options);
      merge::DrizzleCounts counts;
      const double ms =
          median_ms(rounds, [&] { counts = drizzle.add({.frame = view_of(camera, frame), .motion = motion}, one); });
      const double finish_ms = median_ms(1, [&] { drizzle.finish(one); });
      std::printf("  %4.1f degrees, scale %.1f, pixfrac %.1f: %5.1f  %6.1f\n", degrees, options.scale, options.pixfrac,
                  1e6 * ms / static_cast<double>(counts.used), finish_ms);
    }
  }
}

/// Counts what is found in a merged mosaic and is no star of the sky, and the stars that are not found.
struct Misses {
  int false_stars = 0, found = 0, in_view = 0;
};

Misses misses_of(const test::Sky& sky, const test::Burst& burst, const RawFrame& merged) {
  Plane<float> signal_e(burst.width, burst.height);
  for (int y = 0; y < burst.height; ++y) {
    for (int x = 0; x < burst.width; ++x) {
      signal_e.at(x, y) = static_cast<float>(test::Burst::signal_e(merged, x, y));
    }
  }
  // A mean of frames has the noise of one frame of all their light.
  const double count = 1 / (merged.noise->scale[1] * test::night_full_e());
  for (std::size_t i = 0; i < signal_e.size(); ++i) signal_e.data()[i] *= static_cast<float>(count);
  const double variance = count * burst.read_noise_e * burst.read_noise_e;
  InlineExecutor one;
  const merge::StarField field = merge::find_stars(
      {signal_e.view(), merged.raw.phase, {variance, variance, variance, variance}}, {.false_stars_per_mp = 1}, one);
  const auto is_near = [](const test::SkyStar& star, const merge::Star& other) {
    return std::hypot(star.x - other.x_px.value, star.y - other.y_px.value) < 2;
  };
  Misses out;
  for (const merge::Star& found : field.stars) {
    if (std::none_of(sky.stars.begin(), sky.stars.end(), [&](const auto& star) { return is_near(star, found); })) {
      ++out.false_stars;
    }
  }
  for (const test::SkyStar& star : sky.stars) {
    if (star.x < 4 || star.y < 4 || star.x > burst.width - 5 || star.y > burst.height - 5) continue;
    ++out.in_view;
    out.found += std::any_of(field.stars.begin(), field.stars.end(), [&](const auto& s) { return is_near(star, s); });
  }
  return out;
}

void print_merged_night(const char* name, const test::Sky& sky, const isp::MergeOptions& options) {
  const test::Burst burst = test::night(sky, 0.2);
  const int frames = 32;
  const isp::MergedRaw merged = burst.merged(frames, options);
  const double per_px = options.drizzle ? options.drizzle->scale : 1;
  const int samples = options.drizzle ? 3 : 1;
  const auto truth = test::moments_of_stars(sky, burst, 1, [&](int x, int y) { return burst.truth_e(x, y); });
  const auto found = test::moments_of_stars(sky, burst, per_px, [&](int x, int y) {
    return test::Burst::signal_e(merged.frame, samples * x + (samples == 3 ? 1 : 0), y);
  });
  std::printf("  %-24s %8.4f %12.3f -> %.3f", name, found.flux_e / truth.flux_e, std::sqrt(truth.variance_px2),
              std::sqrt(found.variance_px2));
  if (!options.drizzle) {
    const Misses misses = misses_of(sky, burst, merged.frame);
    std::printf(" %7d of %d %8d", misses.found, misses.in_view, misses.false_stars);
  }
  std::printf("\n");
}

void print_merged_nights() {
  std::printf(
      "32 frames of 256 x 192, the sky turned by 0.2 degrees and moved by 1.9 px from each to the next:\n"
      "  %-24s %8s %21s %13s %8s\n",
      "", "flux", "sigma [px]", "stars found", "false");
  const test::Sky sky(21, 30, 1500);
  const auto by_stars = isp::MergeOptions{.alignment = isp::MergeAlignment::stars, .reference = 0};
  isp::MergeOptions options = by_stars;
  print_merged_night("stars", sky, options);
  options.drizzle = merge::DrizzleOptions{};
  print_merged_night("drizzle 1, pixfrac 1", sky, options);
  options.drizzle = merge::DrizzleOptions{.scale = 2, .pixfrac = 0.6};
  print_merged_night("drizzle 2, pixfrac 0.6", sky, options);
}

}  // namespace

int lowlux::test::measure_stars(Arguments& arguments) {
  const int rounds = arguments.next(5, 3);
  arguments.end();
  print_detection_times(rounds);
  print_drizzle_times(rounds);
  print_false_stars();
  print_accuracy();
  print_matching(rounds);
  print_merged_nights();
  return 0;
}
