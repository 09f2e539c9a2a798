#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "isp/base/executor.h"
#include "isp/bench/accuracy_time.h"
#include "isp/bench/peers/demosaic_reference.h"
#include "isp/bench/scenes/denoise_scene.h"
#include "isp/bench/stages/developing_stages.h"

namespace lowlux::isp {
namespace {

constexpr PicturePart quick_part{384, 256};
constexpr DenoiseLight light{20, 2, 1.5};

/// Transform that leaves the kernel's camera RGB unchanged, so that demosaicing alone is measured.
constexpr RgbTransform untouched{.clip = std::numeric_limits<float>::infinity(), .move_into_gamut = false};

/// A mosaic, the truth behind it, and memory for the results.
struct Sample {
  const BenchPicture& picture;
  DenoiseShot shot;
  PictureTruth truth;
  Plane<float> noisy_e;  // dark subtracted
  SceneLinear light;
  SceneLinear half;
  DoublePlanes exact;

  SignedMosaic mosaic(bool with_noise) const {
    return mosaic_of(with_noise ? noisy_e.view() : shot.signal_e.view(), shot);
  }
};

std::vector<Sample> samples_of(const std::vector<BenchPicture>& pictures, Executor& executor) {
  std::vector<Sample> out;
  out.reserve(pictures.size());
  for (const BenchPicture& picture : pictures) {
    const int width = picture.linear.width(), height = picture.linear.height();
    Sample sample{picture,
                  take(picture, light, seed_of(picture, light)),
                  PictureTruth(picture.linear.view(), executor),
                  Plane<float>(width, height),
                  SceneLinear(width, height),
                  SceneLinear(width / 2, height / 2),
                  {Plane<double>(width, height), {width, height}, {width, height}}};
    const Plane<float>& raw = sample.shot.raw_e;
    std::transform(raw.data(), raw.data() + raw.size(), sample.noisy_e.data(),
                   [dark_e = static_cast<float>(light.dark_e)](float e) { return e - dark_e; });
    out.push_back(std::move(sample));
  }
  return out;
}

SceneLinear rounded(const DoublePlanes& exact) {
  SceneLinear out(exact[0].width(), exact[0].height());
  for (std::size_t c = 0; c < 3; ++c) {
    std::transform(exact[c].data(), exact[c].data() + exact[c].size(), out.plane[c].data(),
                   [](double v) { return static_cast<float>(v); });
  }
  return out;
}

/// One way from a sample's mosaic to RGB: the work, and its result as an image of full size.
struct Method {
  std::string name;
  void (*work)(Sample& sample, const SignedMosaic& mosaic, RawToRgb& kernel);
  SceneLinear (*result)(const Sample& sample);
};

std::vector<Method> methods() {
  return {
      {"half (2x2 means)",
       [](Sample& sample, const SignedMosaic& mosaic, RawToRgb& kernel) {
         InlineExecutor one;
         kernel.bin2x2(mosaic, sample.half.view(), one);
       },
       [](const Sample& sample) {
         return enlarged_twice(sample.half.view(), sample.light.width(), sample.light.height());
       }},
      {"Malvar, kernel",
       [](Sample& sample, const SignedMosaic& mosaic, RawToRgb& kernel) {
         InlineExecutor one;
         kernel.linear(mosaic, untouched, sample.light.view(), one);
       },
       [](const Sample& sample) {
         SceneLinear out(sample.light.width(), sample.light.height());
         for (std::size_t c = 0; c < 3; ++c) out.plane[c] = sample.light.plane[c].clone();
         return out;
       }},
      {"bilinear, double",
       [](Sample& sample, const SignedMosaic& mosaic, RawToRgb& /*kernel*/) {
         demosaic_bilinear(mosaic, sample.exact);
       },
       [](const Sample& sample) { return rounded(sample.exact); }},
      {"Malvar, double",
       [](Sample& sample, const SignedMosaic& mosaic, RawToRgb& /*kernel*/) { demosaic_malvar(mosaic, sample.exact); },
       [](const Sample& sample) { return rounded(sample.exact); }}};
}

/// Data that all groups use.
struct Bench {
  std::vector<Sample> samples;
  RawToRgb kernel;
  BenchRenderer renderer;
  Executor& executor;

