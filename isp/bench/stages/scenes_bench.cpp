#include <algorithm>
#include <array>
#include <iterator>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "denoise/denoiser.h"
#include "isp/base/executor.h"
#include "isp/bench/accuracy_time.h"
#include "isp/bench/marks/development_marks.h"
#include "isp/bench/peers/denoise_methods.h"
#include "isp/bench/peers/nl_means.h"
#include "isp/bench/scenes/denoise_scene.h"
#include "isp/bench/scenes/generated_scenes.h"
#include "isp/bench/stages/developing_stages.h"

namespace lowlux::isp {
namespace {

constexpr SceneSize whole_size{288, 192}, quick_size{192, 128};
constexpr double shown_mean_e = 200, marks_mean_e = 20;

/// A level of the denoiser, and a way to demosaic its result.
struct Way {
  std::string name;
  std::optional<denoise::Level> level;   // absent: noise is left in
  std::optional<DemosaicMethod> method;  // absent: as the pipeline chooses
};

std::vector<Way> ways() {
  std::vector<Way> out{{name_of_none, {}, {}}};
  for (const denoise::Level level : denoise::all_levels) out.push_back({std::string(name_of(level)), level, {}});
  for (const DemosaicMethod method : all_demosaic_methods) {
    out.push_back({fmt::format("standard, {}", name_of(method)), denoise::Level::standard, method});
  }
  return out;
}

/// Develops shots on one thread.
class Developer {
 public:
  explicit Developer(const SceneSize& size)
      : denoiser_(size.width, size.height, 1, denoise::all_levels.back()),
        renderer_(size.width, one_),
        kernel_(size.width, 1),
        mosaic_e_(size.width, size.height) {}

  SceneLinear light(const Way& way, const DenoiseShot& shot, double exposure) {
    const NoiseLeft left = way.level ? NoiseLeft::reduced : NoiseLeft::all;
    clean(way, shot);
    if (!way.method) return renderer_.render(mosaic_e_.view(), shot, left, exposure).light;
    SceneLinear out(mosaic_e_.width(), mosaic_e_.height());
    kernel_.linear(mosaic_of(mosaic_e_.view(), shot, left, *way.method, exposure),
                   {.clip = clip_of(shot, exposure), .move_into_gamut = false}, out.view(), one_);
    return out;
  }
  SceneLinear display_of(const SceneLinear& light) { return renderer_.display_of(light); }

 private:
  void clean(const Way& way, const DenoiseShot& shot) {
    if (way.level) {
      denoiser_.run({shot.raw_e.view(), BayerPhase::rggb}, shot.noise(),
                    {.level = *way.level, .white_gain = bench_white_gain}, mosaic_e_.view(), {}, one_);
      return;
    }
    std::transform(shot.raw_e.data(), shot.raw_e.data() + shot.raw_e.size(), mosaic_e_.data(),
                   [dark_e = static_cast<float>(shot.light.dark_e)](float e) { return e - dark_e; });
  }

