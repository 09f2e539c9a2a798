#include "capture/synthetic/synthetic_source.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "isp/base/random/random.h"
#include "isp/base/sensor.h"
#include "isp/base/text.h"
#include "isp/model/colour/camera_colour.h"
#include "isp/model/colour/camera_matrix.h"
#include "isp/model/spectrum/cie_data.h"
#include "isp/model/spectrum/spectral_data.h"
#include "isp/model/spectrum/spectral_response.h"

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

/// Returns matrices for A and D65 fitted to the camera's sensitivities, and the neutral of the scene's white.
Result<CameraColour> colour_of(const isp::NamedSensor& sensor, const SpectralResponse& response,
                               const Spectrum& white) {
  const auto sensitivity = *isp::camera_sensitivity(sensor.camera);
  CameraColour colour;
  for (const char* light : {"A", "D65"}) {
    auto calibration = isp::fit_calibration(sensitivity, *isp::light_named(light), isp::ForwardMatrix::fit);
    if (!calibration) return tl::make_unexpected(calibration.error());
    colour.calibrations.push_back(*calibration);
  }
  Vector3 neutral = isp::electron_rate(response, white);
  const double largest = *std::max_element(neutral.begin(), neutral.end());
  if (!(*std::min_element(neutral.begin(), neutral.end()) > 1e-6 * largest)) {
    // A light that leaves a channel dark (or no light) gives no white balance: daylight replaces it.
    neutral = isp::electron_rate(response, *isp::radiance_of(*isp::light_named("D65"), 1));
  }
  const double scale = *std::max_element(neutral.begin(), neutral.end());
  colour.as_shot_neutral = Vector3{neutral[0] / scale, neutral[1] / scale, neutral[2] / scale};
  colour.source = CameraColour::Source::file_tags;
  return colour;
}

/// Returns the mean code at which a pixel saturates, above black [DN]: the full well's, if that is less than the
/// converter's.
double range_dn(const SensorModel& s) { return s.system_gain_dn_per_e * isp::saturation_charge_e(s); }

/// Returns the plan of a file: the planner's, with the converter, which costs no time and makes files of one sensor
/// alike.
isp::NoiseSourcePlan with_converter(isp::NoiseSourcePlan plan) {
  for (isp::RegionPlan& region : plan.regions) {
    for (const Effect effect : {Effect::quantisation, Effect::clipping}) {
      region.kept = region.kept.with(effect);
      isp::NoiseSourceDecision& d = region.decisions[static_cast<int>(effect)];
      if (!d.kept) d.reason = isp::NoiseSourceDecision::Reason::free;
      d.kept = true;
    }
  }
  return plan;
}

/// Checks the options as of() documents, and points that were not made by functions of scene.h.
Result<void> check_options(const SyntheticOptions& options, const Scene& scene) {
  if (options.masked_columns < 0 || options.masked_columns > 4096 || options.masked_columns % 2 != 0) {
    return fail(ErrorCode::invalid_argument, "masked columns are an even number between 0 and 4096");
  }
  if (const auto& t = options.effects.tolerance; t && (!(t->delta_e > 0) || !(t->relative_variance > 0))) {
    return fail(ErrorCode::invalid_argument, "a tolerance must be above 0: ask for all effects to leave none out");
  }
  if (options.sampling == PhotonSampling::published && options.effects.tolerance) {
    return fail(ErrorCode::invalid_argument,
                "the planner knows the variance of physical photons only: name the effects of published sampling");
  }
  if (options.sampling == PhotonSampling::published && !scene.points.empty()) {
    return fail(ErrorCode::invalid_argument, "published photon sampling draws pixels, not points: leave the stars out");
  }
  if (!(options.f_number >= 0.5) || !(options.f_number <= 1000)) {
    return fail(ErrorCode::invalid_argument, "the f-number must lie between 0.5 and 1000");
  }
  for (const PointSource& p : scene.points) {
    const bool near = std::fabs(p.x_px) <= 1e6 && std::fabs(p.y_px) <= 1e6;
    const bool lit = p.light >= 0 && p.light < static_cast<int>(scene.point_lights.size()) && p.luminance_cd_m2 >= 0;
    if (!near || !lit || !(p.spread_px > 0) || !(p.spread_px <= 1000)) {
      return fail(ErrorCode::invalid_argument,
                  "a point source lies within a million pixels and spreads over more than 0 and at most 1000");
    }
  }
  return {};
}

}  // namespace

