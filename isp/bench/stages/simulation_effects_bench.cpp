#include <algorithm>
#include <cassert>
#include <cmath>
#include <memory>
#include <utility>

#include <fmt/format.h>

#include "capture/synthetic/block_levels.h"
#include "capture/synthetic/sensor_sim.h"
#include "capture/synthetic/synthetic_source.h"
#include "isp/bench/accuracy_time.h"
#include "isp/bench/peers/nl_means.h"
#include "isp/bench/scenes/simulated_camera.h"
#include "isp/bench/stages/simulation_stages.h"
#include "isp/model/colour/colour_difference.h"

namespace lowlux::isp {
namespace {

constexpr std::array tolerances{Tolerance{0.1, 0.01}, Tolerance{0.5, 0.05}, Tolerance{2, 0.2}};
constexpr int shown_px = 384;  // side of an image's crop in the report, before binning

std::string name_of(const Tolerance& tolerance) {
  return fmt::format("auto {:g},{:g}", tolerance.delta_e, tolerance.relative_variance);
}

std::string id_of(const BenchLight& light) {
  std::string id = light.name;
  std::ranges::replace(id, ' ', '-');
  return id;
}

/// One image in one light: its charge, its blocks, and the frame with all effects.
struct PictureShot {
  capture::SyntheticSource source;
  std::vector<BlockLevel> blocks;
  Plane<float> all_dn;
};

/// Selects the effects of a level: those the planner keeps for a tolerance, or a fixed set.
struct Choice {
  std::string name;
  std::optional<Tolerance> tolerance;
  NoiseSourceSet kept;
};

std::vector<Choice> choices() {
  std::vector<Choice> out{{"all", std::nullopt, NoiseSourceSet::all()}};
  out.reserve(effect_count + tolerances.size() + 2);
  for (int e = 0; e < effect_count; ++e) {
    const auto effect = static_cast<Effect>(e);
    out.push_back({fmt::format("without {}", effect_names()[static_cast<std::size_t>(e)]), std::nullopt,
                   NoiseSourceSet::all().without(effect)});
  }
  for (const Tolerance& tolerance : tolerances) out.push_back({name_of(tolerance), tolerance, {}});
  out.push_back({"none", std::nullopt, NoiseSourceSet()});
  return out;
}

/// Measures all images in one light.
class EffectsLight {
 public:
  static Result<EffectsLight> of(const std::vector<BenchPicture>& pictures, const BenchLight& light,
                                 Executor& executor) {
    EffectsLight out(light);
    for (const BenchPicture& picture : pictures) {
      auto source =
          capture::SyntheticSource::of(bench_scene(picture, light.white_cd_m2), out.camera_, bench_response(),
                                       {.exposure = light.exposure(), .lens_blur_px = effects_lens_px}, executor);
      if (!source) return tl::make_unexpected(source.error());
      Plane<float> dn(source->light().e_per_s.width(), source->light().e_per_s.height());
      out.shots_.push_back({*std::move(source), {}, std::move(dn)});
      PictureShot& shot = out.shots_.back();
      shot.blocks = capture::block_levels(out.frame_of(shot));
      capture::read_out(out.frame_of(shot), out.plan_of(shot, choices().front()), executor, shot.all_dn.view());
      out.megapixels_ += 1e-6 * static_cast<double>(shot.all_dn.size());
      out.max_width_ = std::max(out.max_width_, shot.all_dn.width());
      out.max_height_ = std::max(out.max_height_, shot.all_dn.height());
    }
    return out;
  }

  /// Returns the levels and their errors, and adds changes and findings for each choice.
  AccuracyGroup measure(std::vector<std::vector<double>>& figures, std::vector<Finding>& findings) {
    AccuracyGroup group{light_.name, "largest CIEDE2000 of block means, compared with all noise sources", {}};
    auto dn = std::make_shared<Plane<float>>(max_width_, max_height_);
    Closest of_tolerance, of_prediction;
    for (const Choice& choice : choices()) {
      std::vector<NoiseSourcePlan> plans;
      plans.reserve(shots_.size());
      for (const PictureShot& shot : shots_) plans.push_back(plan_of(shot, choice));
      const auto [measured, predicted] = changes_of(plans);
      figures.push_back({predicted.delta_e, measured.relative_variance, predicted.relative_variance});
      if (choice.tolerance) {
        of_tolerance.look_at(choice.name, measured, {choice.tolerance->delta_e, choice.tolerance->relative_variance});
      } else {
        of_prediction.look_at(choice.name, measured, predicted);
      }
      group.levels.push_back(
          {choice.name, measured.delta_e, [this, plans = std::move(plans), dn] { read_all(plans, *dn); }, megapixels_});
    }
    findings.push_back(promise_finding(of_tolerance));
    findings.push_back(bound_finding(of_prediction));
    return group;
  }

