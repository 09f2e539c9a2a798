#include "isp/pipeline/budget/step_plan.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include <fmt/format.h>

#include "isp/pipeline/budget/step_candidates.h"
#include "isp/pipeline/plan/local_noise.h"
#include "isp/pipeline/plan/pixel_noise.h"
#include "isp/pipeline/plan/plan_demosaic.h"
#include "isp/pipeline/plan/plan_noise.h"
#include "isp/pipeline/plan/plan_regions.h"
#include "isp/pipeline/render/pixel_cells.h"

namespace lowlux::isp {
namespace {

using denoise::Level;

/// Returns whether the plan leaves out what the tolerance would call for: a budget alone calls for everything.
bool is_short_of_time(const StepFacts& facts, const StepCandidate& plan) {
  const auto& tolerance = facts.choice.tolerance_delta_e;
  return facts.choice.budget_s && !(tolerance && plan.left < *tolerance);
}

/// Returns why a step is left out, as text.
std::string reason_words(const StepFacts& facts, const StepCandidate& plan) {
  return is_short_of_time(facts, plan) ? "for lack of time" : "below the tolerance";
}

std::string level_words(const StepFacts& facts, const StepCandidate& plan) {
  if (!facts.has_noise) return "the noise is not known, or noise reduction is off";
  if (facts.noise_by_ratio) {
    return fmt::format("{}: its level follows from the signal-to-noise ratio, because the frame is not a mosaic",
                       plan.level ? name_of(*plan.level) : "none");
  }
  if (!plan.level) return "not reduced, " + reason_words(facts, plan);
  std::array<double, 3> share = facts.chroma.start;
  if (*plan.level == Level::best) share = {share[0] + share[1], 0, share[2]};  // best starts level 1 on level 0
  return fmt::format("{}; chroma from level 0, 1, 2 in {:.0f}, {:.0f}, {:.0f} % of the frame", name_of(*plan.level),
                     100 * share[0], 100 * share[1], 100 * share[2]);
}

/// Returns how many of the regions have which level, as text.
std::string region_words(const NoiseRegions& regions) {
  const auto have = [&](std::optional<Level> level) { return std::ranges::count(regions.level, level); };
  return fmt::format("; of {} regions {} none, {} draft, {} standard, {} high", regions.level.size(),
                     have(std::nullopt), have(Level::draft), have(Level::standard), have(Level::high));
}

std::optional<double> cost_of(const StepFacts& facts, std::initializer_list<CostTerm> parts) {
  if (!facts.choice.cost) return std::nullopt;
  return predicted_s(*facts.choice.cost, facts.size, parts);
}

double seconds_of(const StepFacts& facts, StepCandidate plan) {
  rate(facts, plan);
  return plan.seconds;
}

/// Returns the time of noise reduction by the plan's level, or by the highest that a tolerance selects where it has
/// none; without lines.
std::optional<double> cost_of_noise(const StepFacts& facts, StepCandidate plan) {
  if (!facts.choice.cost) return std::nullopt;
  plan.lines = false;
  if (!plan.level) plan.level = Level::high;
  StepCandidate without = plan;
  without.level.reset();
  return seconds_of(facts, plan) - seconds_of(facts, without);
}

std::optional<double> cost_of_lines(const StepFacts& facts, StepCandidate plan) {
  if (!facts.choice.cost) return std::nullopt;
  plan.lines = true;
  if (!plan.level) plan.level = Level::high;
  StepCandidate without = plan;
  without.lines = false;
  return seconds_of(facts, plan) - seconds_of(facts, without);
}

/// Describes demosaicing better than by linear filters, and the time it takes in addition.
PlannedStep demosaic_step(const StepFacts& facts, StepCandidate plan) {
  PlannedStep out{.name = "demosaicing by residuals", .size = std::numeric_limits<double>::quiet_NaN()};
  out.used = plan.max_demosaic >= DemosaicMethod::residual;
  out.decision =
      out.used ? "in areas with enough light" : "encoded linear filters instead, " + reason_words(facts, plan);
  if (facts.choice.cost) {
    plan.max_demosaic = DemosaicMethod::residual_median;
    StepCandidate without = plan;
    without.max_demosaic = DemosaicMethod::encoded_malvar;
    out.seconds = seconds_of(facts, plan) - seconds_of(facts, without);
  }
  return out;
}

std::string lines_text(const StepFacts& facts, const StepCandidate& plan) {
  if (plan.lines && plan.level) return facts.sizes.lines_text;
  const std::string measured = std::isfinite(facts.sizes.lines) ? facts.sizes.lines_text + "; " : std::string();
  return measured + (plan.level ? "" : "only subtracted with noise reduction, ") + reason_words(facts, plan);
}

StepPlan told(const StepFacts& facts, const StepCandidate& plan) {
  constexpr double nan = std::numeric_limits<double>::quiet_NaN();
  StepPlan out;
  const auto left = [](bool used, double size) { return used ? 0 : size; };
  const auto add = [&](PlannedStep effect) { out.effects.push_back(std::move(effect)); };
  if (facts.has_noise) {
    const double all = facts.noise.all, kept = facts.noise.left_by(plan.level);
    PlannedStep noise{
        "noise", all, plan.level ? kept : std::min(kept, all), plan.level.has_value(), level_words(facts, plan), {}};
    noise.seconds = cost_of_noise(facts, plan);
    add(std::move(noise));
  } else {
    add({"noise", nan, 0, false, level_words(facts, plan), {}});
  }
  if (facts.may_search) {
    add({"hot pixels", facts.sizes.defects, 0, true,
         fmt::format("{} repaired; the change is that of the strongest pixel", facts.defects),
         cost_of(facts, {{CostPart::defects}})});
  }
  if (facts.may_subtract_lines) {
    const bool taken = plan.lines && plan.level;
    add({"row and column noise", facts.sizes.lines, left(taken, facts.sizes.lines), taken, lines_text(facts, plan),
         cost_of_lines(facts, plan)});
  }
  if (facts.sizes.dark != 0) {
    const bool used = plan.dark || plan.level;
    add({"dark charge", facts.sizes.dark, left(used, facts.sizes.dark), used,
         used ? "subtracted" : "left in, " + reason_words(facts, plan), std::nullopt});
  }
  if (facts.display) {
    add({"change for the display", facts.sizes.display, left(plan.display, facts.sizes.display), plan.display,
         plan.display ? "made" : "left out", cost_of(facts, {{CostPart::display}})});
  }
  if (facts.demosaic_reduced && !facts.demosaic_is_fixed) {
    add(demosaic_step(facts, plan));
  }
  const bool by_tolerance = facts.choice.tolerance_delta_e && !facts.choice.all && !facts.choice.budget_s;
  if (by_tolerance && plan.level && !facts.level_is_fixed) {
    out.regions =
        plan_regions(facts.active, facts.blocks, *plan.level, fraction_for_level * *facts.choice.tolerance_delta_e);
  }
  if (out.regions) out.effects.front().decision += region_words(*out.regions);
  if (facts.choice.cost) out.predicted_s = plan.seconds;
  out.lines = plan.lines;
  out.dark = plan.dark || plan.level;
  out.display = plan.display;
  out.max_demosaic = plan.max_demosaic;
  out.level = plan.level;
  out.level_decided = facts.has_noise && !facts.noise_by_ratio;
  return out;
}

/// Sets what is known of the noise of a frame that is not a mosaic. A tolerance alone does not choose its level, which
/// follows from the signal-to-noise ratio: what levels leave was measured on mosaics.
void set_pixel_noise(const RawFrame& frame, const Thumbnail& thumbnail, const DevelopOptions& o,
                     const RawLevels& levels, const Rendering& rendering, StepFacts& facts, Executor& executor) {
  const std::optional<CellNoise> pixel = cell_noise(frame, levels, {1, 1, 1});
  if (!pixel) return;
  facts.blocks = visibility_blocks(frame, o, levels, rendering, pixel->noise, thumbnail, executor);
  facts.has_noise = !facts.blocks.empty();
  facts.chroma = chroma_work(frame, *cell_noise(frame, levels, parts_of(frame.raw)), thumbnail);
  if (facts.level_is_fixed || o.effects->all || o.effects->budget_s) return;
  std::vector<double> memory;
  facts.noise_by_ratio = facts.level_is_fixed = true;
  facts.fixed_level = level_by_ratio(o.denoise, middle_snr(frame, thumbnail, pixel->cell_e, pixel->noise, memory));
}

StepFacts facts_of(const RawFrame& frame, const Thumbnail& thumbnail, const Thumbnail& light, const DevelopOptions& o,
                   const RawLevels& levels, const Rendering& rendering, Executor& executor) {
  StepFacts facts{*o.effects, {}, {}};
  facts.size = cost_size(frame.raw);
  if (!is_mosaic(frame.raw)) {
    facts.pixel_planes = planes_of(frame.raw);
    facts.checked_fraction = checked_fraction(frame, levels);
  }
  facts.samples = o.samples;
  facts.active = frame.raw.active;
  if (frame.raw.layout == SensorLayout::bayer && !o.half) {
    std::vector<float> memory;
    DemosaicRequest request{.method = o.demosaic, .signal_e = median_green_e(frame, levels, light, memory)};
    NoiseReduction noise;
    facts.demosaic_noisy = plan_demosaic(frame, levels, rendering, noise, request).demosaic.method;
    noise.level = Level::draft;
    facts.demosaic_reduced = plan_demosaic(frame, levels, rendering, noise, request).demosaic.method;
    facts.demosaic_is_fixed = o.demosaic.has_value();
  }
  facts.look = rendering.look.has_value();
  facts.display = o.display != nullptr;
  facts.level_is_fixed = o.denoise.mode != DenoiseChoice::Mode::automatic;
  if (o.denoise.mode == DenoiseChoice::Mode::level) facts.fixed_level = o.denoise.level;
  std::optional<NoiseModel> model;
  const bool has_dark = levels.black.dark_mean_e != PerSite<double>{};
  const bool has_noise = o.denoise.mode != DenoiseChoice::Mode::off && !is_denoised_before(frame, o.denoise) &&
                         !noise_obstacle(frame, levels);
  if (!is_mosaic(frame.raw)) {
    if (has_noise) set_pixel_noise(frame, thumbnail, o, levels, rendering, facts, executor);
  } else if (has_noise || (has_dark && levels.electrons_at_white)) {
    model = noise_model(frame, levels, rendering.white_gain);
    facts.blocks = visibility_blocks(frame, o, levels, rendering, model->noise, thumbnail, executor);
    facts.has_noise = has_noise && !facts.blocks.empty();
  }
  const bool of_mosaic = facts.has_noise && model;
  if (of_mosaic) facts.chroma = chroma_work(frame, levels, model->noise, thumbnail);
  if (facts.has_noise) facts.noise = level_noise(facts.blocks);
  facts.may_search = o.find_defects && is_mosaic(frame.raw);
  facts.defects = levels.defects.size();
  facts.may_subtract_lines = of_mosaic && o.denoise.line_noise;
  const double tolerance = o.effects->tolerance_delta_e.value_or(0);
  const bool noise_may_stay =
      !facts.level_is_fixed && facts.noise.left_by(std::nullopt) < fraction_for_level * tolerance;
  const denoise::RawNoise median = of_mosaic ? median_noise(frame, model->noise) : denoise::RawNoise{};
  facts.sizes = step_sizes(frame, o, levels,
                           {.rendering = rendering,
                            .light = light,
                            .noise = of_mosaic ? &median : nullptr,
                            .blocks = facts.blocks,
                            .lines_may_remain = noise_may_stay && !o.effects->all},
                           executor);
  RawLevels without_dark = levels;
  without_dark.black.dark_mean_e = {};
  facts.from_codes = renders_from_codes(frame, without_dark, false);
  return facts;
}

}  // namespace

Result<StepPlan> choose_steps(const RawFrame& frame, const Thumbnail& thumbnail, const Thumbnail& light,
                              const DevelopOptions& options, const RawLevels& levels, const Rendering& rendering,
                              Executor& executor) {
  const StepFacts facts = facts_of(frame, thumbnail, light, options, levels, rendering, executor);
  const Result<StepCandidate> best = choose_step_candidate(facts);
  if (!best) return tl::make_unexpected(best.error());
  return told(facts, *best);
}

}  // namespace lowlux::isp
