#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "isp/base/frame.h"
#include "isp/base/result.h"
#include "isp/model/appearance/shin_table.h"
#include "isp/model/vision/night_eye.h"
#include "isp/render/colour_table.h"
#include "isp/render/night/night_look.h"

namespace lowlux::isp {

/// How the scene is to look: as a camera in daylight has it, as an eye saw it that stood there, or as one published
/// model of appearance has it.
enum class Look : std::uint8_t { camera, eye, model };

/// What is asked for.
struct LookChoice {
  Look look = Look::camera;
  std::string model;                            // for Look::model: a name of appearance_models()
  std::shared_ptr<const ShinTable> shin;        // of the model shin; absent: the substitute
  std::optional<double> scene_luminance_cd_m2;  // mean over the picture; absent: from how it was exposed
  std::optional<double> profile_iso;            // ISO speed by the camera's profile, where the frame tells none
  /// Which effects: those that are seen, all, or these.
  enum class Which : std::uint8_t { automatic, all, listed } which = Which::automatic;
  NightEffects listed;
  double tolerance = 0.5;         // CIEDE2000: effects below it are left out by Which::automatic
  double dimming = 0.4;           // share of the darkness that the picture keeps, 0..1; see apparent_dimming_ev
  double field_of_view_deg = 50;  // of the picture's longer side
  /// CIE L* that noise may reach, see NoiseLimit; absent: no limit.
  std::optional<double> noise_limit;
};

/// Where the coefficients of Shin's model come from.
inline std::string coefficients_of(const LookChoice& choice) {
  return choice.shin ? choice.shin->name : std::string(shin_substitute_name);
}

/// One effect's part in a decision.
struct LookEffect {
  std::string_view name;
  double size = 0;  // predicted: largest CIEDE2000 of any displayable colour anywhere in the frame
  bool used = false;
};

/// Share of white that the mean of a scene has.
inline constexpr double scene_mean_of_white = 0.18;

/// What was decided.
struct LookPlan {
  Look kind = Look::camera;  // then only noise is bounded
  NightLook look;
  std::optional<ColourTable> table;  // of a model, on light relative to white_cd_m2
  double white_cd_m2 = 0;            // of a white in the scene, whose mean is taken for mid-grey
  double mean_cd_m2 = 0;
  std::string_view luminance_rule;  // "given", "exposure", or "profile" for its ISO speed
  MesopicState state;               // of an eye adapted to the mean
  double dimming_ev = 0;
  std::optional<std::array<LookEffect, 6>> effects;  // of Look::eye
  std::optional<double> noise_limit;
  std::optional<NoiseProfile> noise;  // of the raw; absent: not known
};

/// "purkinje", "chroma", "hue", "acuity", "glare", "visual-noise", in this order.
inline constexpr std::array<std::string_view, 6> night_effect_names{"purkinje", "chroma", "hue",
                                                                    "acuity",   "glare",  "visual-noise"};
/// The switch of an effect by its name; null for another name.
bool* effect_named(NightEffects& effects, std::string_view name);

/// Size of each effect for an eye in a state: the largest CIEDE2000 that it alone makes, or that its absence makes of
/// all three on colours together, over the primaries, secondaries and the white of Rec. 709; for acuity, of a grating
/// of black and white at a quarter of the pixels' frequency. Glare and visual noise are a matter of taste: not a
/// number.
std::array<LookEffect, 6> predict_effects(const NightEye& eye, double scotopic_ratio_of_white,
                                          double pixels_per_degree);

}  // namespace lowlux::isp
