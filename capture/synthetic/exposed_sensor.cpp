#include "capture/synthetic/exposed_sensor.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>
#include <utility>

#include "capture/synthetic/block_levels.h"
#include "isp/base/random/random.h"
#include "isp/base/sensor.h"
#include "isp/base/text.h"

namespace lowlux::capture {
namespace {

using isp::Effect;

constexpr double pedestal_sigmas = 8;    // standard deviations of the noise, below a stored pedestal
constexpr double largest_deviate = 6.5;  // limit of the normal deviates of isp/base/random/random.h
constexpr double hottest = 23;           // limit of hot pixels' charge: 33 log(2) times their mean

template <class Predicate>
bool every_region(const isp::NoiseSourcePlan& plan, const Predicate& predicate) {
  return std::all_of(plan.regions.begin(), plan.regions.end(), predicate);
}

/// Returns the rate with black columns added at its left.
Plane<float> with_mask(const Plane<float>& rate, int masked_columns) {
  Plane<float> out(rate.width() + masked_columns, rate.height());
  for (int y = 0; y < rate.height(); ++y) {
    std::fill_n(out.row(y), masked_columns, 0.0f);
    std::copy_n(rate.row(y), rate.width(), out.row(y) + masked_columns);
  }
  return out;
}

/// Returns the mean code at which a pixel saturates, above black [DN]: the full well's, if that is less than the
/// converter's.
double range_dn(const SensorModel& s) { return s.system_gain_dn_per_e * isp::saturation_charge_e(s); }

/// Returns the mean of floor(x) for a normal variable x, as the sum of the probabilities that it reaches each code.
double mean_of_floor(double mean, double std) {
  if (std > 1.5) return mean - 0.5;  // to 1e-19
  if (!(std > 0)) return std::floor(mean);
  const double first = std::floor(mean - 10 * std);
  double out = first;
  for (double code = first + 1; code <= mean + 10 * std; ++code) {
    out += 0.5 * std::erfc((code - mean) / (std * std::numbers::sqrt2));
  }
  return out;
}

/// Returns the mean code of a pixel without charge [DN], clipping at 0 left out.
double mean_black_dn(const SensorModel& s, isp::NoiseSourceSet kept) {
  double variance_e2 = 0;
  if (kept.has(Effect::read_noise)) variance_e2 += s.read_noise_e * s.read_noise_e;
  if (kept.has(Effect::row_noise)) variance_e2 += s.row_noise_e * s.row_noise_e;
  if (kept.has(Effect::column_noise)) variance_e2 += s.column_noise_e * s.column_noise_e;
  const double to_nearest = s.quantisation == Quantisation::round ? 0.5 : 0;
  return mean_of_floor(s.black_level_dn + to_nearest, s.system_gain_dn_per_e * std::sqrt(variance_e2));
}

/// Returns the plan of a file: the planner's, with the effects that cost no time: the converter, which makes files of
/// one sensor alike, and the blur of the lens, which is computed once for all frames, and which the truth has too.
isp::NoiseSourcePlan with_free_effects(isp::NoiseSourcePlan plan) {
  for (isp::RegionPlan& region : plan.regions) {
    for (const Effect effect : {Effect::quantisation, Effect::clipping, Effect::lens_blur}) {
      isp::NoiseSourceDecision& d = region.decisions[static_cast<int>(effect)];
      if (d.reason != isp::NoiseSourceDecision::Reason::negligible) continue;
      region.kept = region.kept.with(effect);
      d.reason = isp::NoiseSourceDecision::Reason::free;
      d.kept = true;
    }
  }
  return plan;
}

/// Returns the name of the camera: that of the sensor, as the ISO states the gain setting. Where it does not, because
/// the setting has another name or other options determine the ISO, the gain setting follows.
std::string model_of(const SyntheticCamera& camera) {
  const isp::NamedSensor& sensor = camera.sensor;
  const bool iso_is_setting = sensor.iso && !sensor.iso_given && std::lround(camera.iso) == std::lround(*sensor.iso);
  if (iso_is_setting || sensor.gain_setting.empty()) return sensor.model.name;
  return sensor.model.name + " " + sensor.gain_setting;
}

}  // namespace

ExposedSensor::ExposedSensor(SyntheticCamera camera, SensorLight light)
    : camera_(std::move(camera)), light_(std::move(light)) {
  const int masked = camera_.options.masked_columns;
  for (Plane<float>* const plane : {&light_.e_per_s, &light_.blurred_e_per_s}) {
    if (masked > 0 && !plane->empty()) *plane = with_mask(*plane, masked);
  }
}

Result<ExposedSensor> ExposedSensor::of(SyntheticCamera camera, SensorLight light) {
  ExposedSensor out(std::move(camera), std::move(light));
  const std::vector<isp::BlockLevel> blocks = out.plan_effects();
  out.choose_storage();
  if (const auto good = out.check_means(blocks); !good) return tl::make_unexpected(good.error());
  return out;
}

std::vector<isp::BlockLevel> ExposedSensor::plan_effects() {
  const SyntheticOptions& options = camera_.options;
  const SensorModel& sensor = camera_.sensor.model;
  auto blocks = block_levels(sensor_frame(0, nullptr));
  developing_ =
      isp::developing_of(sensor, options.exposure, camera_.camera_to_xyz, *camera_.colour.as_shot_neutral, blocks);
  const NoiseSourceChoice& choice = options.effects;
  plan_ = choice.tolerance ? isp::plan_noise_sources(sensor, options.exposure, developing_, blocks, *choice.tolerance)
                           : isp::fixed_effects(sensor, options.exposure, developing_, blocks, choice.effects);
  file_plan_ = choice.tolerance ? with_free_effects(plan_) : plan_;
  return blocks;
}

double ExposedSensor::largest_mean_e(const isp::BlockLevel& block, isp::NoiseSourceSet kept) const {
  const SensorModel& s = camera_.sensor.model;
  const auto dark = isp::dark_mean_e(s, camera_.options.exposure);
  const double dark_e = kept.has(Effect::dark_current) ? *std::max_element(dark.begin(), dark.end()) : 0;
  // The planner has considered the loss in the few extreme pixels; a caller who sets effects has not.
  const double glow_e = kept.has(Effect::amplifier_glow) ? block.glow.peak_e : 0;
  if (camera_.options.effects.tolerance) return block.peak_e + dark_e + glow_e;
  const double prnu = kept.has(Effect::prnu) ? s.prnu : 0, dsnu = kept.has(Effect::dsnu) ? s.dsnu : 0;
  const double hot_e = kept.has(Effect::hot_pixels) && s.hot_pixel_fraction > 0
                           ? s.hot_pixel_current_e_per_s * camera_.options.exposure.time_s *
                                 isp::dark_current_factor(s, camera_.options.exposure.temperature_c)
                           : 0;
  return block.peak_e * (1 + largest_deviate * prnu) + dark_e * (1 + largest_deviate * dsnu) + hottest * hot_e + glow_e;
}

Result<void> ExposedSensor::check_means(const std::vector<isp::BlockLevel>& blocks) const {
  double mean_e = 0;
  for (std::size_t i = 0; i < blocks.size(); ++i) {
    const isp::NoiseSourceSet kept = plan_.regions[plan_.region_of_block[i]].kept;
    if (!kept.has(Effect::clipping)) mean_e = std::max(mean_e, largest_mean_e(blocks[i], kept));
  }
  if (mean_e <= poisson_max_mean) return {};
  return fail(ErrorCode::invalid_argument,
              "a pixel may collect " + number_text(mean_e, 3) +
                  " e- on average, above the sampler's limit of 1e6: simulate clipping, or expose less");
}

void ExposedSensor::choose_storage() {
  const SensorModel& s = camera_.sensor.model;
  const bool quantised = every_region(file_plan_, [](const auto& r) { return r.kept.has(Effect::quantisation); });
  const bool clipped = every_region(file_plan_, [](const auto& r) { return r.kept.has(Effect::clipping); });
  storage_ = {1, 0, quantised && clipped};
  if (!clipped) {
    const double steady =
        s.read_noise_e * s.read_noise_e + s.row_noise_e * s.row_noise_e + s.column_noise_e * s.column_noise_e;
    const double telegraph_e = isp::telegraph_variance_e2(s) > 0 ? 0.5 * hottest * s.telegraph_e : 0;
    const double noise_dn = s.system_gain_dn_per_e * std::sqrt(steady);
    storage_.offset_dn =
        std::max(0.0, std::ceil(pedestal_sigmas * noise_dn + s.system_gain_dn_per_e * telegraph_e - s.black_level_dn));
  }
  if (!quantised) storage_.scale = std::max(1, static_cast<int>(65535 / (s.white_level_dn + storage_.offset_dn)));
}

SensorFrame ExposedSensor::sensor_frame(std::uint32_t index, const PhotonRows* photons) const {
  const SyntheticOptions& options = camera_.options;
  return {
      camera_.sensor.model, options.exposure,    options.phase, light_.e_per_s.view(),  photons,
      options.seed,         options.sensor_seed, index,         options.masked_columns, light_.blurred_e_per_s.view()};
}

Plane<float> ExposedSensor::frame_dn(std::uint32_t index, const PhotonRows* photons, Executor& executor) const {
  Plane<float> dn(light_.e_per_s.width(), light_.e_per_s.height());
  read_out(sensor_frame(index, photons), plan_, executor, dn.view());
  return dn;
}

Plane<std::uint16_t> ExposedSensor::stored_codes(std::uint32_t index, const PhotonRows* photons,
                                                 Executor& executor) const {
  Plane<std::uint16_t> codes(light_.e_per_s.width(), light_.e_per_s.height());
  if (storage_.codes) {
    read_out(sensor_frame(index, photons), file_plan_, executor, codes.view());
    return codes;
  }
  const Plane<float> dn = frame_dn(index, photons, executor);
  const auto scale = static_cast<float>(storage_.scale), offset = static_cast<float>(storage_.offset_dn);
  for_each_band(executor, dn.height(), [&](RowBand band, int) {
    for (int y = band.first; y < band.last; ++y) {
      const float* from = dn.row(y);
      std::uint16_t* to = codes.row(y);
      for (int x = 0; x < dn.width(); ++x) {
        to[x] = static_cast<std::uint16_t>(std::clamp(std::nearbyint(scale * (from[x] + offset)), 0.0f, 65535.0f));
      }
    }
  });
  return codes;
}

RawFrame ExposedSensor::frame(std::uint32_t index, const PhotonRows* photons, Executor& executor) const {
  return described(stored_codes(index, photons, executor));
}

isp::NoiseSourceSet ExposedSensor::described_effects() const {
  return camera_.options.effects.tolerance ? isp::NoiseSourceSet::all()
                                           : file_plan_.regions.front().kept;  // one set for all regions
}

/// Returns the variance of codes in 0..1 of the range above black (DNG NoiseProfile): K / range * x + (K^2 sigma^2 +
/// 1/12) / range^2, for the simulated effects. Without the photons' Poisson distribution no line in x describes the
/// noise: then nullopt.
std::optional<NoiseProfile> ExposedSensor::noise_profile() const {
  const isp::NoiseSourceSet kept = described_effects();
  if (camera_.options.sampling == PhotonSampling::published || !kept.has(Effect::photon_noise)) return std::nullopt;
  const SensorModel& s = camera_.sensor.model;
  const double range = range_dn(s), k = s.system_gain_dn_per_e;
  double offset_dn2 = kept.has(Effect::quantisation) ? quantisation_dn2 : 0;
  if (kept.has(Effect::read_noise)) offset_dn2 += k * k * s.read_noise_e * s.read_noise_e;
  if (kept.has(Effect::row_noise)) offset_dn2 += k * k * s.row_noise_e * s.row_noise_e;
  if (kept.has(Effect::telegraph_noise)) offset_dn2 += k * k * isp::telegraph_variance_e2(s);
  NoiseProfile out;
  out.scale.fill(k / range);
  out.offset.fill(offset_dn2 / (range * range));
  return out;
}

RawFrame ExposedSensor::described(Plane<std::uint16_t> codes) const {
  const SensorModel& s = camera_.sensor.model;
  const int masked = camera_.options.masked_columns, width = codes.width() - masked, height = codes.height();
  RawFrame out;
  out.raw.dn = std::move(codes);
  out.raw.layout = SensorLayout::bayer;
  out.raw.phase = camera_.options.phase;  // masked_columns is even
  out.raw.active = {masked, 0, width, height};
  out.raw.default_crop = {0, 0, width, height};
  if (masked > 0) {
    out.raw.masked = {{0, 0, masked, height}};
    out.raw.masked_is_stated = true;
  }
  const double scale = storage_.scale, offset = storage_.offset_dn;
  const double black_dn = file_plan_.regions.front().kept.has(Effect::quantisation)
                              ? std::max(0.0, mean_black_dn(s, described_effects()))
                              : s.black_level_dn;
  out.raw.black_tag = BlackLevel{1, 1, 1, {scale * (black_dn + offset)}, {}, {}};
  out.raw.white_dn.fill(std::round(std::min(65535.0, scale * (s.black_level_dn + range_dn(s) + offset))));
  FrameInfo& info = out.raw.info;
  info.make = "lowlux";
  info.model = model_of(camera_);
  info.exposure_s = camera_.options.exposure.time_s;
  info.temperature_c = camera_.options.exposure.temperature_c;
  info.f_number = camera_.options.f_number;
  info.iso = camera_.iso;
  out.colour = camera_.colour;
  out.noise = noise_profile();
  return out;
}

EffectCost ExposedSensor::measure_cost(const PhotonRows* photons) const {
  return capture::measure_cost(sensor_frame(0, photons), file_plan_);
}

}  // namespace lowlux::capture
