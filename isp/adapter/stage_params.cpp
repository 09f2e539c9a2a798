#include "isp/adapter/stage_params.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <numbers>

#include "isp/adapter/stage_exposure.h"
#include "isp/base/sensor.h"

namespace lowlux::isp {
namespace {

constexpr double mean_reflectance = 0.18;
constexpr double min_luminance_cd_m2 = 1e-7;
constexpr std::uint64_t longest_step_ns = 2'000'000'000;

bool has(const lowlux_stage_params& params, std::uint32_t bit) { return (params.valid & bit) != 0; }

/// Returns whether a value is in [low, high]; false for a value that is not a number.
bool within(double value, double low, double high) { return value >= low && value <= high; }

template <std::size_t kCount>
bool all_within(const float (&values)[kCount], double low, double high) {
  return std::ranges::all_of(values, [&](float value) { return within(value, low, high); });
}

void set_levels(const lowlux_stage_params& params, const StageStream& stream, const StageProfile* profile,
                StageFacts& out) {
  const auto given = [&](std::uint32_t bit, double value) {
    return has(params, bit) ? std::optional<double>(value) : std::nullopt;
  };
  const auto temperature_c = given(LOWLUX_STAGE_HAS_TEMPERATURE, params.temperature_c);
  const auto gain = given(LOWLUX_STAGE_HAS_ANALOGUE_GAIN, params.analogue_gain);
  const std::optional<StageSensor> sensor =
      profile != nullptr ? profile->at(gain, out.live.exposure_s, temperature_c) : std::nullopt;
  const double digital = has(params, LOWLUX_STAGE_HAS_DIGITAL_GAIN) ? params.digital_gain : 1;
  PerSite<double> dark_e{};
  double gain_dn = 0, read_dn = 0;
  if (sensor) {
    dark_e = sensor->dark_e;
    gain_dn = sensor->gain_dn_per_e * digital;
    read_dn = sensor->read_noise_dn * digital;
    out.noise_from = LOWLUX_STAGE_FROM_PROFILE;
    out.applied |= params.valid & (LOWLUX_STAGE_HAS_TEMPERATURE | LOWLUX_STAGE_HAS_ANALOGUE_GAIN |
                                   LOWLUX_STAGE_HAS_EXPOSURE | LOWLUX_STAGE_HAS_DIGITAL_GAIN);
  }
  if (has(params, LOWLUX_STAGE_HAS_NOISE)) {
    gain_dn = params.noise_gain;
    read_dn = params.noise_read;
    out.noise_from = LOWLUX_STAGE_FROM_PARAMS;
    out.applied |= LOWLUX_STAGE_HAS_NOISE;
  }
  PerSite<double> black_dn{};
  if (has(params, LOWLUX_STAGE_HAS_BLACK)) {
    black_dn = sites_of(params.black_level, stream.phase);
    out.black_from = LOWLUX_STAGE_FROM_PARAMS;
    out.applied |= LOWLUX_STAGE_HAS_BLACK;
  } else if (sensor && sensor->pedestal_dn && !stream.has_masked) {
    black_dn = *sensor->pedestal_dn;
    out.black_from = LOWLUX_STAGE_FROM_PROFILE;
  }
  // A level of the sensor's driver is the pedestal without dark charge; masked pixels include the dark charge already.
  for (int site = 0; site < 4; ++site) black_dn[site] += gain_dn * dark_e[site];
  if (out.black_from != LOWLUX_STAGE_FROM_NOTHING) out.live.black_dn = black_dn;
  if (gain_dn <= 0) return;
  LiveNoise& noise = out.live.noise.emplace();
  noise.gain_dn = gain_dn;
  noise.read_variance_dn2 = read_dn * read_dn + quantisation_dn2;
  if (sensor && sensor->dark_is_apart) noise.pedestal_dn = sensor->pedestal_dn;
  for (int site = 0; site < 4; ++site) {
    noise.black_variance_dn2[site] = noise.read_variance_dn2 + gain_dn * gain_dn * dark_e[site];
  }
}

void set_light(const lowlux_stage_params& params, StageFacts& out) {
  LiveFacts& live = out.live;
  const double analogue = has(params, LOWLUX_STAGE_HAS_ANALOGUE_GAIN) ? params.analogue_gain : 1;
  const double digital = has(params, LOWLUX_STAGE_HAS_DIGITAL_GAIN) ? params.digital_gain : 1;
  if (has(params, LOWLUX_STAGE_HAS_ANALOGUE_GAIN)) live.iso = 100 * analogue * digital;
  if (has(params, LOWLUX_STAGE_HAS_F_NUMBER)) live.f_number = params.f_number;
  if (has(params, LOWLUX_STAGE_HAS_SCENE_LUMINANCE)) {
    live.scene_luminance_cd_m2 = params.scene_luminance_cd_m2;
    out.applied |= LOWLUX_STAGE_HAS_SCENE_LUMINANCE;
  } else if (has(params, LOWLUX_STAGE_HAS_LUX) && params.lux > 0 && !(live.iso && live.f_number && live.exposure_s)) {
    // Meters report any small number in the dark.
    live.scene_luminance_cd_m2 = std::max(mean_reflectance * params.lux / std::numbers::pi, min_luminance_cd_m2);
    out.applied |= LOWLUX_STAGE_HAS_LUX;
  } else {
    out.applied |= params.valid & LOWLUX_STAGE_HAS_F_NUMBER;
  }
}

void set_colour(const lowlux_stage_params& params, const StageStream& stream, StageFacts& out) {
  if (stream.format.layout == SensorLayout::monochrome) return;
  if (has(params, LOWLUX_STAGE_HAS_COLOUR_GAINS)) {
    out.live.neutral = Vector3{1.0 / params.colour_gains[0], 1, 1.0 / params.colour_gains[1]};
    out.applied |= LOWLUX_STAGE_HAS_COLOUR_GAINS;
  }
  if (has(params, LOWLUX_STAGE_HAS_COLOUR_MATRIX)) {
    Matrix3& matrix = out.live.colour_matrix.emplace();
    for (int i = 0; i < 9; ++i) matrix[i / 3][i % 3] = params.colour_matrix[i];
    out.applied |= LOWLUX_STAGE_HAS_COLOUR_MATRIX;
  }
  if (has(params, LOWLUX_STAGE_HAS_SATURATION)) {
    out.live.saturation = params.saturation;
    out.applied |= LOWLUX_STAGE_HAS_SATURATION;
  }
}

LiveDenoise denoise_of(const lowlux_stage_params& params, const StageStream& stream) {
  using Mode = LiveDenoise::Mode;
  LiveDenoise out{.mode = stream.has_level ? Mode::automatic : Mode::off, .temporal = stream.temporal};
  if (!has(params, LOWLUX_STAGE_HAS_DENOISE)) return out;
  switch (params.denoise) {
    case LOWLUX_STAGE_DENOISE_OFF:
      return {.mode = Mode::off, .temporal = false};
    case LOWLUX_STAGE_DENOISE_FAST:
      out = {.mode = Mode::level, .level = denoise::Level::draft, .temporal = stream.temporal};
      break;
    case LOWLUX_STAGE_DENOISE_HIGH_QUALITY:
      out = {
          .mode = Mode::level, .level = std::max(stream.most, denoise::Level::standard), .temporal = stream.temporal};
      break;
    case LOWLUX_STAGE_DENOISE_AUTO:
      break;
    default:  // minimal, and libcamera's ZSL
      out = {.mode = stream.temporal ? Mode::off : Mode::level,
             .level = denoise::Level::draft,
             .temporal = stream.temporal};
      break;
  }
  if (!stream.has_level) out.mode = Mode::off;
  return out;
}

LiveDenoise limited(LiveDenoise asked, StageWork most) {
  using denoise::Level;
  if (most == StageWork::standard) asked.most = Level::standard;
  if (most == StageWork::draft) asked.most = Level::draft;
  if (most >= StageWork::frames_before) asked.most.reset();
  asked.temporal = asked.temporal && most != StageWork::plain;
  return asked;
}

}  // namespace

StageWork work_of(denoise::Level level) {
  assert(level <= denoise::Level::high);
  return static_cast<StageWork>(static_cast<int>(denoise::Level::high) - static_cast<int>(level));
}

StageWork asked_of(const lowlux_stage_params& params, const StageStream& stream) {
  const LiveDenoise asked = denoise_of(params, stream);
  if (asked.mode == LiveDenoise::Mode::automatic) return work_of(stream.most);
  if (asked.mode == LiveDenoise::Mode::level) return work_of(std::min(asked.level, stream.most));
  return asked.temporal ? StageWork::frames_before : StageWork::plain;
}

PerSite<double> sites_of(const float (&channels)[4], BayerPhase phase) {
  PerSite<double> out{};
  for (int site = 0; site < 4; ++site) out[site] = channels[black_channel_of(site, phase)];
  return out;
}

void to_channels(const PerSite<double>& sites, BayerPhase phase, float (&channels)[4]) {
  for (int site = 0; site < 4; ++site) channels[black_channel_of(site, phase)] = static_cast<float>(sites[site]);
}

const char* fault_of(const lowlux_stage_params& p) {
  struct Rule {
    std::uint32_t bit;
    bool holds;
    const char* fault;
  };
  const Rule rules[] = {
      {LOWLUX_STAGE_HAS_BLACK, all_within(p.black_level, 0, 65535), "a black level must be between 0 and 65535"},
      {LOWLUX_STAGE_HAS_EXPOSURE, within(p.exposure_s, 1e-7, 1e5),
       "an exposure time must be between 1e-7 and 1e5 seconds"},
      {LOWLUX_STAGE_HAS_ANALOGUE_GAIN, within(p.analogue_gain, 0.1, 1e4),
       "an analogue gain must be between 0.1 and 1e4"},
      {LOWLUX_STAGE_HAS_DIGITAL_GAIN, within(p.digital_gain, 0.1, 1e3), "a digital gain must be between 0.1 and 1000"},
      {LOWLUX_STAGE_HAS_COLOUR_GAINS, all_within(p.colour_gains, 1e-3, 1e3),
       "colour gains must be between 0.001 and 1000"},
      {LOWLUX_STAGE_HAS_COLOUR_MATRIX, all_within(p.colour_matrix, -1e3, 1e3),
       "values of the colour matrix must be between -1000 and 1000"},
      {LOWLUX_STAGE_HAS_LUX, within(p.lux, 0, 1e9), "an illuminance must be between 0 and 1e9 lux"},
      {LOWLUX_STAGE_HAS_TEMPERATURE, within(p.temperature_c, -100, 200),
       "a temperature must be between -100 and 200 C"},
      {LOWLUX_STAGE_HAS_DENOISE, p.denoise >= 0 && p.denoise <= LOWLUX_STAGE_DENOISE_AUTO, "unknown denoise mode"},
      {LOWLUX_STAGE_HAS_GAMMA, within(p.gamma, 0, 100), "gamma must be between 0 and 100"},
      {LOWLUX_STAGE_HAS_CONTRAST, within(p.contrast, 0, 100), "contrast must be between 0 and 100"},
      {LOWLUX_STAGE_HAS_SATURATION, within(p.saturation, 0, 4), "saturation must be between 0 and 4"},
      {LOWLUX_STAGE_HAS_SHARPNESS, within(p.sharpness, 0, 100), "sharpness must be between 0 and 100"},
      {LOWLUX_STAGE_HAS_EXPOSURE_VALUE, within(p.exposure_ev, -10, 20), "an exposure value must be between -10 and 20"},
      {LOWLUX_STAGE_HAS_NOISE, within(p.noise_gain, 1e-6f, 65535) && within(p.noise_read, 0, 65535),
       "a system gain must be between 1e-6 and 65535 DN per electron, read noise between 0 and 65535 DN"},
      {LOWLUX_STAGE_HAS_F_NUMBER, within(p.f_number, 0.1, 1e3), "an f-number must be between 0.1 and 1000"},
      {LOWLUX_STAGE_HAS_SCENE_LUMINANCE, within(p.scene_luminance_cd_m2, min_luminance_cd_m2, 1e9),
       "a luminance must be between 1e-7 and 1e9 cd/m2"},
      {LOWLUX_STAGE_HAS_BUDGET, within(p.budget_ms, 0.01F, 1e6), "a budget must be between 0.01 and 1e6 ms per frame"},
      {~static_cast<std::uint32_t>(LOWLUX_STAGE_HAS_ALL), false, "a bit of valid is unknown"},
  };
  for (const Rule& rule : rules) {
    if (has(p, rule.bit) && !rule.holds) return rule.fault;
  }
  return has(p, LOWLUX_STAGE_HAS_EXPOSURE_LIMITS) ? fault_of_limits(p) : nullptr;
}

StageFacts facts_of(const lowlux_stage_params& params, const StageStream& stream, const StageProfile* profile,
                    StageWork most) {
  StageFacts out;
  if (has(params, LOWLUX_STAGE_HAS_EXPOSURE)) out.live.exposure_s = params.exposure_s;
  set_levels(params, stream, profile, out);
  set_light(params, out);
  set_colour(params, stream, out);
  const LiveDenoise asked = denoise_of(params, stream);
  out.live.denoise = limited(asked, most);
  out.temporal_asked = asked.temporal;
  out.applied |= params.valid & LOWLUX_STAGE_HAS_BUDGET;
  if (stream.format.layout == SensorLayout::bayer) out.applied |= params.valid & LOWLUX_STAGE_HAS_DENOISE;
  if (has(params, LOWLUX_STAGE_HAS_EXPOSURE_VALUE)) {
    out.live.exposure_ev = params.exposure_ev;
    out.applied |= LOWLUX_STAGE_HAS_EXPOSURE_VALUE;
  }
  if (out.live.denoise.temporal) {
    out.applied |= params.valid & (LOWLUX_STAGE_HAS_SEQUENCE | LOWLUX_STAGE_HAS_TIMESTAMP | LOWLUX_STAGE_HAS_EXPOSURE);
  }
  return out;
}

bool StageHistory::follows(const lowlux_stage_params& params) const {
  const double exposure_ns = has(params, LOWLUX_STAGE_HAS_EXPOSURE) ? params.exposure_s * 1e9 : 0;
  const std::uint64_t longest_ns = std::max(longest_step_ns, static_cast<std::uint64_t>(3 * exposure_ns));
  if (sequence_ && has(params, LOWLUX_STAGE_HAS_SEQUENCE) && params.sequence != *sequence_ + 1) return false;
  // The difference is unsigned: a step back is a long one too.
  return !timestamp_ns_ || !has(params, LOWLUX_STAGE_HAS_TIMESTAMP) ||
         params.timestamp_ns - *timestamp_ns_ <= longest_ns;
}

void StageHistory::take(const lowlux_stage_params& params) {
  if (has(params, LOWLUX_STAGE_HAS_SEQUENCE)) sequence_ = params.sequence;
  if (has(params, LOWLUX_STAGE_HAS_TIMESTAMP)) timestamp_ns_ = params.timestamp_ns;
}

void StageHistory::reset() { *this = {}; }

}  // namespace lowlux::isp