SyntheticSource::SyntheticSource(Scene scene, isp::NamedSensor sensor, SpectralResponse response,
                                 const SyntheticOptions& options)
    : scene_(std::move(scene)), sensor_(std::move(sensor)), response_(std::move(response)), options_(options) {
  if (scene_.patch.empty()) table_ = std::make_unique<isp::LiftTable>(response_);
}

Result<SyntheticSource> SyntheticSource::of(Scene scene, isp::NamedSensor sensor, SpectralResponse response,
                                            const SyntheticOptions& options, Executor& executor) {
  if (const auto good = isp::check_sensor(sensor.model); !good) return tl::make_unexpected(good.error());
  if (const auto good = isp::check_exposure(options.exposure); !good) return tl::make_unexpected(good.error());
  if (const auto good = check_options(options, scene); !good) return tl::make_unexpected(good.error());
  SyntheticSource source(std::move(scene), std::move(sensor), std::move(response), options);
  if (const auto good = source.expose(executor); !good) return tl::make_unexpected(good.error());
  return source;
}

Result<void> SyntheticSource::expose(Executor& executor) {
  auto colour = colour_of(sensor_, response_, scene_.white);
  if (!colour) return tl::make_unexpected(colour.error());
  colour_ = *std::move(colour);
  const auto white = isp::white_of_neutral(colour_, *colour_.as_shot_neutral);
  const auto to_xyz = white ? isp::camera_to_xyz(colour_, white->xy, isp::white_d65)
                            : Result<Matrix3>(tl::make_unexpected(white.error()));
  if (!to_xyz) return tl::make_unexpected(to_xyz.error());

  rate_ = charge_rate(scene_, response_, table_.get(), options_.phase, executor);
  if (options_.masked_columns > 0) rate_.e_per_s = with_mask(rate_.e_per_s, options_.masked_columns);
  const SensorModel& sensor = sensor_.model;
  const auto blocks = block_levels(std::as_const(rate_.e_per_s).view(), options_.phase, options_.exposure.time_s);
  developing_ = isp::developing_of(sensor, options_.exposure, *to_xyz, *colour_.as_shot_neutral, blocks);
  const NoiseSourceChoice& choice = options_.effects;
  plan_ = choice.tolerance ? isp::plan_noise_sources(sensor, options_.exposure, developing_, blocks, *choice.tolerance)
                           : isp::fixed_effects(sensor, options_.exposure, developing_, blocks, choice.effects);
  file_plan_ = choice.tolerance ? with_converter(plan_) : plan_;
  choose_storage();
  if (auto good = check_photons(executor); !good) return good;
  return check_means(blocks);
}

double SyntheticSource::largest_mean_e(const isp::BlockLevel& block, isp::NoiseSourceSet kept) const {
  const SensorModel& s = sensor_.model;
  const auto dark = isp::dark_mean_e(s, options_.exposure);
  const double dark_e = kept.has(Effect::dark_current) ? *std::max_element(dark.begin(), dark.end()) : 0;
  // The planner has considered the loss in the few extreme pixels; a caller who sets effects has not.
  if (options_.effects.tolerance) return block.peak_e + dark_e;
  const double prnu = kept.has(Effect::prnu) ? s.prnu : 0, dsnu = kept.has(Effect::dsnu) ? s.dsnu : 0;
  const double hot_e = kept.has(Effect::hot_pixels) && s.hot_pixel_fraction > 0
                           ? s.hot_pixel_current_e_per_s * options_.exposure.time_s *
                                 isp::dark_current_factor(s, options_.exposure.temperature_c)
                           : 0;
  return block.peak_e * (1 + largest_deviate * prnu) + dark_e * (1 + largest_deviate * dsnu) + hottest * hot_e;
}