  /// Returns the centre of the first image with all effects, by the planner at each tolerance, and with none.
  Encoded8 strip() const {
    const PictureShot& shot = shots_.front();
    const int width = std::min(shown_px, shot.all_dn.width()), height = std::min(shown_px, shot.all_dn.height());
    std::vector<Choice> shown{choices().front()};
    shown.reserve(tolerances.size() + 2);
    for (const Tolerance& tolerance : tolerances) shown.push_back({{}, tolerance, {}});
    shown.push_back({{}, std::nullopt, NoiseSourceSet()});
    SceneLinear out(static_cast<int>(shown.size()) * (width / 2), height / 2);
    const Developing developing = shown_developing(shot);
    InlineExecutor one;
    for (std::size_t i = 0; i < shown.size(); ++i) {
      Plane<float> dn(shot.all_dn.width(), shot.all_dn.height());
      capture::read_out(frame_of(shot), plan_of(shot, shown[i]), one, dn.view());
      const Plane<float> charge_e = charge_of(dn, camera_.model);
      const int left = (dn.width() - width) / 2 & ~1, top = (dn.height() - height) / 2 & ~1;
      const SceneLinear part =
          binned_picture(std::as_const(charge_e).view().crop(left, top, width, height), developing);
      for (std::size_t c = 0; c < 3; ++c) {
        for (int y = 0; y < part.height(); ++y) {
          std::copy_n(part.plane[c].row(y), part.width(), out.plane[c].row(y) + static_cast<int>(i) * part.width());
        }
      }
    }
    return codes_of(std::as_const(out).view());
  }

 private:
  explicit EffectsLight(const BenchLight& light) : light_(light), camera_(effects_camera()) {}

  capture::SensorFrame frame_of(const PictureShot& shot) const {
    return {.sensor = camera_.model,
            .exposure = light_.exposure(),
            .rate_e_per_s = shot.source.light().e_per_s.view(),
            .seed = 1,
            .pattern_seed = 1,
            .blurred_e_per_s = shot.source.light().blurred_e_per_s.view()};
  }
  NoiseSourcePlan plan_of(const PictureShot& shot, const Choice& choice) const {
    if (!choice.tolerance) return plan_keeping(choice.kept, shot.all_dn.width(), shot.all_dn.height());
    return plan_noise_sources(camera_.model, light_.exposure(), shot.source.developing(), shot.blocks,
                              *choice.tolerance);
  }
  void read_all(const std::vector<NoiseSourcePlan>& plans, Plane<float>& dn) const {
    InlineExecutor one;
    for (std::size_t i = 0; i < shots_.size(); ++i) {
      const Plane<float>& all = shots_[i].all_dn;
      capture::read_out(frame_of(shots_[i]), plans[i], one, dn.view().crop(0, 0, all.width(), all.height()));
    }
  }

  /// Develops normally, but maps the brightest pixel to white however dark it is.
  static Developing shown_developing(const PictureShot& shot) {
    Developing out = shot.source.developing();
    const double peak_e = std::ranges::max(shot.blocks, {}, &BlockLevel::peak_e).peak_e;
    const double white_e = *std::ranges::max_element(out.white_e);
    for (double& channel_e : out.white_e) channel_e *= peak_e / white_e;
    return out;
  }

  struct Changes {
    PredictedChange measured;
    PredictedChange predicted;
  };
  Changes changes_of(const std::vector<NoiseSourcePlan>& plans) const {
    Changes out;
    InlineExecutor one;
    for (std::size_t i = 0; i < shots_.size(); ++i) {
      const PictureShot& shot = shots_[i];
      Plane<float> dn(shot.all_dn.width(), shot.all_dn.height());
      capture::read_out(frame_of(shot), plans[i], one, dn.view());
      const ChangedFrame frame{camera_.model, light_.exposure(), shot.source.developing()};
      out.measured = larger(out.measured, measured_change(frame, dn, shot.all_dn));
      out.predicted = larger(out.predicted, predicted_change(frame, shot.blocks, plans[i]));
    }
    return out;
  }

  /// Finds the choice that came closest to its limit: the tolerance of a plan, or the prediction.
  struct Closest {
    double share = 0;
    std::string choice = "-";

    void look_at(const std::string& name, const PredictedChange& change, const PredictedChange& most) {
      const auto share_of = [](double value, double limit) { return value > 0 ? value / limit : 0.0; };
      const double here =
          std::max(share_of(change.delta_e, most.delta_e), share_of(change.relative_variance, most.relative_variance));
      if (here > share) *this = {here, name};
    }
    std::string text() const { return fmt::format("{:.3g} ({})", share, choice); }
  };

