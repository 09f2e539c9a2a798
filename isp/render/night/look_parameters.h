#pragma once

#include <array>
#include <cstdint>

namespace lowlux::isp {

/// Selects the effects of darkness on vision that are applied, each of which can be left out.
struct VisionEffects {
  bool purkinje = true;       // reds darken and blues brighten, as rods take over
  bool chroma = true;         // colours fade
  bool hue = true;            // remaining colour moves towards blue
  bool acuity = true;         // detail softens
  bool glare = false;         // light of lamps scatters in the eye
  bool visual_noise = false;  // photons and dark light are counted in receptors
};

/// Parameters of a look, decided for one frame: the scene as perceived by an eye that is adapted to it.
struct NightLook {
  VisionEffects effects;
  double cd_m2_per_unit = 100;            // luminance in the scene of Y = 1 of the pixels
  double scotopic_ratio_of_white = 2.46;  // S/P of the white of the pixels
  double pixels_per_degree = 60;          // resolution of the image
  double scene_cd_m2 = 100;               // mean luminance of the scene, which sets the pupil
  std::array<float, 3> luminance{};       // weights in the pixels' primaries, as in LookGrid
  std::array<float, 3> rods{};
  std::array<float, 3> tint{};
  float dark = 1e-6f;      // as in LookGrid: approximately the noise of a pixel
  std::uint64_t seed = 1;  // seed of visual_noise
};

/// Fields of adaptation count as having at least this S/P: below 0.265 CIE 191 has several solutions and jumps between
/// them.
inline constexpr double min_field_ratio = 0.27;

}  // namespace lowlux::isp
