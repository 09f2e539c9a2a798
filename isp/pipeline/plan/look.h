#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "isp/base/frame.h"
#include "isp/base/matrix3.h"
#include "isp/base/result.h"
#include "isp/model/appearance/shin_table.h"
#include "isp/model/vision/detection.h"
#include "isp/model/vision/night_eye.h"
#include "isp/model/vision/retina.h"
#include "isp/model/vision/scene_light.h"
#include "isp/render/colour_table.h"
#include "isp/render/night/night_look.h"

namespace lowlux::isp {

/// States how the scene is to look: as a camera renders it in daylight, as an observer on site would perceive it, or as
/// one published model of appearance predicts it.
enum class Look : std::uint8_t { camera, eye, model };

/// Describes the look that is requested.
struct LookChoice {
  Look look = Look::camera;
  std::string model;                            // for Look::model: a name of appearance_models()
  std::shared_ptr<const ShinTable> shin;        // coefficients of the model shin; absent: the substitute
  std::optional<double> scene_luminance_cd_m2;  // mean over the image; absent: estimated from its exposure
  std::optional<double> profile_iso;            // ISO speed from the camera's profile, where the frame states none
  std::shared_ptr<const SceneLight> light;      // absent: S/P is estimated from the chromaticity of the white
  std::string camera;                           // usual name, from its profile; empty: that of the frame
  std::optional<Vector3> rod_weights;           // for white-balanced R, G, B under `light`, from the profile
  /// States the degree of chromatic adaptation, 0..1. Absent: that of degree_of_adaptation() where `light` is set, else
  /// 1, for the white balance of a camera is not known to be the chromaticity of the light.
  std::optional<double> adaptation_degree;
  /// Selects the effects: those that are visible, all, or those in `listed`.
  enum class Which : std::uint8_t { automatic, all, listed } which = Which::automatic;
  VisionEffects listed;
  double tolerance = 0.5;         // CIEDE2000: effects below it are left out by Which::automatic
  double dimming = 0.4;           // fraction of the darkness that the image keeps, 0..1; see apparent_dimming_ev
  double field_of_view_deg = 50;  // angle of the image's longer side
  bool seeing_map = false;        // the probability of seeing is requested for each cell, see map_seeing(); Look::eye
  /// States the CIE L* that noise may reach, see NoiseLimit; absent: no limit.
  std::optional<double> noise_limit;
};

/// Returns the name of the source of the coefficients of Shin's model.
inline std::string coefficients_of(const LookChoice& choice) {
  return choice.shin ? choice.shin->name : std::string(shin_substitute_name);
}

/// Holds the decision on one effect.
struct LookEffect {
  std::string_view name;
  double size = 0;  // predicted: largest CIEDE2000 of any displayable colour anywhere in the frame
  bool used = false;
};

/// Holds how the rods' luminance follows from the channels of a camera under a stated light.
struct RodWeights {
  std::string_view source;               // "profile", or the camera as known_camera() names it
  Vector3 weights{};                     // weights of white-balanced R, G and B, up to a factor
  std::optional<double> relative_error;  // rms over the reflectances they were fitted on; unknown of a profile
};

/// Holds the light that receptors get from the mean of a scene, and what is seen by it.
struct RetinaPlan {
  double pupil_mm = 0;                  // diameter
  ReceptorRates mean;                   // isomerisations by the mean of the scene in one receptor [s-1]
  SeeingModel seeing;                   // thresholds and false alarms
  std::optional<double> seen_fraction;  // fraction of the image, with more than 0.5; set once a map is rendered
};

/// States the mean of a scene as a fraction of white.
inline constexpr double scene_mean_of_white = 0.18;

/// Holds what was decided about the look.
struct LookPlan {
  Look kind = Look::camera;  // with Look::camera only noise is bounded
  NightLook look;
  std::optional<ColourTable> table;  // table of a model of appearance, on light relative to white_cd_m2
  double white_cd_m2 = 0;            // luminance of a white in the scene, whose mean counts as mid-grey
  double mean_cd_m2 = 0;
  std::string_view luminance_rule;  // "given", "exposure", or "profile" where the ISO speed is from there
  MesopicState state;               // state of an eye adapted to the mean
  double dimming_ev = 0;
  std::string_view light_rule;       // source of S/P: "spectrum", "given", or "white" where it is estimated from its xy
  std::optional<RodWeights> rods;    // absent: the weights of XYZ
  double adaptation_degree = 1;      // D of incomplete_adaptation()
  Matrix3 adaptation = identity3();  // adaptation of completely adapted values in the output's primaries
  std::optional<std::array<LookEffect, 6>> effects;  // set for Look::eye
  std::optional<RetinaPlan> retina;  // set where visual noise is shown or the map of seeing is requested
  std::optional<double> noise_limit;
  std::optional<NoiseProfile> noise;  // noise of the raw frame; absent: not known
};

/// Lists the names of the effects: "purkinje", "chroma", "hue", "acuity", "glare", "visual-noise", in this order.
inline constexpr std::array<std::string_view, 6> night_effect_names{"purkinje", "chroma", "hue",
                                                                    "acuity",   "glare",  "visual-noise"};
/// Returns the switch of an effect by its name; null for another name.
bool* effect_named(VisionEffects& effects, std::string_view name);

/// Predicts the size of each effect for an eye in a given state: the largest CIEDE2000 that it makes alone, or that its
/// absence makes of all three effects on colours together, over the primaries, secondaries and the white of Rec. 709;
/// for acuity, that of a grating of black and white at a quarter of the pixels' frequency. Glare and visual noise are a
/// matter of preference: their size is not a number.
std::array<LookEffect, 6> predict_effects(const NightEye& eye, double scotopic_ratio_of_white,
                                          double pixels_per_degree);

}  // namespace lowlux::isp