Result<void> SyntheticSource::check_means(const std::vector<isp::BlockLevel>& blocks) const {
  double mean_e = 0;
  for (std::size_t i = 0; i < blocks.size(); ++i) {
    const isp::NoiseSourceSet kept = plan_.regions[plan_.region_of_block[i]].kept;
    if (!kept.has(Effect::clipping)) mean_e = std::max(mean_e, largest_mean_e(blocks[i], kept));
  }
  if (mean_e <= poisson_max_mean) return {};
  return fail(
      ErrorCode::invalid_argument,
      "a pixel may collect " + number_text(mean_e, 3) +
          " e- on average, above the sampler's limit of 1e6, and clipping is left out: keep it, or expose less");
}

Result<void> SyntheticSource::check_photons(Executor& executor) const {
  const std::optional<PhotonRows> rows = photon_rows();
  const double photons = rows ? rows->largest_mean_per_s(executor) * options_.exposure.time_s : 0;
  if (photons <= poisson_max_mean) return {};
  return fail(ErrorCode::invalid_argument,
              "published photon sampling expects " + number_text(photons, 3) +
                  " photons in one bin of wavelengths, above the sampler's limit of 1e6: sample physically, or expose "
                  "less");
}

void SyntheticSource::choose_storage() {
  const SensorModel& s = sensor_.model;
  const bool quantised = every_region(file_plan_, [](const auto& r) { return r.kept.has(Effect::quantisation); });
  const bool clipped = every_region(file_plan_, [](const auto& r) { return r.kept.has(Effect::clipping); });
  storage_ = {1, 0, quantised && clipped};
  if (!clipped) {
    const double steady =
        s.read_noise_e * s.read_noise_e + s.row_noise_e * s.row_noise_e + s.column_noise_e * s.column_noise_e;
    const double noise_dn = s.system_gain_dn_per_e * std::sqrt(steady);
    storage_.offset_dn = std::max(0.0, std::ceil(pedestal_sigmas * noise_dn - s.black_level_dn));
  }
  if (!quantised) storage_.scale = std::max(1, static_cast<int>(65535 / (s.white_level_dn + storage_.offset_dn)));
}

SensorFrame SyntheticSource::sensor_frame(std::uint32_t index, const PhotonRows* photons) const {
  return {sensor_.model, options_.exposure, options_.phase,       rate_.e_per_s.view(),
          photons,       options_.seed,     options_.sensor_seed, index};
}

std::optional<PhotonRows> SyntheticSource::photon_rows() const {
  if (options_.sampling == PhotonSampling::physical) return std::nullopt;
  return PhotonRows(scene_, response_, table_.get(), options_.phase, options_.masked_columns);
}

template <class Code>
void SyntheticSource::read_out_frame(std::uint32_t index, const isp::NoiseSourcePlan& plan, Executor& executor,
                                     PlaneView<Code> out) const {
  const std::optional<PhotonRows> photons = photon_rows();
  read_out(sensor_frame(index, photons ? &*photons : nullptr), plan, executor, out);
}

Plane<float> SyntheticSource::frame_dn(std::uint32_t index, Executor& executor) const {
  Plane<float> dn(rate_.e_per_s.width(), rate_.e_per_s.height());
  read_out_frame(index, plan_, executor, dn.view());
  return dn;
}