  InlineExecutor one_;
  denoise::Denoiser denoiser_;
  BenchRenderer renderer_;
  RawToRgb kernel_;
  Plane<float> mosaic_e_;
};

struct Sample {
  std::string_view set;
  BenchPicture picture;
  DenoiseShot shot;
  PictureTruth truth;
};

std::vector<Sample> samples_of(const GeneratedSet& set, double mean_e, const BenchOptions& options,
                               const SceneSize& size) {
  std::vector<Sample> out;
  InlineExecutor one;
  const auto seeds = seeds_of(options.pictures);
  for (const std::uint64_t seed : options.quick ? seeds.first(1) : seeds) {
    BenchPicture picture = set.scene(size, seed);
    DenoiseShot shot = take(picture, {mean_e, 2, 1.5}, seed + static_cast<std::uint64_t>(mean_e), set.saturates);
    PictureTruth truth(std::as_const(picture.linear).view(), one);
    out.push_back({set.name, std::move(picture), std::move(shot), std::move(truth)});
  }
  return out;
}

/// Adds the rows of one set in one light, and images of its first scene.
/// @param images  null: none are made
void add_rows(const std::string& name, std::vector<Sample>& samples, Developer& developer, StageRows& rows,
              std::vector<BenchImage>* images) {
  AccuracyGroup group{name, "mean CIEDE2000 against the truth", {}};
  std::vector<std::vector<double>> psnr_db;
  InlineExecutor one;
  for (const Way& way : ways()) {
    AccuracyLevel level{.name = way.name,
                        .run =
                            [&samples, &developer, way] {
                              for (const Sample& sample : samples) developer.light(way, sample.shot, 1);
                            },
                        .largest = 0};
    double db = 0;
    const double fraction = 1 / static_cast<double>(samples.size());
    for (const Sample& sample : samples) {
      const SceneLinear display = developer.display_of(developer.light(way, sample.shot, 1));
      const ColourDifference error = display_difference(display.view(), sample.truth, one);
      level.error += fraction * error.mean;
      level.largest = std::max(level.largest, error.largest);
      level.megapixels += 1e-6 * static_cast<double>(sample.shot.raw_e.size());
      db += fraction * encoded_psnr_db(display.view(), sample.truth, one);
      if (images != nullptr && &sample == samples.data() && !way.method) {
        std::string id = fmt::format("scenes-{}-{}", samples.front().set, way.name);
        std::erase(id, ',');
        std::ranges::replace(id, ' ', '-');
        images->push_back({std::move(id), codes_of(display.view())});
      }
    }
    group.levels.push_back(std::move(level));
    psnr_db.push_back({db});
  }
  rows.add(group, std::move(psnr_db), {.rounds = 3});
}

/// Returns a check for each set in each light: no level of the denoiser has a lower PSNR than no noise reduction.
std::vector<Finding> gain_findings(const StageRows& rows) {
  constexpr double tolerance_db = 0.1;
  std::vector<Finding> out;
  double none_db = 0, min_db = 0;
  for (std::size_t i = 0; i < rows.rows.size(); ++i) {
    const AccuracyRow& row = rows.rows[i];
    const double psnr_db = rows.figures[i][0];
    if (row.level == name_of_none) none_db = psnr_db;
    const auto is_level = [&](denoise::Level level) { return row.level == name_of(level); };
    if (!std::ranges::any_of(denoise::all_levels, is_level)) continue;
    min_db = is_level(denoise::all_levels.front()) ? psnr_db : std::min(min_db, psnr_db);
    if (!is_level(denoise::all_levels.back())) continue;
    out.push_back(check_of("scenes/gain/" + row.group, "PSNR of the worst level minus PSNR without noise reduction",
                           fmt::format("at least {:+.1f} dB", -tolerance_db),
                           fmt::format("{:+.2f} dB", min_db - none_db), min_db - none_db >= -tolerance_db));
  }
  return out;
}

std::vector<Finding> marks_findings(const BenchOptions& options, const SceneSize& size, Developer& developer) {
  std::vector<Finding> out;
  for (const Way& way : ways()) {
    if (!way.level) continue;
    const auto develop = [&](const DenoiseShot& shot, double exposure) { return developer.light(way, shot, exposure); };
    for (Finding& finding : mark_findings(way.name, measure_marks(develop, marks_mean_e, size))) {
      out.push_back(std::move(finding));
    }
    options.advance(0, "marks of " + way.name);
  }
  return out;
}

}  // namespace

Result<BenchOutcome> run_scenes_bench(const BenchOptions& options) {
  const SceneSize size = options.quick ? quick_size : whole_size;
  Developer developer(size);
  StageRows rows{.further = {"PSNR [dB]"}};
  std::vector<BenchImage> images;
  const std::vector<double> lights =
      options.quick ? std::vector<double>{shown_mean_e} : std::vector<double>{2000, shown_mean_e, 20};
  const double share = 1 / static_cast<double>(lights.size() * generated_sets().size());
  for (const GeneratedSet& set : generated_sets()) {
    for (const double mean_e : lights) {
      std::vector<Sample> samples = samples_of(set, mean_e, options, size);
      const bool is_shown = mean_e == shown_mean_e && !options.quick;
      add_rows(fmt::format("{}, {:g} e-", set.name, mean_e), samples, developer, rows, is_shown ? &images : nullptr);
      options.advance(share, fmt::format("{} at {:g} e-", set.name, mean_e));
    }
  }
  BenchOutcome out = outcome_of("scenes", rows, TimeOf::megapixel);
  const std::string shown = fmt::format(", {:g} e-", shown_mean_e);  // three plots for each set would say less
  std::erase_if(out.plots, [&](const Plot& plot) { return plot.title.find(shown) == std::string::npos; });
  out.images = std::move(images);
  out.findings = gain_findings(rows);
  std::ranges::move(marks_findings(options, size, developer), std::back_inserter(out.findings));
  out.remarks.push_back(fmt::format(
      "generated scenes of {} x {} px, {} seeds, RGGB, white gains 2, 1, 1.5, 2 e- of dark charge, 1.5 e- of read "
      "noise; lamps and stars saturate at white; times include noise reduction and demosaicing; artefacts at {:g} e-",
      size.width, size.height, name_of(options.pictures), marks_mean_e));
  return out;
}

}  // namespace lowlux::isp
