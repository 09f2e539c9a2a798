#include <algorithm>
#include <array>
#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include <fmt/format.h>

#include "isp/base/executor.h"
#include "isp/bench/accuracy_time.h"
#include "isp/bench/peers/demosaic_reference.h"
#include "isp/bench/peers/nl_means.h"
#include "isp/bench/scenes/develop_scene.h"
#include "isp/bench/stages/developing_stages.h"
#include "isp/metrics/picture_metrics.h"
#include "isp/pipeline/develop.h"
#include "isp/pipeline/plan/plan_develop.h"

namespace lowlux::isp {
namespace {

using denoise::Level;

constexpr PicturePart quick_part{192, 128};
constexpr PicturePart shown_part{288, 192};  // size of a crop in the report: enlarged twice, it fills its column
constexpr std::size_t pictures_used = 3;
constexpr int rounds_by_one = 3;
constexpr int timed_side = 3;  // images along each side of the frame that is timed
constexpr std::size_t min_undominated = 6;
constexpr double min_span = 50;
constexpr std::string_view light_of_images = "20 e-";

/// Options of develop, in addition to the look.
struct PlanChoice {
  std::optional<Level> level;  // absent: off
  bool repairs = true;         // repairs of detected defects, and of lines
  bool half = false;
  std::optional<DemosaicMethod> demosaic;