  AccuracyLevel level(const Method& method, bool with_noise) {
    AccuracyLevel out{.name = method.name,
                      .run =
                          [this, method, with_noise] {
                            for (Sample& sample : samples) method.work(sample, sample.mosaic(with_noise), kernel);
                          },
                      .largest = 0};
    for (Sample& sample : samples) {
      method.work(sample, sample.mosaic(with_noise), kernel);
      const SceneLinear display = renderer.display_of(method.result(sample));
      const ColourDifference error = display_difference(display.view(), sample.truth, executor);
      out.error += error.mean / static_cast<double>(samples.size());
      out.largest = std::max(out.largest, error.largest);
      out.megapixels += 1e-6 * static_cast<double>(sample.noisy_e.size());
    }
    return out;
  }

  /// Sets the mean and largest difference of the kernel from double, in millionths of display white.
  void set_rounding(AccuracyLevel& kernel_level) {
    double sum = 0, values = 0, largest = 0;
    for (Sample& sample : samples) {
      InlineExecutor one;
      kernel.linear(sample.mosaic(true), untouched, sample.light.view(), one);
      demosaic_malvar(sample.mosaic(true), sample.exact);
      for (std::size_t c = 0; c < 3; ++c) {
        for (std::size_t i = 0; i < sample.exact[c].size(); ++i) {
          const double difference = std::abs(sample.light.plane[c].data()[i] - sample.exact[c].data()[i]);
          sum += difference;
          largest = std::max(largest, difference);
        }
        values += static_cast<double>(sample.exact[c].size());
      }
    }
    kernel_level.error = 1e6 * sum / values;
    kernel_level.largest = 1e6 * largest;
  }
};

std::vector<AccuracyGroup> groups_of(Bench& bench) {
  std::vector<AccuracyGroup> out;
  const std::vector<Method> all = methods();
  for (const bool with_noise : {false, true}) {
    AccuracyGroup group{with_noise ? fmt::format("{:g} e-, noise left in", light.mean_e) : "no noise",
                        "mean CIEDE2000 against the truth",
                        {}};
    group.levels.reserve(all.size());
    for (const Method& method : all) group.levels.push_back(bench.level(method, with_noise));
    out.push_back(std::move(group));
  }
  AccuracyGroup rounding{"rounding of the kernel", "mean difference from double [1e-6 of white]", {}};
  for (const std::size_t i : {std::size_t{1}, std::size_t{3}}) {
    AccuracyLevel level = out.back().levels[i];
    level.error = level.largest = 0;
    if (i == 1) bench.set_rounding(level);
    rounding.levels.push_back(std::move(level));
  }
  out.push_back(std::move(rounding));
  return out;
}

}  // namespace

Result<BenchOutcome> run_demosaic_bench(const BenchOptions& options) {
  PoolExecutor executor(options.threads);
  const auto pictures = read_bench_pictures(
      options.pictures_folder, options.quick ? quick_files_of(options.pictures) : files_of(options.pictures),
      options.quick ? quick_part : PicturePart{}, executor);
  if (!pictures) return tl::make_unexpected(pictures.error());
  const int width = largest_of(*pictures).width;
  Bench bench{samples_of(*pictures, executor), RawToRgb(width, 1), BenchRenderer(width, executor), executor};
  const AccuracyTiming timing{.rounds = options.quick ? 5 : 7, .min_s = 1e-3};
  const std::vector<AccuracyGroup> groups = groups_of(bench);
  std::vector<AccuracyRow> rows;
  for (const AccuracyGroup& group : groups) {
    for (AccuracyRow& row : measure(group, timing)) rows.push_back(std::move(row));
    options.advance(1 / static_cast<double>(groups.size()), "demosaicing: " + group.name);
  }
  BenchOutcome out = accuracy_outcome("demosaic", rows, timing, 1);
  out.remarks.push_back(fmt::format(
      "{} pictures{} behind a lens of {} px, RGGB, white gains 2, 1, 1.5; colours moved into the gamut before they are "
      "compared; of half, the means alone are timed, and enlarged between their middles to be compared",
      pictures->size(), options.quick ? ", quick: parts of them" : "", bench_lens_px));
  return out;
}

}  // namespace lowlux::isp
