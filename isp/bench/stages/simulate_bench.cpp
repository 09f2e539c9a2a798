#include <algorithm>
#include <cmath>
#include <memory>
#include <utility>

#include <fmt/format.h>

#include "capture/synthetic/synthetic_source.h"
#include "isp/bench/accuracy_time.h"
#include "isp/bench/scenes/simulated_camera.h"
#include "isp/bench/stages/simulation_stages.h"
#include "isp/metrics/picture_comparison.h"
#include "isp/model/colour/colour_difference.h"

namespace lowlux::isp {
namespace {

using capture::PhotonSampling;
using capture::SyntheticSource;

constexpr int box_px = 8;
constexpr std::uint32_t pair_frame = 10;  // this frame and the next have a difference that is noise

/// A way to simulate, as the options of `lowlux simulate` select it.
struct SimulatePlan {
  std::string name;
  PhotonSampling sampling = PhotonSampling::physical;
  capture::NoiseSourceChoice effects;
  std::uint32_t frame = 0;  // frame whose noise is drawn
};

/// Returns the plans; the first is the reference.
std::vector<SimulatePlan> simulate_plans() {
  const capture::NoiseSourceChoice all, automatic{Tolerance{}, {}}, none{std::nullopt, NoiseSourceSet()};
  return {{"physical, all", PhotonSampling::physical, all},
          {"physical, auto", PhotonSampling::physical, automatic},
          {"physical, none", PhotonSampling::physical, none},
          {"physical, all, another frame", PhotonSampling::physical, all, 1},
          {"published, all", PhotonSampling::published, all}};
}

/// Returns the charge above the pedestal [e-] of a file, by its black and white level alone.
Plane<float> charge_of_file(const RawDn& raw, double saturation_e) {
  const double black = raw.black_tag.value().at(0, 0);  // simulated files have one level
  const double e_per_code = saturation_e / (raw.white_dn[1] - black);
  Plane<float> out(raw.dn.width(), raw.dn.height());
  std::transform(raw.dn.data(), raw.dn.data() + raw.dn.size(), out.data(), [&](std::uint16_t code) {
    return static_cast<float>((static_cast<double>(code) - black) * e_per_code);
  });
  return out;
}

std::vector<Lab> boxes_of(const RawDn& raw, const Developing& developing, double saturation_e) {
  const Plane<float> charge_e = charge_of_file(raw, saturation_e);
  std::vector<Lab> out;
  const auto boxes = box_statistics(std::as_const(charge_e).view(), raw.phase, box_px);
  out.reserve(boxes.size());
  for (const BoxStatistics& box : boxes) out.push_back(developed_lab(developing, box.mean));
  return out;
}

/// Holds the sources of all images in one light by one plan.
struct PlanSources {
  std::vector<SyntheticSource> sources;
  double megapixels = 0;
};

Result<PlanSources> sources_of(const std::vector<BenchPicture>& pictures, const BenchLight& light,
                               const SimulatePlan& plan, Executor& executor) {
  PlanSources out;
  out.sources.reserve(pictures.size());
  for (const BenchPicture& picture : pictures) {
    auto source = SyntheticSource::of(
        bench_scene(picture, light.white_cd_m2), bench_camera(), bench_response(),
        {.exposure = light.exposure(), .sampling = plan.sampling, .effects = plan.effects}, executor);
    if (!source) return tl::make_unexpected(source.error());
    out.megapixels += 1e-6 * static_cast<double>(source->light().e_per_s.size());
    out.sources.push_back(*std::move(source));
  }
  return out;
}

/// Returns the mean temporal variance of a pixel: half the mean square of the difference of two frames [e-^2].
double temporal_variance_e2(const PlanSources& plan, double saturation_e, Executor& executor) {
  double sum = 0, count = 0;
  for (const SyntheticSource& source : plan.sources) {
    const Plane<float> a = charge_of_file(source.frame(pair_frame, executor).raw, saturation_e);
    const Plane<float> b = charge_of_file(source.frame(pair_frame + 1, executor).raw, saturation_e);
    for (std::size_t i = 0; i < a.size(); ++i) sum += 0.5 * std::pow(static_cast<double>(a.data()[i] - b.data()[i]), 2);
    count += static_cast<double>(a.size());
  }
  return sum / count;
}

/// Errors of a plan.
struct PlanError {
  double p95 = 0;       // 95th percentile of CIEDE2000 of boxes
  double variance = 0;  // relative error of temporal_variance_e2()
};

/// Computes errors of a light's plans, against the first plan that is requested.
class LightErrors {
 public:
  PlanError of(const PlanSources& plan, std::uint32_t frame, Executor& executor) {
    const double saturation_e = saturation_charge_e(bench_camera().model);
    std::vector<float> differences;
    for (std::size_t i = 0; i < plan.sources.size(); ++i) {
      const SyntheticSource& source = plan.sources[i];
      const auto boxes = boxes_of(source.frame(frame, executor).raw, source.developing(), saturation_e);
      if (reference_.size() == i) reference_.push_back(boxes);
      differences.reserve(differences.size() + boxes.size());
      for (std::size_t b = 0; b < boxes.size(); ++b) {
        differences.push_back(static_cast<float>(ciede2000(reference_[i][b], boxes[b])));
      }
    }
    const double variance_e2 = temporal_variance_e2(plan, saturation_e, executor);
    if (!(reference_e2_ > 0)) reference_e2_ = variance_e2;
    return {summary_of(differences).percentile_95, variance_e2 / reference_e2_ - 1};
  }