Plane<std::uint16_t> SyntheticSource::stored_codes(std::uint32_t index, Executor& executor) const {
  Plane<std::uint16_t> codes(rate_.e_per_s.width(), rate_.e_per_s.height());
  if (storage_.codes) {
    read_out_frame(index, file_plan_, executor, codes.view());
    return codes;
  }
  const Plane<float> dn = frame_dn(index, executor);
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

RawFrame SyntheticSource::frame(std::uint32_t index, Executor& executor) const {
  return described(stored_codes(index, executor));
}

/// Returns the variance of codes in 0..1 of the range above black (DNG NoiseProfile): K / range * x + (K^2 sigma^2 +
/// 1/12) / range^2, for the simulated effects. Without the photons' Poisson distribution no line in x describes the
/// noise: then nullopt.
std::optional<NoiseProfile> SyntheticSource::noise_profile() const {
  const isp::NoiseSourceSet kept = options_.effects.tolerance
                                       ? isp::NoiseSourceSet::all()
                                       : file_plan_.regions.front().kept;  // one set for all regions
  if (options_.sampling == PhotonSampling::published || !kept.has(Effect::photon_noise)) return std::nullopt;
  const SensorModel& s = sensor_.model;
  const double range = range_dn(s), k = s.system_gain_dn_per_e;
  double offset_dn2 = kept.has(Effect::quantisation) ? quantisation_dn2 : 0;
  if (kept.has(Effect::read_noise)) offset_dn2 += k * k * s.read_noise_e * s.read_noise_e;
  if (kept.has(Effect::row_noise)) offset_dn2 += k * k * s.row_noise_e * s.row_noise_e;
  NoiseProfile out;
  out.scale.fill(k / range);
  out.offset.fill(offset_dn2 / (range * range));
  return out;
}

RawFrame SyntheticSource::described(Plane<std::uint16_t> codes) const {
  const SensorModel& s = sensor_.model;
  const int masked = options_.masked_columns, width = codes.width() - masked, height = codes.height();
  RawFrame out;
  out.raw.dn = std::move(codes);
  out.raw.layout = SensorLayout::bayer;
  out.raw.phase = options_.phase;  // masked_columns is even
  out.raw.active = {masked, 0, width, height};
  out.raw.default_crop = {0, 0, width, height};
  if (masked > 0) {
    out.raw.masked = {{0, 0, masked, height}};
    out.raw.masked_is_stated = true;
  }
  const double scale = storage_.scale, offset = storage_.offset_dn;
  out.raw.black_tag = BlackLevel{1, 1, 1, {scale * (s.black_level_dn + offset)}, {}, {}};
  out.raw.white_dn.fill(std::min(65535.0, scale * (s.black_level_dn + range_dn(s) + offset)));
  FrameInfo& info = out.raw.info;
  info.make = "lowlux";
  info.model = s.name + (sensor_.gain_setting.empty() ? "" : " " + sensor_.gain_setting);
  info.exposure_s = options_.exposure.time_s;
  info.temperature_c = options_.exposure.temperature_c;
  info.f_number = options_.f_number;
  // The ISO speed at which the frame's exposure, f-number and saturation agree (isp/model/sensor/scene_luminance.h).
  const double saturation_cd_m2 = isp::saturation_luminance_cd_m2(s, response_, 1);
  info.iso = 78 * options_.f_number * options_.f_number / (0.65 * saturation_cd_m2);
  out.colour = colour_;
  out.noise = noise_profile();
  return out;
}

CameraRgb SyntheticSource::signal_e(Executor& executor) const {
  CameraRgb truth = charge_rate_rgb(scene_, response_, table_.get(), executor);
  const auto time = static_cast<float>(options_.exposure.time_s);
  for (Plane<float>& plane : truth.plane) {
    for (std::size_t i = 0; i < plane.size(); ++i) plane.data()[i] *= time;
  }
  return truth;
}

SceneLinear SyntheticSource::xyz_cd_m2() const {
  SceneLinear truth;
  for (int c = 0; c < 3; ++c) truth.plane[c] = scene_.xyz_cd_m2.plane[c].clone();
  add_points(scene_, truth);
  return truth;
}

EffectCost SyntheticSource::measure_cost() const {
  const std::optional<PhotonRows> photons = photon_rows();
  return capture::measure_cost(sensor_frame(0, photons ? &*photons : nullptr), file_plan_);
}

}  // namespace lowlux::capture
