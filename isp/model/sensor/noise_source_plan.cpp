#include "isp/model/sensor/noise_source_plan.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <map>
#include <numeric>
#include <utility>

namespace lowlux::isp {
namespace {

constexpr std::array<std::string_view, effect_count> names{
    "photon-noise", "dark-current", "read-noise",   "quantisation",    "clipping",       "prnu",      "dsnu",
    "hot-pixels",   "row-noise",    "column-noise", "telegraph-noise", "amplifier-glow", "crosstalk", "lens-blur"};

/// Limits the fraction of the tolerance that predictions may use up. They assume normal distributions, which do not
/// hold near saturation and at a few electrons.
constexpr double usable_fraction = 0.5;

constexpr int max_samples = 24;  // evaluated blocks of one region: its extremes and others evenly between them

/// Returns whether the sensor and exposure have the effect at all.
bool present(const SensorModel& s, const Exposure& exposure, Effect effect) {
  const auto dark = dark_mean_e(s, exposure);
  const bool has_dark = dark[0] + dark[1] + dark[2] > 0;
  switch (effect) {
    case Effect::dark_current:
      return has_dark;
    case Effect::read_noise:
      return s.read_noise_e > 0;
    case Effect::prnu:
      return s.prnu > 0;
    case Effect::dsnu:
      return s.dsnu > 0 && has_dark;
    case Effect::hot_pixels:
      return s.hot_pixel_fraction > 0 && s.hot_pixel_current_e_per_s > 0 && exposure.time_s > 0;
    case Effect::telegraph_noise:
      return telegraph_variance_e2(s) > 0;
    case Effect::crosstalk:
      return s.crosstalk > 0 && exposure.time_s > 0;
    case Effect::amplifier_glow:
      return s.glow_e_per_s > 0 && exposure.time_s > 0;
    case Effect::row_noise:
      return s.row_noise_e > 0;
    case Effect::column_noise:
      return s.column_noise_e > 0;
    case Effect::photon_noise:
    case Effect::quantisation:
    case Effect::clipping:
    case Effect::lens_blur:  // of the light, not of the sensor
      break;
  }
  return true;
}

double level_of(const BlockLevel& block) { return *std::max_element(block.signal_e.begin(), block.signal_e.end()); }

/// Returns the decade of a level; levels below the least one share its decade, and so do those above 1e9.
int decade_of(double level_e, double min_e) {
  return static_cast<int>(std::floor(std::log10(std::clamp(level_e, min_e, 1e9))));
}

/// Adds the members whose glow and whose moved light, relative to their noise, are extreme.
template <class AddMost>
void add_uneven_samples(const AddMost& add_most) {
  add_most([](const BlockLevel& b) { return b.glow.mean_e; });
  add_most([](const BlockLevel& b) { return -b.glow.mean_e; });
  for (const auto moved : {&BlockLevel::by_lens_blur, &BlockLevel::by_crosstalk, &BlockLevel::by_both}) {
    for (int c = 0; c < 3; ++c) {
      add_most([=](const BlockLevel& b) { return std::fabs((b.*moved).mean_e[c]) / (1 + b.signal_e[c]); });
      add_most([=](const BlockLevel& b) { return (b.*moved).moved_e[c] / (1 + b.signal_e[c]); });
      add_most([=](const BlockLevel& b) {
        return std::fabs((b.*moved).more_contrast_e2[c]) / (1 + b.signal_e[c] + b.contrast.variance_e2[c]);
      });
    }
  }
}

/// Returns the blocks a region is evaluated by: its extremes by level and others evenly between them, the extremes of
/// each channel, of the glow and of moved light.
std::vector<BlockLevel> samples_of(std::span<const BlockLevel> blocks, std::vector<std::size_t> members) {
  std::vector<std::size_t> chosen;
  const auto by = [&](auto key) {
    return [&blocks, key](std::size_t a, std::size_t b) { return key(blocks[a]) < key(blocks[b]); };
  };
  const auto add_most = [&](auto key) {
    const std::size_t most = *std::max_element(members.begin(), members.end(), by(key));
    if (key(blocks[most]) != 0) chosen.push_back(most);  // 0: the sensor does not have the effect
  };
  chosen.push_back(*std::max_element(members.begin(), members.end(), by([](const BlockLevel& b) { return b.peak_e; })));
  for (int c = 0; c < 3; ++c) {
    chosen.push_back(
        *std::min_element(members.begin(), members.end(), by([c](const BlockLevel& b) { return b.darkest_e[c]; })));
    const auto [low, high] =
        std::minmax_element(members.begin(), members.end(), by([c](const BlockLevel& b) { return b.signal_e[c]; }));
    chosen.push_back(*low);
    chosen.push_back(*high);
  }
  add_uneven_samples(add_most);
  std::sort(members.begin(), members.end(), by(level_of));
  const std::size_t count = std::min<std::size_t>(members.size(), max_samples);
  for (std::size_t i = 0; i < count; ++i) {
    chosen.push_back(members[count == 1 ? 0 : i * (members.size() - 1) / (count - 1)]);
  }
  std::sort(chosen.begin(), chosen.end());
  chosen.erase(std::unique(chosen.begin(), chosen.end()), chosen.end());
  std::vector<BlockLevel> samples;
  samples.reserve(chosen.size());
  for (const std::size_t i : chosen) samples.push_back(blocks[i]);
  return samples;
}

/// Predicts the change for the blocks of one region.
class Region {
 public:
  Region(const SensorModel& sensor, const Exposure& exposure, const Developing& developing,
         std::vector<BlockLevel> samples)
      : sensor_(sensor), exposure_(exposure), developing_(developing), samples_(std::move(samples)) {}

