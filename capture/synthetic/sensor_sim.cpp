#include "capture/synthetic/sensor_sim.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <limits>
#include <span>
#include <vector>

#include "capture/synthetic/fixed_pattern.h"
#include "capture/synthetic/optics/crosstalk.h"
#include "capture/synthetic/readout.h"
#include "isp/base/random/random.h"

namespace lowlux::capture {
namespace {

using isp::Effect;
using isp::NoiseSourceSet;

int blocks_across(int pixels) { return (pixels + isp::effect_block - 1) / isp::effect_block; }

/// Row buffers of one thread.
struct Scratch {
  explicit Scratch(int width) : signal(width), mean(width), offset(width), normal(width), words(width) {}
  std::vector<float> signal, mean, offset, normal;
  std::vector<std::uint32_t> words;
};

/// Pixels x0 to x1 of one row, all of one region.
struct Run {
  int x0, x1, y;
  std::size_t size() const { return static_cast<std::size_t>(x1 - x0); }
};

class RowReadout {
 public:
  explicit RowReadout(const SensorFrame& frame)
      : frame_(frame), dark_(isp::dark_mean_e(frame.sensor, frame.exposure)), glow_(glow_of(frame)) {
    hot_mean_e_ = frame.sensor.hot_pixel_current_e_per_s * frame.exposure.time_s *
                  isp::dark_current_factor(frame.sensor, frame.exposure.temperature_c);
  }

  template <class Code>
  void operator()(const Run& run, NoiseSourceSet kept, Scratch& s, Code* out) const {
    const std::size_t n = run.size();
    const auto signal = std::span(s.signal).first(n), mean = std::span(s.mean).first(n);
    fill_signal(run, kept, s, signal);
    fill_dark(run, kept, s, mean);
    const bool steady = frame_.photons != nullptr || !kept.has(Effect::photon_noise);
    if (!steady) {
      for (std::size_t i = 0; i < n; ++i) mean[i] += signal[i];
    }
    for (float& value : mean) value = std::min(value, poisson_max_mean);
    RowCharge charge{mean, steady ? std::span<const float>(signal) : std::span<const float>(),
                     fill_offset(run, kept, s)};
    read_out_row({frame_.seed, frame_.frame, draw_purpose::electrons}, static_cast<std::uint32_t>(run.x0),
                 static_cast<std::uint32_t>(run.y), charge, parameters(kept, steady), std::span<Code>(out + run.x0, n));
  }

 private:
  PatternRow pattern(const Run& run) const {
    return {frame_.pattern_seed, static_cast<std::uint32_t>(run.x0), static_cast<std::uint32_t>(run.y)};
  }

  void fill_signal(const Run& run, NoiseSourceSet kept, Scratch& s, std::span<float> signal) const {
    const auto time = static_cast<float>(frame_.exposure.time_s);
    const PlaneView<const float>& light =
        kept.has(Effect::lens_blur) && frame_.has_lens_blur() ? frame_.blurred_e_per_s : frame_.rate_e_per_s;
    if (frame_.photons != nullptr && kept.has(Effect::photon_noise)) {
      frame_.photons->collect(frame_.seed, frame_.frame, run.x0, run.y, frame_.exposure.time_s, signal);
    } else if (kept.has(Effect::crosstalk) && frame_.sensor.crosstalk > 0) {
      mix_neighbours(light, {frame_.sensor.crosstalk, frame_.masked_columns}, run.x0, run.y, signal);
      for (float& value : signal) value *= time;
    } else {
      const float* rate = light.row(run.y) + run.x0;
      for (std::size_t i = 0; i < signal.size(); ++i) signal[i] = rate[i] * time;
    }
    if (kept.has(Effect::prnu)) apply_prnu(pattern(run), static_cast<float>(frame_.sensor.prnu), signal, s.normal);
  }

  void fill_dark(const Run& run, NoiseSourceSet kept, Scratch& s, std::span<float> mean) const {
    std::array<float, 2> dark{};
    if (kept.has(Effect::dark_current)) {
      for (int i = 0; i < 2; ++i) {
        dark[i] = static_cast<float>(dark_[static_cast<int>(colour_at(frame_.phase, run.x0 + i, run.y))]);
      }
    }
    for (std::size_t i = 0; i < mean.size(); ++i) mean[i] = dark[i & 1];
    if (kept.has(Effect::dsnu)) apply_dsnu(pattern(run), static_cast<float>(frame_.sensor.dsnu), mean, s.normal);
    if (kept.has(Effect::hot_pixels)) {
      add_hot_pixels(pattern(run), frame_.sensor.hot_pixel_fraction, hot_mean_e_, mean, s.words);
    }
    if (kept.has(Effect::amplifier_glow) && glow_.present()) {
      for (std::size_t i = 0; i < mean.size(); ++i) {
        mean[i] += static_cast<float>(glow_.mean_e(run.x0 + static_cast<int>(i), run.y));
      }
    }
  }

  std::span<const float> fill_offset(const Run& run, NoiseSourceSet kept, Scratch& s) const {
    const SensorModel& sensor = frame_.sensor;
    const bool telegraph = kept.has(Effect::telegraph_noise) && isp::telegraph_variance_e2(sensor) > 0;
    if (!kept.has(Effect::row_noise) && !kept.has(Effect::column_noise) && !telegraph) return {};
    const auto offset = std::span(s.offset).first(run.size());
    const float row = kept.has(Effect::row_noise)
                          ? row_offset_e(frame_.seed, frame_.frame, static_cast<std::uint32_t>(run.y),
                                         static_cast<float>(sensor.row_noise_e))
                          : 0;
    std::fill(offset.begin(), offset.end(), row);
    if (kept.has(Effect::column_noise)) {
      add_column_pattern(pattern(run), static_cast<float>(sensor.column_noise_e), offset, s.normal);
    }
    if (telegraph) {
      add_telegraph_noise(pattern(run), frame_.seed, frame_.frame, sensor.telegraph_fraction, sensor.telegraph_e,
                          offset, s.words);
    }
    return offset;
  }

