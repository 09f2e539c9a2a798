#pragma once

#include <optional>
#include <vector>

#include "isp/base/image.h"
#include "isp/bench/scenes/denoise_scene.h"
#include "isp/model/colour/colorimetry.h"

namespace lowlux::isp {

/// Side of the patches [px].
inline constexpr int bound_patch_px = 32;

/// How well the chromaticities of a shot's patches can be known from the patches alone, and how well a picture shows
/// them: root mean squares of distances in u'v'. Patches count whose W = X + 15 Y + 3 Z can be known to a fifth, since
/// the chromaticity of darker ones has no variance. A method that makes use of a patch's surroundings, or that is not
/// unbiased, may pass the bound.
class PatchBound {
 public:
  PatchBound(const BenchPicture& picture, const DenoiseShot& shot);

  /// The Cramer-Rao bound (isp/model/colour/chroma_bound.h) of patches that are evenly lit; not a number where no patch
  /// counts.
  double bound_uv() const { return bound_uv_; }

  /// The distance of a picture's patches from the truth; infinite if the light of one is not positive.
  /// @param light  linear Rec. 709, signed, as large as the shot
  double distance_uv(const SceneLinear& light) const;

 private:
  struct Patch {
    int x, y;  // position of its first pixel
    UvPrime truth;
  };
  std::vector<Patch> patches_;
  double bound_uv_;
};

}  // namespace lowlux::isp
