#pragma once

#include <array>
#include <cstdint>
#include <initializer_list>
#include <span>
#include <string_view>
#include <vector>

#include "isp/base/matrix3.h"
#include "isp/base/sensor.h"
#include "isp/model/sensor/moved_light.h"
#include "isp/model/sensor/noise_budget.h"

namespace lowlux::isp {

/// Lists the switchable noise sources and nonlinearities between charge and code.
enum class Effect : std::uint8_t {
  photon_noise,     // the signal's Poisson fluctuation
  dark_current,     // its mean and its Poisson fluctuation
  read_noise,       // Gaussian
  quantisation,     // integer codes, by rounding or by floor
  clipping,         // full well and the converter's range
  prnu,             // pixels differ in sensitivity
  dsnu,             // pixels differ in dark current
  hot_pixels,       // a few pixels have much more dark current
  row_noise,        // an offset for each row and frame
  column_noise,     // an offset for each column
  telegraph_noise,  // a few pixels move between two levels
  amplifier_glow,   // additional charge around a point, and its Poisson fluctuation
  crosstalk,        // neighbours exchange a fraction of their light
  lens_blur,        // the lens spreads the light of a point
};
inline constexpr int effect_count = 14;

/// Returns "photon-noise", "dark-current"... in the order of Effect.
std::span<const std::string_view> effect_names();

/// Holds a set of noise sources.
class NoiseSourceSet {
 public:
  constexpr NoiseSourceSet() = default;
  constexpr NoiseSourceSet(std::initializer_list<Effect> effects) {
    for (const Effect effect : effects) *this = with(effect);
  }
  static constexpr NoiseSourceSet all() { return NoiseSourceSet((1u << effect_count) - 1); }

  constexpr bool has(Effect effect) const { return (bits_ >> static_cast<int>(effect)) & 1; }
  constexpr NoiseSourceSet with(Effect effect) const {
    return NoiseSourceSet(bits_ | (1u << static_cast<int>(effect)));
  }
  constexpr NoiseSourceSet without(Effect effect) const {
    return NoiseSourceSet(bits_ & ~(1u << static_cast<int>(effect)));
  }
  friend constexpr bool operator==(NoiseSourceSet, NoiseSourceSet) = default;

 private:
  explicit constexpr NoiseSourceSet(unsigned bits) : bits_(bits) {}
  unsigned bits_ = 0;
};

/// Limits what leaving effects out may change in a block of 32 x 32 pixels: the colour of its mean, as the frame would
/// be developed, and the variance of each of its channels, relative to itself.
struct Tolerance {
  double delta_e = 0.5;  // CIEDE2000
  double relative_variance = 0.05;
};
inline constexpr int effect_block = 32;

/// Changes of variance below this are ignored [DN^2]: a block of integer codes cannot show them.
inline constexpr double variance_floor_dn2 = 0.01;

/// Holds the signal that a block of the scene gives to the sensor, after the blur of the lens and crosstalk.
struct BlockLevel {
  Vector3 signal_e{};   // mean signal of its R, G and B pixels
  Vector3 darkest_e{};  // signal of its darkest R, G and B pixels: a star's block is dark around it
  double peak_e = 0;    // signal of its brightest pixel, with or without the effects that move light
  struct Glow {
    double mean_e = 0, min_e = 0, peak_e = 0;  // glow of its pixels
    double variance_e2 = 0;                    // variance of the means of its pixels: the glow falls off
  } glow;
  Contrast contrast;  // 0 where no effect moves light
  MovedLight by_lens_blur, by_crosstalk, by_both;

  /// Returns what the effects that move light, and are not kept, add.
  MovedLight left_out(NoiseSourceSet kept) const;
};

/// Describes how block means become colours, in which the tolerance is measured.
struct Developing {
  Matrix3 camera_to_xyz = identity3();  // (white_e) / white_e -> XYZ of D65 at Y = 1
  Vector3 white_e{1, 1, 1};             // charge of R, G, B that is developed to white
};

/// Returns how a frame of such blocks is developed: white is the brightest block's level, but no less than 50 times the
/// noise of a black frame, and no more than saturation (the rules of isp/render/exposure).
/// @param neutral camera RGB of a neutral, largest 1
Developing developing_of(const SensorModel& sensor, const Exposure& exposure, const Matrix3& camera_to_xyz,
                         const Vector3& neutral, std::span<const BlockLevel> blocks);

/// Holds the predicted change in a block if effects are left out: bounds at five standard deviations of normal
/// distributions.
struct PredictedChange {
  double delta_e = 0;
  double relative_variance = 0;
};

/// Predicts the change in a block if only the effects `kept` are simulated. Hot pixels and those with
/// telegraph noise are discrete events: a block may hold none, so they widen no other effect's tolerance, or several.
PredictedChange predict_change(const SensorModel& sensor, const Exposure& exposure, const Developing& developing,
                               const BlockLevel& block, NoiseSourceSet kept);

/// Holds the decision on one effect in one region, and the change if it alone were left out.
struct NoiseSourceDecision {
  Effect effect = Effect::photon_noise;
  enum class Reason : std::uint8_t {
    absent,      // the sensor has no such effect, or it is 0 at the exposure
    negligible,  // left out: together with all others left out it stays below the tolerance
    needed,      // above the tolerance, alone or together with what is left out already
    asked_for,   // kept or left out at the caller's request
    free,        // kept because leaving it out saves nothing
  } reason = Reason::needed;
  bool kept = true;
  PredictedChange alone;
};

/// Describes blocks of similar level that are planned together.
struct RegionPlan {
  double darkest_e = 0;  // lowest level of the blocks: that of the largest channel
  double brightest_e = 0;
  double glow_e = 0;  // largest mean glow of the blocks
  int blocks = 0;
  NoiseSourceSet kept = NoiseSourceSet::all();
  PredictedChange left_out_together;
  std::array<NoiseSourceDecision, effect_count> decisions{};
};

/// Holds the effects that each block of a frame gets.
struct NoiseSourcePlan {
  Tolerance tolerance;
  std::vector<RegionPlan> regions;
  std::vector<std::uint8_t> region_of_block;
};

/// Decides by the closed forms. Blocks whose levels or glow differ by decades are different regions; in each, effects
/// are left out smallest first as long as all that is left out together is predicted to stay below the tolerance.
/// @param blocks blocks of the frame, row by row; not empty
NoiseSourcePlan plan_noise_sources(const SensorModel& sensor, const Exposure& exposure, const Developing& developing,
                                   std::span<const BlockLevel> blocks, const Tolerance& tolerance);

/// Returns a plan with the effects that the caller requests and no others, including the predictions.
NoiseSourcePlan fixed_effects(const SensorModel& sensor, const Exposure& exposure, const Developing& developing,
                              std::span<const BlockLevel> blocks, NoiseSourceSet wanted);

}  // namespace lowlux::isp
