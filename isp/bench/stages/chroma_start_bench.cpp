#include <algorithm>
#include <array>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "isp/base/executor.h"
#include "isp/bench/accuracy_time.h"
#include "isp/bench/peers/denoise_methods.h"
#include "isp/bench/stages/developing_stages.h"

namespace lowlux::isp {
namespace {

using denoise::Level;

constexpr PicturePart part{768, 512}, quick_part{192, 128};
constexpr std::array fast_levels{Level::draft, Level::standard, Level::high};
constexpr std::array best_level{Level::best};
constexpr std::array<DenoiseLight, 4> lights{{{200, 2, 1.5}, {20, 2, 1.5}, {20, 200, 4}, {4, 200, 4}}};
constexpr std::array<std::optional<int>, 4> starts{0, 1, 2, std::nullopt};

std::string name_of(Level level, std::optional<int> start) {
  return fmt::format("{}, {}", denoise::name_of(level), start ? std::to_string(*start) : "auto");
}

/// An image captured in one light.
struct Sample {
  const BenchPicture& picture;
  DenoiseShot shot;
  PictureTruth truth;
  Plane<float> signal_e;  // memory of the result
};

std::vector<Sample> samples_of(const std::vector<BenchPicture>& pictures, const DenoiseLight& light,
                               Executor& executor) {
  std::vector<Sample> out;
  out.reserve(pictures.size());
  for (const BenchPicture& picture : pictures) {
    out.push_back({picture, take(picture, light, seed_of(picture, light)),
                   PictureTruth(picture.linear.view(), executor),
                   Plane<float>(picture.linear.width(), picture.linear.height())});
  }
  return out;
}

void run(Sample& sample, denoise::Denoiser& denoiser, const denoise::DenoiseOptions& options) {
  InlineExecutor one;
  denoiser.run({sample.shot.raw_e.view(), BayerPhase::rggb}, sample.shot.noise(), options, sample.signal_e.view(), {},
               one);
}

/// Holds the levels' memory and the images they process.
struct Bench {
  std::vector<BenchPicture> pictures;
  MethodMemory memory;
  Executor& executor;

  Bench(std::vector<BenchPicture> read, Executor& with)
      : pictures(std::move(read)),
        memory(largest_of(pictures).width, largest_of(pictures).height, with),
        executor(with) {}

  AccuracyLevel level(std::vector<Sample>& samples, const denoise::DenoiseOptions& options) {
    AccuracyLevel out{.name = name_of(options.level, options.chroma_start),
                      .run =
                          [this, &samples, options] {
                            for (Sample& sample : samples) lowlux::isp::run(sample, memory.denoiser, options);
                          },
                      .largest = 0};
    for (Sample& sample : samples) {
      lowlux::isp::run(sample, memory.denoiser, options);
      const RenderedPicture picture =
          memory.renderer.render(std::as_const(sample.signal_e).view(), sample.shot, NoiseLeft::reduced);
      const ColourDifference error = display_difference(picture.display.view(), sample.truth, executor);
      out.error += error.mean / static_cast<double>(samples.size());
      out.largest = std::max(out.largest, error.largest);
      out.megapixels += 1e-6 * static_cast<double>(sample.signal_e.size());
    }
    return out;
  }

  std::vector<AccuracyRow> rows(const DenoiseLight& light, std::span<const Level> levels,
                                const AccuracyTiming& timing) {
    std::vector<Sample> samples = samples_of(pictures, light, executor);
    AccuracyGroup group{lowlux::isp::name_of(light), "mean CIEDE2000 against the truth", {}};
    for (const Level which : levels) {
      if (which == Level::best) group.name += ", best, on crops";
      for (const std::optional<int> start : starts) {
        if (which == Level::best && start == 1) continue;  // best starts at 0 and 2 alone
        group.levels.push_back(level(samples, {.level = which, .white_gain = bench_white_gain, .chroma_start = start}));
      }
    }
    return measure(group, timing);
  }
};

}  // namespace

Result<BenchOutcome> run_chroma_start_bench(const BenchOptions& options) {
  PoolExecutor executor(options.threads);
  const auto quick_files = quick_files_of(options.pictures);
  auto parts = read_bench_pictures(options.pictures_folder, quick_files, quick_part, executor);
  if (!parts) return tl::make_unexpected(parts.error());
  Bench small(*std::move(parts), executor);
  std::unique_ptr<Bench> whole;
  if (!options.quick) {
    auto pictures = read_bench_pictures(options.pictures_folder, files_of(options.pictures), part, executor);
    if (!pictures) return tl::make_unexpected(pictures.error());
    whole = std::make_unique<Bench>(*std::move(pictures), executor);
  }
  const AccuracyTiming timing{.rounds = 5}, of_best{.rounds = 3};
  std::vector<AccuracyRow> rows;
  for (std::size_t i = 0; i < lights.size(); ++i) {
    if (options.quick && i % 2 == 0) continue;
    for (auto& row : (whole ? *whole : small).rows(lights[i], fast_levels, timing)) rows.push_back(std::move(row));
    for (auto& row : small.rows(lights[i], best_level, of_best)) rows.push_back(std::move(row));
    options.advance(options.quick ? 0.5 : 0.25, "chroma at " + name_of(lights[i]));
  }
  BenchOutcome out = accuracy_outcome("chroma-start", rows, timing, 1);
  out.remarks.push_back(
      fmt::format("{} images{}, simulated like those of the stage denoise; level `best` in {} rounds on crops of {} x "
                  "{} pixels of {}",
                  whole ? whole->pictures.size() : small.pictures.size(), options.quick ? ", quick: crops of them" : "",
                  of_best.rounds, quick_part.width, quick_part.height, small.pictures.size()));
  return out;
}

}  // namespace lowlux::isp