  PredictedChange change(NoiseSourceSet kept) const {
    PredictedChange worst;
    for (const BlockLevel& block : samples_) {
      const PredictedChange one = predict_change(sensor_, exposure_, developing_, block, kept);
      worst.delta_e = std::max(worst.delta_e, one.delta_e);
      worst.relative_variance = std::max(worst.relative_variance, one.relative_variance);
    }
    return worst;
  }
  bool has(Effect effect) const {
    if (effect != Effect::lens_blur) return present(sensor_, exposure_, effect);
    return std::ranges::any_of(samples_, [](const BlockLevel& b) { return b.by_lens_blur.moves(); });
  }

 private:
  const SensorModel& sensor_;
  const Exposure& exposure_;
  const Developing& developing_;
  std::vector<BlockLevel> samples_;
};

/// Decides on each effect by itself.
std::array<NoiseSourceDecision, effect_count> decisions_alone(const Region& region) {
  std::array<NoiseSourceDecision, effect_count> out{};
  for (int i = 0; i < effect_count; ++i) {
    NoiseSourceDecision& d = out[i];
    d.effect = static_cast<Effect>(i);
    if (region.has(d.effect)) {
      d.alone = region.change(NoiseSourceSet::all().without(d.effect));
    } else {
      d.kept = false;
      d.reason = NoiseSourceDecision::Reason::absent;
    }
  }
  return out;
}

double size_of(const PredictedChange& change, const Tolerance& tolerance) {
  return std::max(change.delta_e / tolerance.delta_e, change.relative_variance / tolerance.relative_variance);
}

void drop_negligible(const Region& region, const Tolerance& tolerance, RegionPlan& plan) {
  std::array<int, effect_count> order{};
  std::iota(order.rbegin(), order.rend(),
            0);  // among equals DSNU is dropped before dark current, which needs it dropped
  const auto size = [&](int i) { return size_of(plan.decisions[i].alone, tolerance); };
  std::stable_sort(order.begin(), order.end(), [&](int a, int b) { return size(a) < size(b); });
  for (const int i : order) {
    NoiseSourceDecision& d = plan.decisions[i];
    if (!d.kept || size(i) >= usable_fraction) continue;
    if (d.effect == Effect::dark_current && plan.kept.has(Effect::dsnu)) continue;  // DSNU multiplies dark current
    const PredictedChange together = region.change(plan.kept.without(d.effect));
    if (size_of(together, tolerance) >= usable_fraction) continue;
    plan.kept = plan.kept.without(d.effect);
    plan.left_out_together = together;
    d.kept = false;
    d.reason = NoiseSourceDecision::Reason::negligible;
  }
}

/// Groups the blocks into regions by the decades of their level and glow: at most 13 x 16. In the dark, where white is
/// that of the noise, a hundredth of an electron of glow can be visible.
std::vector<std::vector<std::size_t>> group(std::span<const BlockLevel> blocks) {
  std::map<std::pair<int, int>, std::vector<std::size_t>> decades;
  for (std::size_t i = 0; i < blocks.size(); ++i) {
    decades[{decade_of(level_of(blocks[i]), 1e-3), decade_of(blocks[i].glow.mean_e, 1e-6)}].push_back(i);
  }
  std::vector<std::vector<std::size_t>> regions;
  regions.reserve(decades.size());
  for (auto& decade : decades) regions.push_back(std::move(decade.second));
  return regions;
}

template <class Decide>
NoiseSourcePlan plan_regions(const SensorModel& sensor, const Exposure& exposure, const Developing& developing,
                             std::span<const BlockLevel> blocks, const Decide& decide) {
  NoiseSourcePlan plan;
  plan.region_of_block.resize(blocks.size());
  for (const std::vector<std::size_t>& members : group(blocks)) {
    const Region region(sensor, exposure, developing, samples_of(blocks, members));
    RegionPlan r;
    r.blocks = static_cast<int>(members.size());
    r.darkest_e = std::numeric_limits<double>::infinity();
    for (const std::size_t i : members) {
      plan.region_of_block[i] = static_cast<std::uint8_t>(plan.regions.size());
      r.darkest_e = std::min(r.darkest_e, level_of(blocks[i]));
      r.brightest_e = std::max(r.brightest_e, level_of(blocks[i]));
      r.glow_e = std::max(r.glow_e, blocks[i].glow.mean_e);
    }
    r.decisions = decisions_alone(region);
    for (const NoiseSourceDecision& d : r.decisions) {
      if (!d.kept) r.kept = r.kept.without(d.effect);
    }
    decide(region, r);
    plan.regions.push_back(r);
  }
  return plan;
}

}  // namespace

std::span<const std::string_view> effect_names() { return names; }

MovedLight BlockLevel::left_out(NoiseSourceSet kept) const {
  const bool lens = !kept.has(Effect::lens_blur), neighbours = !kept.has(Effect::crosstalk);
  if (lens) return neighbours ? by_both : by_lens_blur;
  return neighbours ? by_crosstalk : MovedLight{};
}

NoiseSourcePlan plan_noise_sources(const SensorModel& sensor, const Exposure& exposure, const Developing& developing,
                                   std::span<const BlockLevel> blocks, const Tolerance& tolerance) {
  NoiseSourcePlan plan = plan_regions(sensor, exposure, developing, blocks, [&](const Region& region, RegionPlan& r) {
    drop_negligible(region, tolerance, r);
  });
  plan.tolerance = tolerance;
  return plan;
}

NoiseSourcePlan fixed_effects(const SensorModel& sensor, const Exposure& exposure, const Developing& developing,
                              std::span<const BlockLevel> blocks, NoiseSourceSet wanted) {
  return plan_regions(sensor, exposure, developing, blocks, [&](const Region& region, RegionPlan& r) {
    for (NoiseSourceDecision& d : r.decisions) {
      if (d.reason == NoiseSourceDecision::Reason::absent) continue;
      d.kept = wanted.has(d.effect) && (d.effect != Effect::dsnu || wanted.has(Effect::dark_current));
      d.reason = NoiseSourceDecision::Reason::asked_for;
      if (!d.kept) r.kept = r.kept.without(d.effect);
    }
    r.left_out_together = region.change(r.kept);
  });
}

}  // namespace lowlux::isp
