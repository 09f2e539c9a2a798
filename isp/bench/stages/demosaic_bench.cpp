#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "denoise/denoiser.h"
#include "isp/base/executor.h"
#include "isp/bench/accuracy_time.h"
#include "isp/bench/peers/demosaic_reference.h"
#include "isp/bench/scenes/denoise_scene.h"
#include "isp/bench/stages/developing_stages.h"

namespace lowlux::isp {
namespace {

constexpr PicturePart quick_part{384, 256};
constexpr DenoiseLight dim{20, 2, 1.5};
constexpr DenoiseLight bright{200, 2, 1.5};

/// Transform that leaves the kernel's camera RGB unchanged, so that demosaicing alone is measured.
constexpr RgbTransform untouched{.clip = std::numeric_limits<float>::infinity(), .move_into_gamut = false};

/// A mosaic, the truth behind it, and memory for the results.
struct Sample {
  const BenchPicture& picture;
  DenoiseShot shot;
  PictureTruth truth;
  Plane<float> noisy_e;  // dark subtracted
  Plane<float> clean_e;  // by Level::standard
  SceneLinear light;
  SceneLinear half;
  DoublePlanes exact;

  SignedMosaic mosaic(NoiseLeft noise, DemosaicMethod method = DemosaicMethod::malvar) const {
    const Plane<float>& of = noise == NoiseLeft::none ? shot.signal_e : noise == NoiseLeft::all ? noisy_e : clean_e;
    return mosaic_of(of.view(), shot, noise, method);
  }
};

Plane<float> denoised(const DenoiseShot& shot, Executor& executor) {
  const int width = shot.raw_e.width(), height = shot.raw_e.height();
  Plane<float> out(width, height);
  const denoise::DenoiseOptions options{.level = denoise::Level::standard, .white_gain = bench_white_gain};
  denoise::Denoiser(width, height, executor.width())
      .run({shot.raw_e.view(), BayerPhase::rggb}, shot.noise(), options, out.view(), {}, executor);
  return out;
}

std::vector<Sample> samples_of(const std::vector<BenchPicture>& pictures, const DenoiseLight& light,
                               Executor& executor) {
  std::vector<Sample> out;
  out.reserve(pictures.size());
  for (const BenchPicture& picture : pictures) {
    const int width = picture.linear.width(), height = picture.linear.height();
    Sample sample{picture,
                  take(picture, light, seed_of(picture, light)),
                  PictureTruth(picture.linear.view(), executor),
                  Plane<float>(width, height),
                  {},
                  SceneLinear(width, height),
                  SceneLinear(width / 2, height / 2),
                  {Plane<double>(width, height), {width, height}, {width, height}}};
    const Plane<float>& raw = sample.shot.raw_e;
    std::transform(raw.data(), raw.data() + raw.size(), sample.noisy_e.data(),
                   [dark_e = static_cast<float>(light.dark_e)](float e) { return e - dark_e; });
    sample.clean_e = denoised(sample.shot, executor);
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
  std::function<void(Sample& sample, NoiseLeft noise, RawToRgb& kernel)> work;
  std::function<SceneLinear(const Sample& sample)> result;
};

SceneLinear copy_of(const SceneLinear& image) {
  SceneLinear out(image.width(), image.height());
  for (std::size_t c = 0; c < 3; ++c) out.plane[c] = image.plane[c].clone();
  return out;
}

Method by_kernel(DemosaicMethod method) {
  return {std::string(name_of(method)),
          [method](Sample& sample, NoiseLeft noise, RawToRgb& kernel) {
            InlineExecutor one;
            kernel.linear(sample.mosaic(noise, method), untouched, sample.light.view(), one);
          },
          [](const Sample& sample) { return copy_of(sample.light); }};
}

std::vector<Method> methods() {
  const auto exact = [](const Sample& sample) { return rounded(sample.exact); };
  return {
      {"half (2x2 means)",
       [](Sample& sample, NoiseLeft noise, RawToRgb& kernel) {
         InlineExecutor one;
         kernel.bin2x2(sample.mosaic(noise), sample.half.view(), one);
       },
       [](const Sample& sample) {
         return enlarged_twice(sample.half.view(), sample.light.width(), sample.light.height());
       }},
      by_kernel(DemosaicMethod::malvar),
      by_kernel(DemosaicMethod::encoded_malvar),
      by_kernel(DemosaicMethod::residual),
      by_kernel(DemosaicMethod::residual_median),
      {"bilinear, double",
       [](Sample& sample, NoiseLeft noise, RawToRgb&) { demosaic_bilinear(sample.mosaic(noise), sample.exact); },
       exact},
      {"malvar, double",
       [](Sample& sample, NoiseLeft noise, RawToRgb&) { demosaic_malvar(sample.mosaic(noise), sample.exact); }, exact}};
}

/// Data that all groups use.
struct Bench {
  std::vector<Sample> samples;         // in dim light
  std::vector<Sample> bright_samples;  // brighter ones
  RawToRgb kernel;
  BenchRenderer renderer;
  Executor& executor;

  AccuracyLevel level(const Method& method, std::vector<Sample>& of, NoiseLeft noise) {
    AccuracyLevel out{.name = method.name,
                      .run =
                          [this, method, &of, noise] {
                            for (Sample& sample : of) method.work(sample, noise, kernel);
                          },
                      .largest = 0};
    for (Sample& sample : of) {
      method.work(sample, noise, kernel);
      const SceneLinear display = renderer.display_of(method.result(sample));
      const ColourDifference error = display_difference(display.view(), sample.truth, executor);
      out.error += error.mean / static_cast<double>(of.size());
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
      kernel.linear(sample.mosaic(NoiseLeft::all), untouched, sample.light.view(), one);
      demosaic_malvar(sample.mosaic(NoiseLeft::all), sample.exact);
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
  const auto add = [&](const std::string& name, std::vector<Sample>& samples, NoiseLeft noise) {
    AccuracyGroup group{name, "mean CIEDE2000 against the truth", {}};
    group.levels.reserve(all.size());
    for (const Method& method : all) group.levels.push_back(bench.level(method, samples, noise));
    out.push_back(std::move(group));
  };
  add("no noise", bench.samples, NoiseLeft::none);
  add(fmt::format("{:g} e-, denoised by standard", bright.mean_e), bench.bright_samples, NoiseLeft::reduced);
  add(fmt::format("{:g} e-, denoised by standard", dim.mean_e), bench.samples, NoiseLeft::reduced);
  add(fmt::format("{:g} e-, noise left in", dim.mean_e), bench.samples, NoiseLeft::all);
  AccuracyGroup rounding{"rounding of malvar", "mean difference from double [1e-6 of white]", {}};
  for (const std::size_t i : {std::size_t{1}, all.size() - 1}) {
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
  Bench bench{samples_of(*pictures, dim, executor), samples_of(*pictures, bright, executor), RawToRgb(width, 1),
              BenchRenderer(width, executor), executor};
  const AccuracyTiming timing{.rounds = options.quick ? 5 : 7, .min_s = 1e-3};
  const std::vector<AccuracyGroup> groups = groups_of(bench);
  std::vector<AccuracyRow> rows;
  for (const AccuracyGroup& group : groups) {
    for (AccuracyRow& row : measure(group, timing)) rows.push_back(std::move(row));
    options.advance(1 / static_cast<double>(groups.size()), "demosaicing: " + group.name);
  }
  BenchOutcome out = accuracy_outcome("demosaic", rows, timing, 1);
  out.remarks.push_back(
      fmt::format("{} images{} with a lens blur of {} px, RGGB, white gains 2, 1, 1.5. Colours are moved into the "
                  "gamut before they are compared. For half, only the time of the means is measured; they are enlarged "
                  "by interpolation for the comparison",
                  pictures->size(), options.quick ? ", quick: crops of them" : "", bench_lens_px));
  return out;
}

}  // namespace lowlux::isp
