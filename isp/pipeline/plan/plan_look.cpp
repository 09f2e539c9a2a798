#include "isp/pipeline/plan/plan_look.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <span>

#include <fmt/format.h>

#include "isp/base/camera_profile.h"
#include "isp/model/appearance/appearance_model.h"
#include "isp/model/appearance/entropy_model.h"
#include "isp/model/sensor/scene_luminance.h"
#include "isp/model/spectrum/spectral_data.h"
#include "isp/model/vision/mesopic.h"
#include "isp/model/vision/night_eye.h"
#include "isp/model/vision/scene_light.h"
#include "isp/model/vision/scotopic_fit.h"
#include "isp/render/output_space.h"

namespace lowlux::isp {
namespace {

Vector3 row_times(const Vector3& row, const Matrix3& m) {
  Vector3 out{};
  for (int j = 0; j < 3; ++j) out[j] = row[0] * m[0][j] + row[1] * m[1][j] + row[2] * m[2][j];
  return out;
}

// Returns the weights of a profile, or those fitted on the channels of the camera; nullopt where neither is known, the
// spectrum of the light is unknown, or the light leaves too little to fit on.
std::optional<RodWeights> weights_of_rods(const FrameInfo& info, const LookChoice& choice) {
  if (!choice.light || !choice.light->spectrum) return std::nullopt;
  if (choice.rod_weights) return RodWeights{"profile", *choice.rod_weights, {}};
  const auto camera = known_camera(choice.camera.empty() ? camera_name(info.make, info.model) : choice.camera);
  if (!camera) return std::nullopt;
  const auto fit = fit_scotopic(*camera_sensitivity(*camera), *choice.light->spectrum, pigment_reflectances());
  if (!fit) return std::nullopt;
  return RodWeights{*camera, fit->weights, fit->relative_error};
}

double ratio_of_white(const std::optional<WhitePoint>& white) {
  const std::optional<Xyz> colour = xyz_of(white ? white->xy : output_white);
  return std::clamp(colour ? scotopic_luminance(*colour) : 0.0, min_scotopic_ratio, max_scotopic_ratio);
}

// Decides S/P of the white, stated or estimated from its chromaticity, and what the rods' luminance follows from.
void decide_light(const RawFrame& frame, const FrameLight& light, const LookChoice& choice, LookPlan& plan) {
  plan.light_rule = !choice.light ? "white" : choice.light->spectrum ? "spectrum" : "given";
  plan.look.scotopic_ratio_of_white = choice.light ? choice.light->scotopic_ratio : ratio_of_white(light.white);
  if (light.white) plan.rods = weights_of_rods(frame.raw.info, choice);
}

// Decides the degree of chromatic adaptation, and the matrix for it; needs plan.mean_cd_m2. The colours of a
// monochrome frame are unknown: nothing is changed. Error: invalid_argument where CAT02 has no such adaptation.
Result<void> decide_adaptation(const FrameLight& light, const DevelopOptions& options, LookPlan& plan) {
  const LookChoice& choice = options.look;
  if (!light.white) return {};
  plan.adaptation_degree =
      choice.adaptation_degree.value_or(choice.light ? degree_of_adaptation(plan.mean_cd_m2) : 1.0);
  if (plan.adaptation_degree == 1) return {};
  const Xy scene = choice.light && choice.light->white ? *choice.light->white : light.white->xy;
  const auto adaptation = incomplete_adaptation(scene, output_white, plan.adaptation_degree);
  if (!adaptation) {
    return fail(ErrorCode::invalid_argument, fmt::format("CAT02 does not support an adaptation degree of {:.3g} for a "
                                                         "light of this saturation: use --adaptation-degree 1",
                                                         plan.adaptation_degree));
  }
  const Matrix3 from_xyz = *xyz_to_output(options.space);
  plan.adaptation = from_xyz * *adaptation * *inverse(from_xyz);
  return {};
}

// Sets the weights of luminance, of scotopic luminance relative to white, and the rods' tint, in the primaries of the
// pixels. @param balanced  result of balanced_to_output()
void set_primaries(OutputSpace space, const Matrix3& balanced, LookPlan& plan) {
  const Matrix3 from_xyz = *xyz_to_output(space), to_xyz = *inverse(from_xyz);
  const Vector3 luminance = *luminance_weights(space);
  const Vector3 tint = from_xyz * (*rgb_to_xyz(primaries_rec709) * rod_tint);
  const std::optional<Matrix3> to_camera = inverse(balanced);
  const Vector3 adapted =
      plan.rods && to_camera ? row_times(plan.rods->weights, *to_camera) : row_times(scotopic_weights, to_xyz);
  const double white = adapted[0] + adapted[1] + adapted[2];
  const Vector3 rods = row_times(adapted, *inverse(plan.adaptation));
  for (int j = 0; j < 3; ++j) {
    plan.look.luminance[j] = static_cast<float>(luminance[j]);
    plan.look.rods[j] = static_cast<float>(rods[j] / white);
    plan.look.tint[j] = static_cast<float>(tint[j]);
  }
}

constexpr double min_mean = 1e-6;   // of the white level: darker frames count as this
constexpr double max_cd_m2 = 1e9;   // the sun
constexpr double min_cd_m2 = 1e-7;  // below a starless night
constexpr double min_dark = 1e-5;   // of LookGrid, in the pixels' unit

Result<void> check(const LookChoice& o, OutputSpace space) {
  const auto wrong = [](const std::string& message) { return fail(ErrorCode::invalid_argument, message); };
  if ((o.look != Look::camera || o.noise_limit) && (space == OutputSpace::camera || space == OutputSpace::xyz)) {
    return wrong("--look and --noise-limit require an RGB space: srgb, p3, rec2020, linear-srgb or linear-rec2020");
  }
  if (o.scene_luminance_cd_m2 && !(*o.scene_luminance_cd_m2 >= min_cd_m2 && *o.scene_luminance_cd_m2 <= max_cd_m2)) {
    return wrong(fmt::format("the luminance of a scene must be between {} and {} cd/m2, found {}", min_cd_m2, max_cd_m2,
                             *o.scene_luminance_cd_m2));
  }
  if (!(o.dimming >= 0 && o.dimming <= 1))
    return wrong("the fraction of darkness that is kept must be between 0 and 1");
  if (!(o.field_of_view_deg >= 0.1 && o.field_of_view_deg <= 180))
    return wrong("the field of view must be 0.1 to 180 degrees");
  if (!(o.tolerance > 0 && o.tolerance <= 100)) return wrong("a tolerance must be above 0 and at most 100");
  if (o.adaptation_degree && !(*o.adaptation_degree >= 0 && *o.adaptation_degree <= 1))
    return wrong("a degree of adaptation must be between 0 and 1");
  if (o.noise_limit && !(*o.noise_limit > 0 && *o.noise_limit <= 100)) {
    return wrong("the noise limit must be a CIE lightness above 0 and at most 100");
  }
  return {};
}

double mean_of(std::span<const float> values) {
  double sum = 0;
  for (const float v : values) sum += std::isfinite(v) ? v : 0;
  return values.empty() ? 0 : sum / static_cast<double>(values.size());
}

// Returns the luminance of the white level [cd/m2]: from the exposure, or such that the mean is as given.
Result<double> white_level_cd_m2(const RawFrame& frame, const FrameLight& light, LookPlan& look,
                                 const LookChoice& choice) {
  const double mean = std::max(mean_of(light.block_luminance), min_mean);
  if (choice.scene_luminance_cd_m2) {
    look.luminance_rule = "given";
    look.mean_cd_m2 = *choice.scene_luminance_cd_m2;
    return look.mean_cd_m2 / mean;
  }
  FrameInfo info = frame.raw.info;
  const bool by_profile = !info.iso && choice.profile_iso;
  if (by_profile) info.iso = choice.profile_iso;
  const std::optional<double> saturation = saturation_luminance_cd_m2(info);
  if (!saturation) {
    return fail(ErrorCode::insufficient,
                "the luminance of the scene is unknown, because exposure time, f-number or ISO is not stated; give its "
                "mean in cd/m2 (--scene-luminance), or to a stage the illuminance in lux");
  }
  look.luminance_rule = by_profile ? "profile" : "exposure";
  const double white_cd_m2 = light.light_range * *saturation;
  look.mean_cd_m2 = mean * white_cd_m2;
  return white_cd_m2;
}

// Returns the light of an even field, as the eye adapts to it.
LuminancePair field_of(double luminance_cd_m2, const NightLook& look) {
  return {luminance_cd_m2, luminance_cd_m2 * std::max(look.scotopic_ratio_of_white, min_field_ratio)};
}

// Returns the darkest and the brightest luminance that an eye adapts to, from blocks of the frame [cd/m2].
std::array<double, 2> range_of_fields(std::span<const float> blocks, double white_cd_m2, const LookPlan& look) {
  float darkest = INFINITY, brightest = 0;
  for (const float v : blocks) {
    if (!std::isfinite(v)) continue;
    darkest = std::min(darkest, std::max(v, 0.0f));
    brightest = std::max(brightest, v);
  }
  const auto field = [&](double own_cd_m2) {
    return (1 - adaptation_fraction_of_mean) * own_cd_m2 + adaptation_fraction_of_mean * look.mean_cd_m2;
  };
  return {field(std::isfinite(darkest) ? darkest * white_cd_m2 : 0), field(brightest * white_cd_m2)};
}

// Returns the largest sizes anywhere in the frame: the tint of rods is strongest in between, not where it is darkest.
std::array<LookEffect, 6> largest_effects(const std::array<double, 2>& fields_cd_m2, const NightLook& look) {
  constexpr int steps = 12;
  std::array<LookEffect, 6> out{};
  const double least = std::max(fields_cd_m2[0], min_cd_m2), most = std::max(fields_cd_m2[1], least);
  for (int i = 0; i <= steps; ++i) {
    const double field = least * std::pow(most / least, static_cast<double>(i) / steps);
    const auto here =
        predict_effects(night_eye(field_of(field, look)), look.scotopic_ratio_of_white, look.pixels_per_degree);
    for (std::size_t k = 0; k < out.size(); ++k) {
      if (i == 0 || here[k].size > out[k].size) out[k] = here[k];
    }
  }
  return out;
}

// Leaves out effects, the smallest first, as long as the sum of all that are left out stays below the tolerance.
// Effects that are a matter of preference have no size, and are left out.
void leave_out(double tolerance, std::span<LookEffect> effects) {
  std::array<LookEffect*, night_effect_names.size()> order{};
  std::size_t count = 0;
  for (LookEffect& effect : effects) {
    effect.used = std::isfinite(effect.size);
    if (effect.used) order[count++] = &effect;
  }
  const std::span sized(order.data(), count);
  std::ranges::sort(sized, {}, [](const LookEffect* effect) { return effect->size; });
  double together = 0;
  for (LookEffect* const effect : sized) {
    together += effect->size;
    if (together > tolerance) break;
    effect->used = false;
  }
}

void choose_steps(const LookChoice& choice, const std::array<double, 2>& fields_cd_m2, bool monochrome,
                  LookPlan& look) {
  const auto predicted = largest_effects(fields_cd_m2, look.look);
  std::array<LookEffect, 6>& effects = look.effects.emplace(predicted);
  if (monochrome) {
    for (int k = 0; k < 3; ++k) effects[static_cast<std::size_t>(k)].size = 0;  // the effects on colours
  }
  switch (choice.which) {
    case LookChoice::Which::automatic:
      leave_out(choice.tolerance, effects);
      break;
    case LookChoice::Which::all:
      for (LookEffect& effect : effects) effect.used = true;
      break;
    case LookChoice::Which::listed: {
      VisionEffects listed = choice.listed;
      for (LookEffect& effect : effects) effect.used = *effect_named(listed, effect.name);
      break;
    }
  }
  for (const LookEffect& effect : effects) *effect_named(look.look.effects, effect.name) = effect.used;
}

// Computes what receptors get from the mean of the scene.
RetinaPlan retina_of(const LookPlan& look) {
  RetinaPlan out{.pupil_mm = adapted_pupil_mm(look.mean_cd_m2)};
  const double pupil_mm2 = pupil_area_mm2(out.pupil_mm);
  out.mean = receptor_rates(field_of(look.mean_cd_m2, look.look), pupil_mm2);
  out.seeing = *seeing_model(pupil_mm2);
  return out;
}

// Decides the state of the eye, the effects it requires, and how much darker the image gets.
void decide_eye(const FrameLight& light, double white_cd_m2, const DevelopOptions& options, LookPlan& look) {
  const LookChoice& choice = options.look;
  look.state = mesopic_state(field_of(look.mean_cd_m2, look.look));
  look.white_cd_m2 = look.mean_cd_m2 / scene_mean_of_white;
  if (choice.look == Look::eye) {
    choose_steps(choice, range_of_fields(light.block_luminance, white_cd_m2, look), !light.white, look);
    look.look.scene_cd_m2 = look.mean_cd_m2;
    if (choice.seeing_map || look.look.effects.visual_noise) look.retina = retina_of(look);
  }
  if (!options.exposure_ev) look.dimming_ev = choice.dimming * apparent_dimming_ev(look.state.luminance_cd_m2);
}

// Returns ColourNoise::covariance for a mid-grey pixel.
Matrix3 covariance_of_xyz(const NoiseProfile& noise, const ModelBasis& basis, const Matrix3& rgb_to_xyz) {
  ChannelNoise channels;
  Matrix3 balanced_to_rgb{};
  for (int c = 0; c < 3; ++c) {
    const double gain = basis.white_gain[c];
    channels.variance_e2[c] =
        noise.scale[c] * scene_mean_of_white / std::exp2(basis.exposure_ev) / gain + noise.offset[c];
    channels.rgb_per_e[c] = gain;
    for (int j = 0; j < 3; ++j) balanced_to_rgb[j][c] = basis.transform.matrix[3 * j + c];
  }
  channels.camera_to_xyz = rgb_to_xyz * balanced_to_rgb;
  return noise_covariance_of_xyz(channels);
}

// Returns the table of a model: over ratios of noise to signal where the model weighs noise, and the noise is known.
Result<ColourTable> table_of(const AppearanceModel& model, ViewingConditions scene,
                             const std::optional<Matrix3>& covariance, const ColourTableRequest& request) {
  if (model.uses_noise && covariance) {
    return make_noise_colour_table(
        [&](double noise_to_signal) {
          scene.noise = ColourNoise{.covariance = *covariance, .to_signal = noise_to_signal};
          return model.at(scene);
        },
        request);
  }
  const Result<ColourMap> map = model.at(scene);
  if (!map) return tl::make_unexpected(map.error());
  return make_colour_table(*map, request);
}

}  // namespace

Result<std::optional<LookPlan>> plan_look(const RawFrame& frame, const FrameLight& light,
                                          const DevelopOptions& options) {
  const LookChoice& choice = options.look;
  if (auto checked = check(choice, options.space); !checked) return tl::make_unexpected(checked.error());
  if (choice.look == Look::camera && !choice.noise_limit) return std::nullopt;
  LookPlan look{.kind = choice.look, .noise_limit = choice.noise_limit, .noise = frame.noise};
  NightLook& eye = look.look;
  eye.effects = {false, false, false, false, false, false};
  decide_light(frame, light, choice, look);
  const PictureSize size = picture_size(frame.raw, options);
  eye.pixels_per_degree = std::max(size.width, size.height) / choice.field_of_view_deg;
  double white_cd_m2 = 100;
  if (choice.look != Look::camera) {
    const Result<double> found = white_level_cd_m2(frame, light, look, choice);
    if (!found) return tl::make_unexpected(found.error());
    white_cd_m2 = *found;
    decide_eye(light, white_cd_m2, options, look);
    if (auto adapted = decide_adaptation(light, options, look); !adapted) return tl::make_unexpected(adapted.error());
  }
  const double exposure_ev = light.exposure_ev + look.dimming_ev;
  const double units = std::exp2(exposure_ev) / tone_limit(options.tone, exposure_ev + light.headroom_ev);
  eye.cd_m2_per_unit = white_cd_m2 / units;
  eye.dark = static_cast<float>(std::clamp(light.black_noise_std * units, min_dark, 1.0));
  set_primaries(options.space, light.balanced, look);
  return look;
}

Result<ModelTable> tabulate_model(const LookPlan& look, const ModelBasis& basis, const DevelopOptions& options) {
  const Result<AppearanceModel> model = appearance_model_named(options.look.model);
  if (!model) return tl::make_unexpected(model.error());
  const Matrix3 rgb_to_xyz = *inverse(*xyz_to_output(options.space));
  ViewingConditions scene{.white_cd_m2 = look.white_cd_m2};
  scene.adaptation_cd_m2 = look.mean_cd_m2;
  scene.shin = options.look.shin.get();
  scene.scotopic_ratio = look.look.scotopic_ratio_of_white;
  if (basis.white) scene.colour_temperature_k = basis.white->cct_k;
  const double limit = std::clamp(look.look.cd_m2_per_unit / look.white_cd_m2, 1e-6, 1e6);
  std::optional<Matrix3> covariance;
  if (look.noise && basis.white) covariance = covariance_of_xyz(*look.noise, basis, rgb_to_xyz);
  Result<ColourTable> table = table_of(*model, scene, covariance, {.rgb_to_xyz = rgb_to_xyz, .limit = limit});
  if (!table) return tl::make_unexpected(table.error());
  ModelTable out{*std::move(table), {}};
  if (!(look.white_cd_m2 >= model->valid_from_cd_m2 && look.white_cd_m2 <= model->valid_to_cd_m2)) {
    out.warnings.push_back(fmt::format(
        "the model {} is valid for a white of {:g} to {:g} cd/m2, and the white of this scene has {:.3g} cd/m2",
        model->name, model->valid_from_cd_m2, model->valid_to_cd_m2, look.white_cd_m2));
  }
  if (!out.table.within_bound) {
    out.warnings.push_back(fmt::format("the table of the model {} has an error of up to {:.2g} CIEDE2000", model->name,
                                       out.table.error.largest));
  }
  return out;
}

}  // namespace lowlux::isp