  std::string name() const {
    return fmt::format("{}{}{}{}", level ? denoise::name_of(*level) : "off", repairs ? "" : ", no repairs",
                       half ? ", half" : "", demosaic ? fmt::format(", {}", name_of(*demosaic)) : "");
  }
};

constexpr std::array plan_choices{
    PlanChoice{.repairs = false, .half = true},
    PlanChoice{.half = true},
    PlanChoice{.level = Level::draft, .half = true},
    PlanChoice{.level = Level::standard, .half = true},
    PlanChoice{.repairs = false, .demosaic = DemosaicMethod::malvar},
    PlanChoice{.repairs = false},
    PlanChoice{},
    PlanChoice{.level = Level::draft, .demosaic = DemosaicMethod::encoded_malvar},
    PlanChoice{.level = Level::draft},
    PlanChoice{.level = Level::standard, .repairs = false},
    PlanChoice{.level = Level::standard, .demosaic = DemosaicMethod::malvar},
    PlanChoice{.level = Level::standard, .demosaic = DemosaicMethod::encoded_malvar},
    PlanChoice{.level = Level::standard},
    PlanChoice{.level = Level::high},
    PlanChoice{.level = Level::best, .demosaic = DemosaicMethod::malvar},
    PlanChoice{.level = Level::best},
};

/// Plans of frames without noise: what half size and demosaicing change alone.
constexpr std::array noise_free_choices{
    PlanChoice{.repairs = false, .half = true},
    PlanChoice{.repairs = false, .demosaic = DemosaicMethod::malvar},
    PlanChoice{.repairs = false, .demosaic = DemosaicMethod::encoded_malvar},
    PlanChoice{.repairs = false, .demosaic = DemosaicMethod::residual},
    PlanChoice{.repairs = false, .demosaic = DemosaicMethod::residual_median},
};

DevelopOptions options_of(const PlanChoice& choice, Look look, const DevelopLight& light,
                          std::optional<double> exposure_ev) {
  DevelopOptions out;
  out.exposure_ev = exposure_ev;
  out.half = choice.half;
  out.demosaic = choice.demosaic;
  out.find_defects = choice.repairs;
  if (choice.level) out.denoise = {.mode = DenoiseChoice::Mode::level, .level = *choice.level};
  out.denoise.line_noise = choice.repairs;
  out.look.look = look;
  out.look.scene_luminance_cd_m2 = light.scene_cd_m2;
  return out;
}

const Encoded8& codes_of(const Developed& developed) { return std::get<Encoded8>(developed.picture); }

Result<std::vector<SimulatedRaws>> raws_of(const std::vector<BenchPicture>& pictures, const DevelopLight& light,
                                           Executor& executor) {
  std::vector<SimulatedRaws> out;
  out.reserve(pictures.size());
  for (std::size_t i = 0; i < pictures.size(); ++i) {
    auto raws = simulated_raws(pictures[i], light, i + 1, executor);
    if (!raws) return tl::make_unexpected(raws.error());
    out.push_back(*std::move(raws));
  }
  return out;
}

/// Returns an image that repeats another `side` times in each direction, mirrored in between.
BenchPicture repeated(const BenchPicture& picture, int side) {
  const int width = picture.linear.width(), height = picture.linear.height();
  BenchPicture out{picture.name, SceneLinear(side * width, side * height)};
  for (std::size_t c = 0; c < 3; ++c) {
    for (int y = 0; y < side * height; ++y) {
      const float* const from = picture.linear.plane[c].row(y / height % 2 == 0 ? y % height : height - 1 - y % height);
      float* const to = out.linear.plane[c].row(y);
      for (int k = 0; k < side; ++k) {
        if (k % 2 == 0) {
          std::copy_n(from, width, to + k * width);
        } else {
          std::reverse_copy(from, from + width, to + k * width);
        }
      }
    }
  }
  return out;
}

/// An image captured in one light, and its true colours developed.
struct Scene {
  const RawFrame& noisy;
  const RawFrame& mean;
  double exposure_ev = 0;  // automatic, of the mean frame
  double noisy_ev = 0;     // exposure of the noisy frame, for the same brightness
  PictureTruth truth;
};

Result<std::vector<Scene>> scenes_of(const std::vector<SimulatedRaws>& raws, const DevelopLight& light, Look look,
                                     Executor& executor) {
  std::vector<Scene> out;
  out.reserve(raws.size());
  for (const SimulatedRaws& of : raws) {
    const PlanChoice untouched{.repairs = false};
    const auto automatic = plan_develop(of.mean, options_of(untouched, Look::camera, light, {}), executor);
    if (!automatic) return tl::make_unexpected(automatic.error());
    const double ev = automatic->rendering.exposure_ev;
    const auto truth = develop(of.truth, options_of(untouched, look, light, ev), executor);
    if (!truth) return tl::make_unexpected(truth.error());
    const SceneLinear light_of_truth = linear_of(codes_of(*truth));
    out.push_back(
        {of.noisy, of.mean, ev, noisy_exposure_ev(of.noisy, light, ev), PictureTruth(light_of_truth.view(), executor)});
  }
  return out;
}

/// Adds a scene's contribution to the errors of a level.
Result<void> add_error(const Scene& scene, const RawFrame& frame, const DevelopOptions& options, double share,
                       AccuracyLevel& level, Executor& executor) {
  const auto developed = develop(frame, options, executor);
  if (!developed) return tl::make_unexpected(developed.error());
  SceneLinear picture = linear_of(codes_of(*developed));
  if (options.half) picture = enlarged_twice(std::as_const(picture).view(), scene.truth.width(), scene.truth.height());
  const ColourDifference error = display_difference(std::as_const(picture).view(), scene.truth, executor);
  level.error += share * error.mean;
  level.largest = std::max(level.largest, error.largest);
  return {};
}

/// Rows of one group, timed with all threads and with one.
struct MeasuredPlans {
  std::vector<AccuracyRow> by_all;
  std::vector<AccuracyRow> by_one;
};

/// @param timed  a frame as those of the scenes
Result<MeasuredPlans> measured(const std::vector<Scene>& scenes, const RawFrame& timed, bool with_noise,
                               const DevelopLight& light, Look look, const AccuracyTiming& timing, Executor& executor) {
  AccuracyGroup group{
      fmt::format("{}, {}{}", light.name, look == Look::eye ? "eye" : "camera", with_noise ? "" : ", no noise"),
      "mean CIEDE2000 against the true scene",
      {}};
  InlineExecutor one;
  Executor* executor_in_use = &executor;
  const auto frame_of = [with_noise](const Scene& scene) -> const RawFrame& {
    return with_noise ? scene.noisy : scene.mean;
  };
  const auto exposure_of = [with_noise](const Scene& scene) { return with_noise ? scene.noisy_ev : scene.exposure_ev; };
  const std::span<const PlanChoice> choices =
      with_noise ? std::span<const PlanChoice>(plan_choices) : std::span<const PlanChoice>(noise_free_choices);
  for (const PlanChoice& choice : choices) {
    AccuracyLevel level{
        .name = choice.name(), .megapixels = 1e-6 * timed.raw.active.width * timed.raw.active.height, .largest = 0};
    for (const Scene& scene : scenes) {
      const auto added = add_error(scene, frame_of(scene), options_of(choice, look, light, exposure_of(scene)),
                                   1 / static_cast<double>(scenes.size()), level, executor);
      if (!added) return tl::make_unexpected(added.error());
    }
    level.run = [&executor_in_use, &timed, options = options_of(choice, look, light, exposure_of(scenes.front()))] {
      (void)develop(timed, options, *executor_in_use);  // the same call succeeded before
    };
    group.levels.push_back(std::move(level));
  }
  MeasuredPlans out{.by_all = measure(group, timing), .by_one = {}};
  executor_in_use = &one;
  out.by_one = measure(group, {.rounds = rounds_by_one, .wall_clock = true});
  return out;
}

Finding undominated_finding(std::span<const AccuracyRow> rows) {
  std::vector<const AccuracyRow*> front;
  for (const AccuracyRow& row : rows) {
    if (row.undominated) front.push_back(&row);
  }
  std::ranges::sort(front, {}, [](const AccuracyRow* row) { return row->ms_per_mp; });
  std::string names;
  for (const AccuracyRow* row : front) names += (names.empty() ? "" : "; ") + row->level;
  const double span = front.back()->ms_per_mp / front.front()->ms_per_mp;
  return {
      "develop/undominated: " + rows.front().group,
      "number of plans that are Pareto-optimal in time and error, and the ratio of the slowest to the fastest of them",
      fmt::format("at least {}, {:g} times the time", min_undominated, min_span),
      fmt::format("{}, {:.0f} times", front.size(), span),
      front.size() >= min_undominated && span >= min_span,
      names,
      Finding::Kind::check};
}

/// Collects the results of all lights.
struct Gathered {
  std::vector<AccuracyRow> rows;
  std::vector<AccuracyRow> by_one;
  std::vector<Finding> findings;
  std::vector<BenchImage> images;
  std::vector<BenchComparison> comparisons;
};

Encoded8 middle_of(const Encoded8& picture) {
  const int width = std::min(shown_part.width, picture.width()), height = std::min(shown_part.height, picture.height());
  Encoded8 out{Plane<std::uint8_t>(3 * width, height)};
  const int left = (picture.width() - width) / 2, top = (picture.height() - height) / 2;
  for (int y = 0; y < height; ++y) {
    std::copy_n(picture.codes.row(top + y) + 3 * left, 3 * width, out.codes.row(y));
  }
  return out;
}

/// Adds the central crop of one dark frame by several plans to the page, each with automatic exposure.
Result<void> add_pictures(const RawFrame& frame, const DevelopLight& light, Executor& executor, Gathered& out) {
  struct Shown {
    const char* id;
    PlanChoice choice;
    Look look;
  };
  const PlanChoice standard{.level = Level::standard};
  for (const Shown& shown :
       {Shown{"develop-plain", {}, Look::camera}, Shown{"develop-draft", {.level = Level::draft}, Look::camera},
        Shown{"develop-standard", standard, Look::camera}, Shown{"develop-best", {.level = Level::best}, Look::camera},
        Shown{"develop-eye", standard, Look::eye}}) {
    const auto developed = develop(frame, options_of(shown.choice, shown.look, light, {}), executor);
    if (!developed) return tl::make_unexpected(developed.error());
    out.images.push_back({shown.id, middle_of(codes_of(*developed))});
  }
  out.comparisons = {
      {"Noise, " + light.name, "develop-plain", "no noise reduction", "develop-standard", "level standard"},
      {"Levels, " + light.name, "develop-draft", "level draft", "develop-best", "level best"},
      {fmt::format("Looks, {}, level standard", light.name), "develop-standard", "camera", "develop-eye",
       fmt::format("eye at {:g} cd/m2", light.scene_cd_m2)},
  };
  return {};
}

Result<void> gather(const std::vector<BenchPicture>& pictures, int side_of_timed, const DevelopLight& light,
                    const AccuracyTiming& timing, Executor& executor, Gathered& out) {
  const auto raws = raws_of(pictures, light, executor);
  if (!raws) return tl::make_unexpected(raws.error());
  // Planning takes much of the time of small frames, and little of those of cameras.
  const auto timed = simulated_raws(repeated(pictures.front(), side_of_timed), light, 1, executor);
  if (!timed) return tl::make_unexpected(timed.error());
  for (const Look look : {Look::camera, Look::eye}) {
    const auto scenes = scenes_of(*raws, light, look, executor);
    if (!scenes) return tl::make_unexpected(scenes.error());
    for (const bool with_noise : {true, false}) {
      const auto plans =
          measured(*scenes, with_noise ? timed->noisy : timed->mean, with_noise, light, look, timing, executor);
      if (!plans) return tl::make_unexpected(plans.error());
      if (with_noise) out.findings.push_back(undominated_finding(plans->by_all));
      out.rows.insert(out.rows.end(), plans->by_all.begin(), plans->by_all.end());
      out.by_one.insert(out.by_one.end(), plans->by_one.begin(), plans->by_one.end());
    }
  }
  if (light.name != light_of_images) return {};
  return add_pictures(raws->front().noisy, light, executor, out);
}

}  // namespace

Result<BenchOutcome> run_develop_bench(const BenchOptions& options) {
  PoolExecutor executor(options.threads);
  const bool quick = options.quick;
  const auto all = files_of(options.pictures);
  const auto pictures =
      read_bench_pictures(options.pictures_folder,
                          quick ? quick_files_of(options.pictures) : all.first(std::min(pictures_used, all.size())),
                          quick ? quick_part : PicturePart{768, 512}, executor);
  if (!pictures) return tl::make_unexpected(pictures.error());
  const AccuracyTiming timing{.rounds = quick ? 3 : 5, .wall_clock = true};
  const std::vector<DevelopLight> lights = develop_lights(quick);
  Gathered all_lights;
  for (const DevelopLight& light : lights) {
    const auto done = gather(*pictures, quick ? 1 : timed_side, light, timing, executor, all_lights);
    if (!done) return tl::make_unexpected(done.error());
    options.advance(1 / static_cast<double>(lights.size()), "plans at " + light.name);
  }
  BenchOutcome out = accuracy_outcome("develop", all_lights.rows, timing, options.threads);
  if (!quick) out.findings = std::move(all_lights.findings);  // for crops, planning takes most of the time
  out.images = std::move(all_lights.images);
  out.comparisons = std::move(all_lights.comparisons);
  out.table.columns.insert(out.table.columns.end(), {"one thread [ms/MP]", "its spread [%]"});
  for (std::size_t i = 0; i < out.table.rows.size(); ++i) {
    out.table.rows[i].emplace_back(all_lights.by_one[i].ms_per_mp);
    out.table.rows[i].emplace_back(100 * all_lights.by_one[i].spread);
  }
  out.remarks.push_back(fmt::format(
      "{} images{} from a simulated camera of 14 bits with masked columns. The reference is developed from the true "
      "colours of every pixel with the same brightness and look. `no noise` is the mean of the signal, whose error is "
      "that of demosaicing. Half sizes are enlarged for the comparison. Megapixels are those of the mosaic. Times are "
      "those of a frame of {} times the first image with planning, by one thread in {} rounds",
      pictures->size(), quick ? ", quick: crops of them," : "", quick ? 1 : timed_side * timed_side, rounds_by_one));
  return out;
}

}  // namespace lowlux::isp
