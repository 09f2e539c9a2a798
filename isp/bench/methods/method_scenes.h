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
  std::vector<StarPlace> stars;  // of a field of stars; else none
};

struct SceneSize {
  int width = 0;
  int height = 0;
};

/// Returns dead leaves (Lee, Mumford & Huang 2001; the texture of ISO 19567-2): discs of random colours that cover one
/// another, radii r distributed as r^-3 from 2 px to a quarter of the height, blurred by the lens. A pure function of
/// size and seed.
MethodScene leaves_scene(const SceneSize& size, std::uint64_t seed);

/// Returns a field of stars over a dark sky that brightens towards the bottom: one star on 600 pixels, the density of
/// luminances falls as their power -1.5, colours from orange to blue, spread by the lens. A pure function of size and
/// seed.
MethodScene stars_scene(const SceneSize& size, std::uint64_t seed);

/// Returns the scenes of a seed: parts of the pictures at places that the seed draws, then leaves and stars.
/// @param size  even sides; limited to those of a picture
/// Errors: those of read_bench_pictures.
Result<std::vector<MethodScene>> method_scenes(const std::string& folder, std::span<const std::string_view> pictures,
                                               const SceneSize& size, std::uint64_t seed, Executor& executor);

}  // namespace lowlux::isp