  Finding promise_finding(const Closest& closest) const {
    return check_of("simulation-effects/promise-" + id_of(light_),
                    "the planner keeps its tolerances in every block: largest fraction of them that is used", "< 1",
                    closest.text(), closest.share < 1);
  }
  Finding bound_finding(const Closest& closest) const {
    return check_of("simulation-effects/bound-" + id_of(light_),
                    "no block changes by more than predicted: largest ratio of actual to predicted change", "<= 1",
                    closest.text(), closest.share <= 1);
  }

  BenchLight light_;
  NamedSensor camera_;
  std::vector<PictureShot> shots_;
  double megapixels_ = 0;
  int max_width_ = 0, max_height_ = 0;
};

}  // namespace

Result<BenchOutcome> run_simulation_effects_bench(const BenchOptions& options) {
  PoolExecutor executor(options.threads);
  const auto pictures = options.quick ? read_bench_pictures(options, 192, 128, 1, executor)
                                      : read_bench_pictures(options, 768, 512, 0, executor);
  if (!pictures) return tl::make_unexpected(pictures.error());
  const AccuracyTiming timing{.rounds = options.quick ? 3 : 5};
  StageRows rows{.further = {"predicted CIEDE2000", "relative variance", "predicted variance"}};
  std::vector<Finding> findings;
  std::vector<BenchImage> images;
  images.reserve(bench_lights.size());
  for (const BenchLight& scene_light : bench_lights) {
    auto light = EffectsLight::of(*pictures, scene_light, executor);
    if (!light) return tl::make_unexpected(light.error());
    std::vector<std::vector<double>> figures;
    const AccuracyGroup group = light->measure(figures, findings);
    rows.add(group, std::move(figures), timing);
    images.push_back({"simulation-effects-" + id_of(scene_light), light->strip()});
    options.advance(1.0 / bench_lights.size(), scene_light.name);
  }
  BenchOutcome out = outcome_of("simulation-effects", rows, TimeOf::megapixel);
  out.findings = std::move(findings);
  out.images = std::move(images);
  out.remarks = {
      fmt::format(
          "{} images ({}); the reference is the frame with all noise sources and the same random numbers. Figures are "
          "the largest over blocks of {} px: CIEDE2000 of their means, and relative variance of R, G or B",
          pictures->size(), name_of(options.pictures), effect_block),
      "Times are those of reading out one frame as floats, without planning; auto DE,VARIANCE is the planner with "
      "these tolerances",
      "Images show, from left to right: all noise sources, auto at each tolerance, none; they are binned 2 x 2, and "
      "white is the brightest pixel",
      timing_remark(timing, 1)};
  return out;
}

PredictedChange larger(const PredictedChange& a, const PredictedChange& b) {
  return {std::max(a.delta_e, b.delta_e), std::max(a.relative_variance, b.relative_variance)};
}

PredictedChange measured_change(const ChangedFrame& frame, const Plane<float>& dn, const Plane<float>& reference_dn) {
  assert(dn.width() == reference_dn.width() && dn.height() == reference_dn.height());
  const auto statistics = [&](const Plane<float>& of) {
    const Plane<float> charge_e = charge_of(of, frame.sensor);
    return box_statistics(std::as_const(charge_e).view(), BayerPhase::rggb, effect_block);
  };
  const auto changed = statistics(dn), reference = statistics(reference_dn);
  const double k = frame.sensor.system_gain_dn_per_e, floor_e2 = variance_floor_dn2 / (k * k);
  PredictedChange out;
  for (std::size_t i = 0; i < changed.size(); ++i) {
    out.delta_e = std::max(out.delta_e, ciede2000(developed_lab(frame.developing, reference[i].mean),
                                                  developed_lab(frame.developing, changed[i].mean)));
    for (std::size_t c = 0; c < 3; ++c) {
      const double change_e2 = std::fabs(changed[i].variance[c] - reference[i].variance[c]);
      out.relative_variance = std::max(out.relative_variance, change_e2 / std::max(reference[i].variance[c], floor_e2));
    }
  }
  return out;
}

PredictedChange predicted_change(const ChangedFrame& frame, std::span<const BlockLevel> blocks,
                                 const NoiseSourcePlan& plan) {
  assert(blocks.size() == plan.region_of_block.size());
  PredictedChange out;
  for (std::size_t i = 0; i < blocks.size(); ++i) {
    out = larger(out, predict_change(frame.sensor, frame.exposure, frame.developing, blocks[i],
                                     plan.regions[plan.region_of_block[i]].kept));
  }
  return out;
}

}  // namespace lowlux::isp
