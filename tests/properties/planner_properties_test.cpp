#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <cmath>
#include <cstddef>
#include <limits>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "isp/adapter/stage_budget.h"
#include "isp/pipeline/budget/cost_model.h"
#include "isp/pipeline/budget/step_candidates.h"
#include "isp/pipeline/budget/step_plan.h"
#include "isp/pipeline/plan/plan_develop.h"
#include "tests/pipeline/night_frames.h"
#include "tests/properties/draws.h"
#include "tests/support/reference_cost.h"

namespace lowlux::isp {
namespace {

using namespace properties;
using denoise::Level;

/// Times that rise with the size, of parts that cost what they like; but a better level costs no less, nor do floats.
std::shared_ptr<const CostModel> any_cost() {
  CostModel out;
  out.pace = any_decade(-1, 1);
  const int sizes = size_between(1, 4);
  for (std::size_t part = 0; part < out.points.size(); ++part) {
    const auto at = static_cast<CostPart>(part);
    const bool goes_on = (at > CostPart::draft_0 && at <= CostPart::best_2) || at == CostPart::floats;
    // Of the same start chroma has on the level before; the parts lie three apart, best without a start of 1.
    const std::size_t cheaper = at == CostPart::floats ? part - 1 : at == CostPart::best_2 ? part - 2 : part - 3;
    CostPoint point{0, 0};
    for (int i = 0; i < sizes; ++i) {
      point.megapixels += 0.5 + i;
      point.seconds += any_decade(-4, -1);
      out.points[part].push_back(point);
    }
    if (!goes_on || at == CostPart::draft_1 || at == CostPart::draft_2) continue;
    for (std::size_t i = 0; i < out.points[part].size(); ++i) {
      out.points[part][i].seconds += out.points[cheaper][i].seconds;
    }
  }
  return std::make_shared<const CostModel>(std::move(out));
}

RC_GTEST_PROP(CostModelProperty, LargerFramesAndMoreWorkTakeNoLess, ()) {
  const auto cost = any_cost();
  const CostSize small{any_decade(-2, 2), any_decade(-2, 2)};
  const double more = any_between(1, 10);
  const CostSize large{more * small.megapixels, more * small.denoised_megapixels};
  for (int i = 0; i < cost_parts; ++i) {
    const auto part = static_cast<CostPart>(i);
    const double seconds = cost->seconds(part, small);
    RC_ASSERT(seconds > 0 && std::isfinite(seconds));
    RC_ASSERT(cost->seconds(part, large) >= seconds * (1 - 1e-14));
  }
  const std::vector<CostTerm> work{{CostPart::planning}, {CostPart::lines, any_between(0, 1)}};
  const std::vector<CostTerm> more_work{work[0], work[1], {CostPart::look, any_between(0, 1)}};
  RC_ASSERT(predicted_s(*cost, small, more_work) >= predicted_s(*cost, small, work));
}

RC_GTEST_PROP(CostModelProperty, ASizeCountsAllItsPixelsAndWhatIsAppended, ()) {
  const int width = size_between(1, 9000), height = size_between(1, 9000);
  const CostSize size = cost_size(width, height);
  RC_ASSERT(std::abs(size.megapixels - 1e-6 * width * height) <= 1e-15 * width * height);
  RC_ASSERT(size.denoised_megapixels >= size.megapixels * (1 - 1e-15));
}

/// What a frame calls for: sizes known or not, levels that leave the less the more they work.
StepFacts any_facts(const ProcessingGoal& choice) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const auto size = [&] { return *rc::gen::element(0.0, nan, any_decade(-2, 1), any_decade(-2, 1)); };
  StepFacts out{.choice = choice, .sizes = {}, .blocks = {}};
  out.has_noise = *rc::gen::arbitrary<bool>();
  if (out.has_noise) {
    const double draft = any_decade(-2, 1), standard = draft * any_between(0, 1);
    out.noise = {
        .all = draft + any_decade(-2, 1), .left = {draft, standard}, .without_level = draft + any_between(0, 9)};
    const double fine = any_between(0, 1);
    out.chroma.work = {fine, 1 - fine, any_between(0, 1)};
  }
  out.sizes = {.measured_fraction = any_between(0, 1), .defects = size(), .lines = size(), .display = size()};
  out.sizes.dark = *rc::gen::element(0.0, any_decade(-2, 1));
  out.may_search = *rc::gen::arbitrary<bool>();
  out.may_subtract_lines = out.has_noise && *rc::gen::arbitrary<bool>();
  out.from_codes = *rc::gen::arbitrary<bool>();
  if (*rc::gen::arbitrary<bool>()) {
    out.demosaic_reduced = *rc::gen::element(DemosaicMethod::residual, DemosaicMethod::residual_median);
    out.demosaic_noisy = *rc::gen::element(DemosaicMethod::malvar, *out.demosaic_reduced);
    out.demosaic_is_fixed = *rc::gen::arbitrary<bool>();
  }
  out.look = *rc::gen::arbitrary<bool>();
  out.display = *rc::gen::arbitrary<bool>();
  out.size = {any_decade(-2, 2), any_decade(-2, 2)};
  return out;
}

RC_GTEST_PROP(PlannerProperty, WithoutABudgetWhatIsLeftOutStaysBelowTheTolerance, ()) {
  ProcessingGoal choice{.tolerance_delta_e = any_decade(-3, 1)};
  if (*rc::gen::arbitrary<bool>()) choice.cost = any_cost();
  const StepFacts facts = any_facts(choice);
  const auto plan = choose_step_candidate(facts);
  RC_ASSERT(plan.has_value());
  // The noise of a frame that no level may take stays whatever is chosen; so do lines that go with it.
  RC_ASSERT(plan->left < *choice.tolerance_delta_e);
}

/// All there are with a budget: a display is never left out for time.
std::vector<StepCandidate> all_plans(const StepFacts& facts) {
  std::vector<std::optional<Level>> levels{std::nullopt};
  if (facts.has_noise) levels = {std::nullopt, Level::draft, Level::standard, Level::high, Level::best};
  std::vector<StepCandidate> out;
  for (const auto level : levels) {
    for (int bits = 0; bits < 4; ++bits) {
      for (const DemosaicMethod method : {DemosaicMethod::encoded_malvar, DemosaicMethod::residual_median}) {
        StepCandidate plan{.level = level, .lines = (bits & 1) != 0, .dark = (bits & 2) != 0, .max_demosaic = method};
        rate(facts, plan);
        out.push_back(plan);
      }
    }
  }
  return out;
}

RC_GTEST_PROP(PlannerProperty, NoPlanThatFitsTheBudgetIsMoreAccurate, ()) {
  const ProcessingGoal choice{.tolerance_delta_e = std::nullopt, .budget_s = any_decade(-4, 1), .cost = any_cost()};
  const StepFacts facts = any_facts(choice);
  const auto chosen = choose_step_candidate(facts);
  RC_ASSERT(!chosen || chosen->seconds <= *choice.budget_s);
  for (const StepCandidate& plan : all_plans(facts)) {
    if (plan.seconds > *choice.budget_s) continue;
    RC_ASSERT(chosen.has_value());
    RC_ASSERT(chosen->error <= plan.error);
  }
}

RC_GTEST_PROP(PlannerProperty, WithABudgetNoPlanWithinTheToleranceIsCheaper, ()) {
  const ProcessingGoal choice{
      .tolerance_delta_e = any_decade(-2, 1), .budget_s = any_decade(-2, 1), .cost = any_cost()};
  const StepFacts facts = any_facts(choice);
  const auto chosen = choose_step_candidate(facts);
  for (const StepCandidate& plan : all_plans(facts)) {
    if (plan.seconds > *choice.budget_s || plan.left >= *choice.tolerance_delta_e) continue;
    RC_ASSERT(chosen.has_value() && chosen->left < *choice.tolerance_delta_e);
    RC_ASSERT(chosen->seconds <= plan.seconds);
  }
}

RC_GTEST_PROP(PlannerProperty, MoreWorkLeavesNoMoreAndTakesNoLess, ()) {
  const ProcessingGoal choice{.cost = any_cost()};
  const StepFacts facts = any_facts(choice);
  StepCandidate less{.level = *rc::gen::element<std::optional<Level>>(std::nullopt, Level::draft, Level::standard)};
  if (!facts.has_noise) less.level.reset();
  less.lines = less.dark = less.display = false;
  auto more = less;
  const auto part = *rc::gen::element(&StepCandidate::lines, &StepCandidate::dark, &StepCandidate::display);
  more.*part = true;
  if (facts.has_noise && *rc::gen::arbitrary<bool>()) more.level = less.level ? Level::high : Level::draft;
  rate(facts, less);
  rate(facts, more);
  RC_ASSERT(more.left <= less.left);
  RC_ASSERT(more.error <= less.error);
  // A level takes another path than codes do, which may be cheaper in a model of any times.
  if (less.level == more.level || less.level) RC_ASSERT(more.seconds >= less.seconds * (1 - 1e-14));
}

RC_GTEST_PROP(PlannerProperty, FramesArePlannedWithinTheirBudgetOrRefused, ()) {
  const double green_e = any_decade(0, 3.5);
  const denoise_testing::Camera camera{.phase = any_phase(), .read_noise_e = any_between(0.5, 6)};
  const RawFrame frame = test::night_frame(camera, denoise_testing::waves(green_e), size_between(64, 160),
                                           size_between(64, 128), *rc::gen::arbitrary<std::uint32_t>());
  DevelopOptions options;
  options.denoise.mode = DenoiseChoice::Mode::automatic;
  options.effects.emplace();
  options.effects->tolerance_delta_e.reset();
  options.effects->cost = test::reference_cost();
  options.effects->budget_s = any_decade(-4, -1.5);
  InlineExecutor one;
  const auto plan = plan_develop(frame, options, one);
  if (!plan) {
    RC_ASSERT(plan.error().code == ErrorCode::insufficient);
    options.effects->budget_s = *options.effects->budget_s / 2;
    RC_ASSERT(!plan_develop(frame, options, one).has_value());
    return;
  }
  RC_ASSERT(plan->effects->predicted_s.value() <= *options.effects->budget_s);
  options.effects->budget_s = *options.effects->budget_s * 2;
  RC_ASSERT(plan_develop(frame, options, one).has_value());
}

// Of the same frames before, whatever they took.
RC_GTEST_PROP(StageBudgetProperty, ALargerBudgetNeverGivesLessWork, ()) {
  const bool temporal = *rc::gen::arbitrary<bool>();
  StageBudget budget(*rc::gen::arbitrary<bool>(), temporal);
  const auto any_work = [&] {
    const auto work = static_cast<StageWork>(size_between(0, 4));
    return work == StageWork::frames_before && !temporal ? StageWork::plain : work;
  };
  for (int frames = size_between(0, 40); frames > 0; --frames) {
    const StageWork asked = any_work();
    budget.took(budget.choose(any_decade(-1, 3), asked), any_decade(-1, 3));
  }
  const StageWork asked = any_work();
  StageWork before = StageWork::plain;
  for (double ms = 0.01; ms < 1e5; ms *= 1.3) {
    StageBudget same = budget;
    const StageWork chosen = same.choose(ms, asked);
    RC_ASSERT(chosen >= asked && chosen <= before);  // the dearest comes first
    before = chosen;
  }
}

}  // namespace
}  // namespace lowlux::isp