  ReadoutParameters parameters(NoiseSourceSet kept, bool steady) const {
    const SensorModel& sensor = frame_.sensor;
    ReadoutParameters p;
    p.full_well_e =
        kept.has(Effect::clipping) ? static_cast<float>(sensor.full_well_e) : std::numeric_limits<float>::infinity();
    p.read_noise_e = kept.has(Effect::read_noise) ? static_cast<float>(sensor.read_noise_e) : 0;
    p.gain_dn_per_e = static_cast<float>(sensor.system_gain_dn_per_e);
    p.black_dn = static_cast<float>(sensor.black_level_dn);
    p.max_dn = static_cast<float>(sensor.white_level_dn);
    p.quantisation = sensor.quantisation;
    p.photon_noise = !steady || kept.has(Effect::dark_current) || kept.has(Effect::hot_pixels) ||
                     (kept.has(Effect::amplifier_glow) && glow_.present());
    p.quantise = kept.has(Effect::quantisation);
    p.clip = kept.has(Effect::clipping);
    return p;
  }

  const SensorFrame& frame_;
  std::array<double, 3> dark_;
  isp::AmplifierGlow glow_;
  double hot_mean_e_ = 0;
};

/// Reads out rows first to last, in runs of one region.
template <class Code>
void read_out_rows(const SensorFrame& frame, const isp::NoiseSourcePlan& plan, RowBand band, PlaneView<Code> dn) {
  const int width = frame.rate_e_per_s.width, across = blocks_across(width);
  const RowReadout readout(frame);
  Scratch scratch(width);
  for (int y = band.first; y < band.last; ++y) {
    const std::uint8_t* region = plan.region_of_block.data() + static_cast<std::size_t>(y / isp::effect_block) * across;
    for (int block = 0; block < across;) {
      int end = block + 1;
      while (end < across && region[end] == region[block]) ++end;
      const Run run{block * isp::effect_block, std::min(width, end * isp::effect_block), y};
      readout(run, plan.regions[region[block]].kept, scratch, dn.row(y));
      block = end;
    }
  }
}

template <class Code>
void read_out_bands(const SensorFrame& frame, const isp::NoiseSourcePlan& plan, Executor& executor,
                    PlaneView<Code> dn) {
  for_each_band(executor, dn.height, [&](RowBand band, int) { read_out_rows(frame, plan, band, dn); });
}

/// Returns the shortest of three times [ms], writing the output of a file: codes where the converter is kept.
template <class Code>
double time_rows(const SensorFrame& frame, const isp::NoiseSourcePlan& plan, Plane<Code>& dn) {
  double best = std::numeric_limits<double>::infinity();
  for (int i = 0; i < 3; ++i) {
    const auto start = std::chrono::steady_clock::now();
    read_out_rows(frame, plan, {0, dn.height()}, dn.view());
    const std::chrono::duration<double, std::milli> taken = std::chrono::steady_clock::now() - start;
    best = std::min(best, taken.count());
  }
  return best;
}

}  // namespace

isp::AmplifierGlow glow_of(const SensorFrame& frame) {
  return {frame.sensor, frame.exposure, frame.rate_e_per_s.width, frame.rate_e_per_s.height};
}

void read_out(const SensorFrame& frame, const isp::NoiseSourcePlan& plan, Executor& executor, PlaneView<float> dn) {
  read_out_bands(frame, plan, executor, dn);
}

void read_out(const SensorFrame& frame, const isp::NoiseSourcePlan& plan, Executor& executor,
              PlaneView<std::uint16_t> dn) {
  read_out_bands(frame, plan, executor, dn);
}

EffectCost measure_cost(const SensorFrame& frame, const isp::NoiseSourcePlan& plan) {
  constexpr int measured_rows = 128;
  const int height = frame.rate_e_per_s.height, rows = std::min(height, measured_rows);
  const double scale = static_cast<double>(height) / rows;
  Plane<float> dn(frame.rate_e_per_s.width, rows);
  Plane<std::uint16_t> codes(dn.width(), dn.height());
  isp::NoiseSourcePlan timed = plan;
  const auto time_with = [&](NoiseSourceSet kept) {
    for (isp::RegionPlan& region : timed.regions) region.kept = kept;
    const bool whole = kept.has(Effect::quantisation) && kept.has(Effect::clipping);
    return scale * (whole ? time_rows(frame, timed, codes) : time_rows(frame, timed, dn));
  };
  NoiseSourceSet present;
  for (const isp::NoiseSourceDecision& d : plan.regions.front().decisions) {
    if (d.reason != isp::NoiseSourceDecision::Reason::absent) present = present.with(d.effect);
  }
  EffectCost cost;
  cost.all_ms = time_with(present);
  for (int i = 0; i < isp::effect_count; ++i) {
    const auto effect = static_cast<Effect>(i);
    int without = 0, blocks = 0;
    for (const isp::RegionPlan& region : plan.regions) {
      blocks += region.blocks;
      if (!region.kept.has(effect)) without += region.blocks;
    }
    if (without == 0 || !present.has(effect)) continue;
    const double share = static_cast<double>(without) / blocks;
    cost.saved_ms[i] = share * (cost.all_ms - time_with(present.without(effect)));
  }
  return cost;
}

}  // namespace lowlux::capture
