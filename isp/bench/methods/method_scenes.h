#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "isp/base/executor.h"
#include "isp/base/result.h"
#include "isp/reproduce/bench_picture.h"

namespace lowlux::isp {

/// Centre of a star [px]; integers are centres of pixels.
struct StarPlace {
  double x_px = 0;
  double y_px = 0;
};

/// A scene that methods are scored on.
struct MethodScene {
  BenchPicture picture;
  std::vector<StarPlace> stars;  // stars of a field of stars; empty for other scenes
};

/// Holds the size of a scene in pixels.
struct SceneSize {
  int width = 0;
  int height = 0;
};

/// Parameters of dead leaves.
struct Leaves {
  double min_radius_px = 2;
  double max_radius_px = 0;  // 0: a quarter of the height
  double pixels_per_leaf = 12;
  double chroma = 0.5;  // each channel loses up to this fraction of its light
  /// Weight s of what the channels share in the logarithm of their light, 0..1: with `chroma` 0 the correlation of the
  /// logarithms is s^2 / (s^2 + (1 - s)^2).
  double shared = 1;
  double lens_px = bench_lens_px;
};

/// Returns dead leaves (Lee, Mumford & Huang 2001; the texture of ISO 19567-2): discs of random colours that cover one
/// another, radii r distributed as r^-3, blurred by the lens. A pure function of its arguments.
MethodScene leaves_scene(const SceneSize& size, std::uint64_t seed, const Leaves& how = {});

/// Distribution of the flux of stars.
enum class StarLaw : std::uint8_t { power, log_uniform };

/// Parameters of a field of stars. Their peaks are above `faintest`, and up to `brightest` in units of white.
struct StarField {
  StarLaw law = StarLaw::power;  // power: the density of peaks falls as their power -1.5
  double faintest = 0.04;
  double brightest = 0.9;
  double min_lens_px = bench_lens_px;  // the spread of each star is drawn between these
  double max_lens_px = bench_lens_px;
  float limit = 1;  // light of a pixel
};

/// Returns a field of stars over a dark sky that brightens towards the bottom: one star on 600 pixels, colours from
/// orange to blue, spread by the lens. A pure function of its arguments.
MethodScene stars_scene(const SceneSize& size, std::uint64_t seed, const StarField& field = {});

/// Returns the scenes of a seed: parts of the pictures at places that the seed draws, then leaves and stars.
/// @param size  even sides; limited to those of a picture
/// Errors: those of read_bench_pictures.
Result<std::vector<MethodScene>> method_scenes(const std::string& folder, std::span<const std::string_view> pictures,
                                               const SceneSize& size, std::uint64_t seed, Executor& executor);

}  // namespace lowlux::isp