 private:
  std::vector<std::vector<Lab>> reference_;
  double reference_e2_ = 0;
};

/// Measures the levels of a light: the same work on one thread and on all.
Result<void> measure_light(const std::vector<BenchPicture>& pictures, const BenchLight& light,
                           const BenchOptions& options, Executor& executor, StageRows& rows) {
  InlineExecutor one;
  AccuracyGroup single{fmt::format("{}, one thread", light.name), "CIEDE2000 of 8 x 8 boxes, 95th percentile", {}};
  AccuracyGroup all{fmt::format("{}, {} threads", light.name, executor.width()), single.error_of, {}};
  LightErrors errors;
  const std::vector<SimulatePlan> plans = simulate_plans();
  std::vector<std::vector<double>> figures;
  figures.reserve(plans.size());
  for (const SimulatePlan& plan : plans) {
    auto made = sources_of(pictures, light, plan, executor);
    if (!made) return tl::make_unexpected(made.error());
    const auto sources = std::make_shared<const PlanSources>(*std::move(made));
    const PlanError error = errors.of(*sources, plan.frame, executor);
    figures.push_back({error.variance});
    const auto frames_on = [sources, frame = plan.frame](Executor& on) {
      return [sources, frame, &on] {
        for (const SyntheticSource& source : sources->sources) (void)source.frame(frame, on);
      };
    };
    single.levels.push_back({plan.name, error.p95, frames_on(one), sources->megapixels});
    all.levels.push_back({plan.name, error.p95, frames_on(executor), sources->megapixels});
  }
  const int rounds = options.quick ? 3 : 5;
  rows.add(single, figures, {.rounds = rounds});
  if (executor.width() > 1) rows.add(all, figures, {.rounds = rounds, .wall_clock = true});
  return {};
}

}  // namespace

Result<BenchOutcome> run_simulate_bench(const BenchOptions& options) {
  PoolExecutor executor(options.threads);
  const auto pictures = options.quick ? read_bench_pictures(options, 192, 128, 1, executor)
                                      : read_bench_pictures(options, 256, 256, 2, executor);
  if (!pictures) return tl::make_unexpected(pictures.error());
  StageRows rows{.further = {"relative error of the noise variance"}};
  const auto lights = options.quick ? std::span(bench_lights).last(1) : std::span(bench_lights);
  for (const BenchLight& light : lights) {
    if (const auto done = measure_light(*pictures, light, options, executor, rows); !done) {
      return tl::make_unexpected(done.error());
    }
    options.advance(1.0 / static_cast<double>(lights.size()), light.name);
  }
  BenchOutcome out = outcome_of("simulate", rows, TimeOf::megapixel);
  const AccuracyTiming timing{.rounds = options.quick ? 3 : 5};
  const std::string noise_of_frames =
      "All files except `another frame` have the random numbers of the reference (`published` except those of "
      "photons), so `another frame` differs by noise only. The variance of noise is half the mean square of the "
      "difference of two frames";
  out.remarks = {
      fmt::format(
          "{} images ({}); the reference is the file of physical photons with all noise sources. Codes are converted "
          "to charge by the black and the white level of the file; blocks of {} px are developed as by the planner",
          pictures->size(), name_of(options.pictures), box_px),
      noise_of_frames,
      "`published` is not combined with `auto`, which plans for physical photons only, nor with `none`, which has no "
      "photon noise",
      "Times are those of the codes of a frame, without exposing the scene and planning",
      timing_remark(timing, 1),
      "Times of several threads are wall clock"};
  return out;
}

}  // namespace lowlux::isp
