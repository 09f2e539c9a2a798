#include "isp/pipeline/plan_effects.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include <fmt/format.h>

#include "isp/pipeline/effect_sizes.h"
#include "isp/pipeline/plan_noise.h"
#include "isp/pipeline/plan_regions.h"
#include "isp/pipeline/visible_noise.h"

namespace lowlux::isp {
namespace {

using denoise::Level;

/// Of the tolerance, for the level of noise reduction: what is predicted of it is a bound of what was seen on the
/// pictures it was tuned on, and others may exceed it by a little.
constexpr double share_for_level = 0.9;

/// One way to develop the frame.
struct Candidate {
  std::optional<Level> level;
  bool defects = true;
  bool lines = true;
  bool dark = true;
  bool display = true;
  double left = 0;   // against everything that can be done
  double error = 0;  // against the truth
  double seconds = 0;
};

/// Everything the decision rests on.
struct Facts {
  const EffectsChoice& choice;
  EffectSizes sizes;
  std::vector<SeenBlock> blocks;
  bool has_noise = false;  // it is known, and may be reduced
  std::optional<Level> fixed_level;
  bool level_is_fixed = false;
  bool may_search = true;
  bool may_take_lines = true;
  bool from_codes = false;  // without reduction, repair and dark nothing keeps the frame from it
  bool look = false;
  bool display = false;
  SampleType samples = SampleType::u8;
  Rect active;
  double megapixels = 0;
};

CostPart part_of(Level level, int start) {
  if (level == Level::best) return start == 2 ? CostPart::best_2 : CostPart::best_0;
  constexpr std::array first{CostPart::draft_0, CostPart::standard_0, CostPart::high_0};
  return static_cast<CostPart>(static_cast<int>(first[static_cast<std::size_t>(level)]) + start);
}

/// Shares of the frame whose chroma starts on each level, as denoise/chroma_start.h decides it.
std::array<double, 3> start_shares(const std::vector<SeenBlock>& blocks) {
  std::array<double, 3> share{};
  for (const SeenBlock& block : blocks) {
    share[block.snr >= 3 ? 0 : block.snr >= 0.7f ? 1 : 2] += 1.0 / static_cast<double>(blocks.size());
  }
  if (blocks.empty()) share[0] = 1;
  return share;
}

std::vector<CostShare> work_of(const Facts& facts, const Candidate& plan) {
  std::vector<CostShare> work{{CostPart::planning}};
  if (plan.defects && facts.may_search) work.push_back({CostPart::defects});
  if (plan.level) {
    if (plan.lines && facts.may_take_lines) work.push_back({CostPart::lines});
    work.push_back({CostPart::check});
    const std::array<double, 3> share = start_shares(facts.blocks);
    for (int start = 0; start < 3; ++start) {
      if (share[start] > 0) work.push_back({part_of(*plan.level, start), share[start]});
    }
  } else {
    const bool repairs = plan.defects && facts.sizes.has_defects;
    work.push_back({facts.from_codes && !repairs && !plan.dark ? CostPart::codes : CostPart::floats});
  }
  if (facts.samples == SampleType::u16) work.push_back({CostPart::codes_16});
  if (facts.samples == SampleType::f32) work.push_back({CostPart::floats_32});
  if (facts.look) work.push_back({CostPart::look});
  if (facts.display && plan.display) work.push_back({CostPart::display});
  return work;
}

template <class Share>
double seen_noise(const Facts& facts, const Share& share) {
  std::vector<float> rms;
  rms.reserve(facts.blocks.size());
  for (const SeenBlock& block : facts.blocks) {
    rms.push_back(static_cast<float>(share(static_cast<double>(block.snr))) * block.noise_delta_e);
  }
  return seen_percentile(rms);
}

void rate(const Facts& facts, Candidate& plan) {
  plan.left = facts.has_noise ? seen_noise(facts, [&](double snr) { return left_of_noise(plan.level, snr); }) : 0;
  double squares =
      facts.has_noise ? std::pow(seen_noise(facts, [&](double) { return error_share(plan.level); }), 2) : 0;
  const auto leave = [&](bool used, double size) {
    if (used || !(size > 0)) return;
    plan.left += size;
    squares += size * size;
  };
  leave(plan.defects, facts.sizes.defects);
  leave(plan.lines, facts.sizes.lines);
  leave(plan.dark || plan.level, facts.sizes.dark);
  leave(plan.display, facts.sizes.display);
  plan.error = std::sqrt(squares);
  if (facts.choice.cost) plan.seconds = predicted_s(*facts.choice.cost, facts.megapixels, work_of(facts, plan));
}

std::vector<std::optional<Level>> levels_of(const Facts& facts, bool with_best) {
  if (facts.level_is_fixed) return {facts.fixed_level};
  if (!facts.has_noise) return {std::nullopt};
  std::vector<std::optional<Level>> out{std::nullopt, Level::draft, Level::standard, Level::high};
  if (with_best) out.emplace_back(Level::best);
  return out;
}

/// The least work that stays below the tolerance: the level first, which saves most, then smallest first.
Candidate within_tolerance(const Facts& facts, double tolerance) {
  Candidate plan{.level = levels_of(facts, false).back()};
  for (const std::optional<Level> level : levels_of(facts, false)) {
    Candidate tried{.level = level};
    rate(facts, tried);
    if (tried.left >= share_for_level * tolerance) continue;
    plan = tried;
    break;
  }
  struct Option {
    bool Candidate::*used;
    double size;
  };
  std::array options{Option{&Candidate::defects, facts.sizes.defects}, Option{&Candidate::lines, facts.sizes.lines},
                     Option{&Candidate::dark, facts.sizes.dark}, Option{&Candidate::display, facts.sizes.display}};
  std::ranges::sort(options, {}, &Option::size);
  for (const Option& option : options) {
    if (std::isnan(option.size)) continue;  // not predicted: it is done
    Candidate tried = plan;
    tried.*option.used = false;
    rate(facts, tried);
    if (tried.left < tolerance) plan = tried;
  }
  rate(facts, plan);
  return plan;
}

/// All there are, the cheapest first.
std::vector<Candidate> candidates(const Facts& facts) {
  std::vector<Candidate> out;
  for (const std::optional<Level> level : levels_of(facts, true)) {
    for (const bool defects : {false, true}) {
      for (const bool lines : {false, true}) {
        for (const bool dark : {false, true}) {
          // A display that was asked for is left out by a tolerance only: no budget turns a wish down unsaid.
          Candidate plan{.level = level, .defects = defects, .lines = lines, .dark = dark};
          rate(facts, plan);
          out.push_back(plan);
        }
      }
    }
  }
  std::ranges::sort(out, {}, &Candidate::seconds);
  return out;
}

Result<Candidate> within_budget(const Facts& facts, double budget_s) {
  const std::vector<Candidate> all = candidates(facts);
  if (all.front().seconds > budget_s) {
    return fail(ErrorCode::insufficient,
                fmt::format("the budget of {:.3g} ms is below the cheapest plan, which is predicted to take {:.3g} ms "
                            "with {} {}: raise --budget-ms, or halve the picture (--half)",
                            1e3 * budget_s, 1e3 * all.front().seconds, facts.choice.cost->threads,
                            facts.choice.cost->threads == 1 ? "thread" : "threads"));
  }
  const double tolerance = facts.choice.tolerance_delta_e.value_or(0);
  const Candidate* best = nullptr;
  for (const Candidate& plan : all) {
    if (plan.seconds > budget_s) break;
    if (plan.left < tolerance) return plan;
    if (best == nullptr || plan.error < best->error) best = &plan;
  }
  return *best;
}

Result<Candidate> chosen(const Facts& facts) {
  if (facts.choice.all) {
    Candidate everything{.level = levels_of(facts, false).back()};
    rate(facts, everything);
    return everything;
  }
  if (facts.choice.budget_s) return within_budget(facts, *facts.choice.budget_s);
  return within_tolerance(facts, facts.choice.tolerance_delta_e.value_or(0));
}

std::string level_words(const Facts& facts, const Candidate& plan) {
  if (!facts.has_noise) return "the noise is not known, or not to be reduced";
  const std::array<double, 3> share = start_shares(facts.blocks);
  if (!plan.level) return "left as it is";
  return fmt::format("{}; chroma from level 0, 1, 2 in {:.0f}, {:.0f}, {:.0f} % of the frame", name_of(*plan.level),
                     100 * share[0], 100 * share[1], 100 * share[2]);
}

/// How many of the regions have which level.
std::string region_words(const NoiseRegions& regions) {
  const auto have = [&](std::optional<Level> level) { return std::ranges::count(regions.level, level); };
  return fmt::format("; of {} regions {} none, {} draft, {} standard, {} high", regions.level.size(),
                     have(std::nullopt), have(Level::draft), have(Level::standard), have(Level::high));
}

std::optional<double> cost_of(const Facts& facts, std::initializer_list<CostShare> parts) {
  if (!facts.choice.cost) return std::nullopt;
  return predicted_s(*facts.choice.cost, facts.megapixels, parts);
}

EffectsPlan told(const Facts& facts, const Candidate& plan) {
  constexpr double nan = std::numeric_limits<double>::quiet_NaN();
  EffectsPlan out;
  const auto left = [](bool used, double size) { return used || !(size > 0) ? 0 : size; };
  const auto add = [&](PlannedEffect effect) { out.effects.push_back(std::move(effect)); };
  if (facts.has_noise) {
    const double all = seen_noise(facts, [](double) { return 1.0; });
    const double kept = seen_noise(facts, [&](double snr) { return left_of_noise(plan.level, snr); });
    PlannedEffect noise{
        "noise", all, plan.level ? kept : std::min(kept, all), plan.level.has_value(), level_words(facts, plan), {}};
    if (facts.choice.cost) {
      Candidate without = plan;
      without.level.reset();
      rate(facts, without);
      noise.seconds = plan.seconds - without.seconds;
    }
    add(std::move(noise));
  } else {
    add({"noise", nan, 0, false, level_words(facts, plan), {}});
  }
  if (facts.may_search) {
    add({"hot pixels", facts.sizes.defects, left(plan.defects, facts.sizes.defects), plan.defects,
         facts.sizes.defects_words, plan.defects ? cost_of(facts, {{CostPart::defects}}) : std::nullopt});
  }
  if (facts.may_take_lines) {
    add({"row and column noise", facts.sizes.lines, left(plan.lines, facts.sizes.lines), plan.lines,
         facts.sizes.lines_words, plan.lines ? cost_of(facts, {{CostPart::lines}}) : std::nullopt});
  }
  if (facts.sizes.dark > 0) {
    const bool used = plan.dark || plan.level;
    add({"dark charge", facts.sizes.dark, left(used, facts.sizes.dark), used, used ? "subtracted" : "left in",
         std::nullopt});
  }
  if (facts.display) {
    add({"change for the display", facts.sizes.display, left(plan.display, facts.sizes.display), plan.display,
         plan.display ? "made" : "left out", plan.display ? cost_of(facts, {{CostPart::display}}) : std::nullopt});
  }
  const bool by_tolerance = facts.choice.tolerance_delta_e && !facts.choice.all && !facts.choice.budget_s;
  if (by_tolerance && plan.level && !facts.level_is_fixed) {
    out.regions =
        plan_regions(facts.active, facts.blocks, *plan.level, share_for_level * *facts.choice.tolerance_delta_e);
  }
  if (out.regions) out.effects.front().decision += region_words(*out.regions);
  if (facts.choice.cost) out.predicted_s = plan.seconds;
  out.find_defects = plan.defects;
  out.lines = plan.lines;
  out.dark = plan.dark || plan.level;
  out.display = plan.display;
  out.level = plan.level;
  out.level_decided = facts.has_noise;
  return out;
}

Facts facts_of(const RawFrame& frame, const Thumbnail& thumbnail, const DevelopPlan& plan, Executor& executor) {
  const DevelopOptions& o = plan.options;
  Facts facts{*o.effects, {}, {}};
  const Rect& crop = frame.raw.default_crop;
  facts.megapixels = 1e-6 * crop.width * crop.height;
  facts.samples = o.samples;
  facts.active = frame.raw.active;
  facts.look = plan.look.has_value();
  facts.display = o.display != nullptr;
  NoiseReduction reduction;
  facts.has_noise = o.denoise.mode != DenoiseChoice::Mode::off && !noise_obstacle(frame, plan);
  if (facts.has_noise) {
    set_noise_model(frame, plan, reduction);
    facts.blocks = seen_blocks(frame, plan, reduction.noise, thumbnail);
    facts.has_noise = !facts.blocks.empty();
  }
  facts.level_is_fixed = o.denoise.mode != DenoiseChoice::Mode::automatic;
  if (o.denoise.mode == DenoiseChoice::Mode::level) facts.fixed_level = o.denoise.level;
  facts.may_search = o.find_defects && frame.raw.layout == SensorLayout::bayer;
  facts.may_take_lines = facts.has_noise && o.denoise.line_noise;
  facts.sizes =
      effect_sizes(frame, plan, thumbnail, facts.has_noise ? &reduction.noise : nullptr, facts.blocks, executor);
  facts.from_codes = frame.raw.layout == SensorLayout::bayer && frame.corrections.defects.empty() &&
                     !plan.black.pattern && !o.dark_frame;
  return facts;
}

}  // namespace

double left_of_noise(std::optional<Level> level, double snr) {
  const double bright = std::clamp(snr / 10, 0.0, 1.0);
  if (!level) return 1.15;
  switch (*level) {
    case Level::draft:
      return 0.14 + 0.33 * bright;
    case Level::standard:
      return 0.095 + 0.2 * bright;
    case Level::high:
    case Level::best:
      break;
  }
  return 0;
}

double error_share(std::optional<Level> level) {
  constexpr std::array share{0.70, 0.67, 0.63, 0.54};
  return level ? share[static_cast<std::size_t>(*level)] : 0.85;
}

Result<void> decide_effects(const RawFrame& frame, const Thumbnail& thumbnail, DevelopPlan& plan, Executor& executor) {
  const Facts facts = facts_of(frame, thumbnail, plan, executor);
  const Result<Candidate> best = chosen(facts);
  if (!best) return tl::make_unexpected(best.error());
  plan.effects = told(facts, *best);
  if (!plan.effects->dark) plan.black.dark_mean_e = {};
  if (!plan.effects->display) plan.options.display.reset();
  return {};
}

}  // namespace lowlux::isp
