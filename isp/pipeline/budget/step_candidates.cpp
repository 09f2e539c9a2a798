#include "isp/pipeline/budget/step_candidates.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include <fmt/format.h>

#include "isp/pipeline/budget/visible_noise.h"

namespace lowlux::isp {
namespace {

using denoise::Level;

/// States the fraction of the time for row and column noise that counts where it is not known whether there is any.
constexpr double fraction_of_unknown = 0.5;

/// States the CIEDE2000 that an unpredicted effect counts for where plans are compared: so that it is done where there
/// is time.
constexpr double size_of_unknown = 0.3;

CostPart part_of(Level level, int start) {
  if (level == Level::best) return start == 2 ? CostPart::best_2 : CostPart::best_0;
  constexpr std::array first{CostPart::draft_0, CostPart::standard_0, CostPart::high_0};
  return static_cast<CostPart>(static_cast<int>(first[static_cast<std::size_t>(level)]) + start);
}

/// States the CIEDE2000 that linear filters on encoded values change where there is time for better ones: the median
/// over fifteen pictures of the 95th percentile over means of 8 x 8 pixels. It depends on detail, which is not
/// measured.
constexpr double size_of_demosaic = 2.3;

std::optional<DemosaicMethod> demosaic_of(const StepFacts& facts, const StepCandidate& plan) {
  const auto method = plan.level ? facts.demosaic_reduced : facts.demosaic_noisy;
  if (!method || facts.demosaic_is_fixed) return method;
  return std::min(*method, plan.max_demosaic);
}

CostPart part_of(DemosaicMethod method) {
  constexpr int first = static_cast<int>(CostPart::encoded_malvar) - static_cast<int>(DemosaicMethod::encoded_malvar);
  return static_cast<CostPart>(first + static_cast<int>(method));
}

/// Adds rendering with noise reduction.
void add_level(const StepFacts& facts, Level level, std::vector<CostTerm>& work) {
  for (int start = 0; start < 3; ++start) {
    const double share = facts.chroma.work[static_cast<std::size_t>(start)];
    if (share > 0) work.push_back({part_of(level, start), share});
  }
}

void add_output(const StepFacts& facts, const StepCandidate& plan, std::vector<CostTerm>& work) {
  if (facts.samples == SampleType::u16) work.push_back({CostPart::codes_16});
  if (facts.samples == SampleType::f32) work.push_back({CostPart::floats_32});
  if (facts.look) work.push_back({CostPart::look});
  if (facts.display && plan.display) work.push_back({CostPart::display});
}

/// States the time of work on a frame that is not a mosaic over that of planning or, for all else, of rendering a
/// mosaic of as many pixels from floats, as `measure pixel-cost` prints them.
struct PixelRatios {
  double planning;
  double floats;  // rendering without noise reduction
  double check;   // time of checking the noise, in addition to that of a mosaic
  double cells;   // making cells, and pixels of them again
};
PixelRatios pixel_ratios(int planes) {
  return planes == 3 ? PixelRatios{1.7, 4.7, 10, 2.5} : PixelRatios{0.92, 0.85, 6.5, 1.5};
}

/// Returns the work on a frame that is not a mosaic: its cells are denoised as a mosaic of four times as many sites,
/// but not rendered as one.
std::vector<CostTerm> work_of_pixels(const StepFacts& facts, const StepCandidate& plan) {
  constexpr double sites = 4;
  const PixelRatios ratio = pixel_ratios(facts.pixel_planes);
  std::vector<CostTerm> work{{CostPart::planning, ratio.planning}, {CostPart::floats, ratio.floats}};
  if (plan.level) {
    work.push_back({CostPart::check});
    work.push_back({CostPart::floats, ratio.check * facts.checked_fraction + ratio.cells - sites});
    add_level(facts, *plan.level, work);
  }
  add_output(facts, plan, work);
  return work;
}

std::vector<CostTerm> work_of(const StepFacts& facts, const StepCandidate& plan) {
  if (facts.pixel_planes > 0) return work_of_pixels(facts, plan);
  std::vector<CostTerm> work{{CostPart::planning}};
  if (facts.sizes.measured_fraction > 0) work.push_back({CostPart::samples, facts.sizes.measured_fraction});
  if (facts.may_search) work.push_back({CostPart::defects});
  if (plan.level) {
    if (plan.lines && facts.may_subtract_lines) {
      work.push_back({CostPart::lines});
      const double size = facts.sizes.lines;
      if (size != 0) work.push_back({CostPart::offsets, std::isnan(size) ? fraction_of_unknown : 1});
    }
    work.push_back({CostPart::check});
    add_level(facts, *plan.level, work);
  } else {
    const bool takes_dark = plan.dark && facts.sizes.dark != 0;
    work.push_back({facts.from_codes && !takes_dark ? CostPart::codes : CostPart::floats});
  }
  const auto demosaic = demosaic_of(facts, plan);
  if (demosaic && *demosaic != DemosaicMethod::malvar) work.push_back({part_of(*demosaic)});
  add_output(facts, plan, work);
  return work;
}

std::vector<std::optional<Level>> levels_of(const StepFacts& facts, bool with_best) {
  if (facts.level_is_fixed) return {facts.fixed_level};
  if (!facts.has_noise) return {std::nullopt};
  std::vector<std::optional<Level>> out{std::nullopt, Level::draft, Level::standard, Level::high};
  if (with_best) out.emplace_back(Level::best);
  return out;
}

/// Returns the plan with the least work that stays below the tolerance: the level first, which saves most, then the
/// other effects, smallest first.
StepCandidate within_tolerance(const StepFacts& facts, double tolerance) {
  StepCandidate plan{.level = levels_of(facts, false).back()};
  for (const std::optional<Level> level : levels_of(facts, false)) {
    StepCandidate tried{.level = level};
    rate(facts, tried);
    if (tried.left >= fraction_for_level * tolerance) continue;
    plan = tried;
    break;
  }
  struct Option {
    bool StepCandidate::*used;
    double size;
  };
  std::array options{Option{&StepCandidate::lines, facts.sizes.lines}, Option{&StepCandidate::dark, facts.sizes.dark},
                     Option{&StepCandidate::display, facts.sizes.display}};
  std::ranges::sort(options, {}, &Option::size);
  for (const Option& option : options) {
    if (std::isnan(option.size)) continue;  // not predicted: the effect is used
    StepCandidate tried = plan;
    tried.*option.used = false;
    rate(facts, tried);
    if (tried.left < tolerance) plan = tried;
  }
  rate(facts, plan);
  return plan;
}

/// Returns all candidates, the cheapest first.
std::vector<StepCandidate> candidates(const StepFacts& facts) {
  std::vector<StepCandidate> out;
  for (const std::optional<Level> level : levels_of(facts, true)) {
    for (const bool lines : {false, true}) {
      for (const bool dark : {false, true}) {
        for (const DemosaicMethod method : {DemosaicMethod::encoded_malvar, DemosaicMethod::residual_median}) {
          // A requested change for a display is omitted only within a tolerance: a budget never silently drops an
          // explicit request. Nor does it drop the search for hot pixels, which no sample can replace.
          StepCandidate plan{.level = level, .lines = lines, .dark = dark, .max_demosaic = method};
          rate(facts, plan);
          out.push_back(plan);
        }
      }
    }
  }
  std::ranges::sort(out, {}, &StepCandidate::seconds);
  return out;
}

Result<StepCandidate> within_budget(const StepFacts& facts, double budget_s) {
  const std::vector<StepCandidate> all = candidates(facts);
  if (all.front().seconds > budget_s) {
    return fail(ErrorCode::insufficient,
                fmt::format("the budget of {:.3g} ms is below the cheapest plan, which is predicted to take {:.3g} ms "
                            "with {} {}: raise --budget-ms",
                            1e3 * budget_s, 1e3 * all.front().seconds, facts.choice.cost->threads,
                            facts.choice.cost->threads == 1 ? "thread" : "threads"));
  }
  const double tolerance = facts.choice.tolerance_delta_e.value_or(0);
  const StepCandidate* best = nullptr;
  for (const StepCandidate& plan : all) {
    if (plan.seconds > budget_s) break;
    if (plan.left < tolerance) return plan;
    if (best == nullptr || plan.error < best->error) best = &plan;
  }
  return *best;
}

}  // namespace

LevelNoise level_noise(const std::vector<VisibilityBlock>& blocks) {
  std::vector<float> rms(blocks.size());
  const auto percentile = [&](const auto& delta_e) {
    std::ranges::transform(blocks, rms.begin(), delta_e);
    return visible_percentile(rms);
  };
  const auto left_by = [&](std::optional<Level> level) {
    return percentile([level](const VisibilityBlock& block) { return residual_delta_e(level, block); });
  };
  LevelNoise out;
  out.all = percentile([](const VisibilityBlock& block) { return block.noise_delta_e; });
  out.without_level = left_by(std::nullopt);
  for (const Level level : {Level::draft, Level::standard}) out.left[static_cast<std::size_t>(level)] = left_by(level);
  return out;
}

void rate(const StepFacts& facts, StepCandidate& plan) {
  plan.left = facts.noise.left_by(plan.level);
  double squares = std::pow(error_fraction(plan.level) * facts.noise.all, 2);
  const auto leave = [&](bool used, double size) {
    if (used || size == 0) return;
    plan.left += std::isnan(size) ? std::numeric_limits<double>::infinity() : size;
    squares += std::pow(std::isnan(size) ? size_of_unknown : size, 2);
  };
  if (facts.may_subtract_lines)
    leave(plan.lines && plan.level, facts.sizes.lines);  // subtracted with the noise, or kept
  leave(plan.dark || plan.level, facts.sizes.dark);
  leave(plan.display, facts.sizes.display);
  const auto demosaic = demosaic_of(facts, plan);
  leave(demosaic != DemosaicMethod::encoded_malvar || facts.demosaic_is_fixed, size_of_demosaic);
  plan.error = std::sqrt(squares);
  if (facts.choice.cost) plan.seconds = predicted_s(*facts.choice.cost, facts.size, work_of(facts, plan));
}

Result<StepCandidate> choose_step_candidate(const StepFacts& facts) {
  if (facts.choice.all) {
    StepCandidate everything{.level = levels_of(facts, false).back()};
    rate(facts, everything);
    return everything;
  }
  if (facts.choice.budget_s) return within_budget(facts, *facts.choice.budget_s);
  return within_tolerance(facts, facts.choice.tolerance_delta_e.value_or(0));
}

}  // namespace lowlux::isp
