#include "isp/bench/scenes/patch_bound.h"

#include <cmath>
#include <limits>

#include "isp/model/colour/chroma_bound.h"

namespace lowlux::isp {
namespace {

constexpr double min_weight_snr = 5;
constexpr double cells = bound_patch_px * bound_patch_px / 4.0;

Matrix3 linear_to_xyz() { return rgb_to_xyz(primaries_rec709).value(); }  // of primaries that form a triangle

/// Returns the mean of each colour over the patch that begins at x, y.
Vector3 mean_of(const RgbView<const float>& linear, int x, int y) {
  Vector3 out{};
  for (std::size_t c = 0; c < 3; ++c) {
    const auto patch = linear[c].crop(x, y, bound_patch_px, bound_patch_px);
    for (int row = 0; row < patch.height; ++row) {
      for (int column = 0; column < patch.width; ++column) out[c] += static_cast<double>(patch.at(column, row));
    }
    out[c] /= bound_patch_px * bound_patch_px;
  }
  return out;
}

}  // namespace

PatchBound::PatchBound(const BenchPicture& picture, const DenoiseShot& shot) {
  const double dark_e = shot.light.dark_e;
  double sum = 0;
  for (int y = 0; y + bound_patch_px <= picture.linear.height(); y += bound_patch_px) {
    for (int x = 0; x + bound_patch_px <= picture.linear.width(); x += bound_patch_px) {
      FlatPatch patch{.signal_e = mean_of(picture.linear.view(), x, y),
                      .dark_e = {dark_e, dark_e, dark_e},
                      .noise_std_e = shot.light.read_noise_e,
                      .pixels = {cells, 2 * cells, cells}};
      for (std::size_t c = 0; c < 3; ++c) patch.signal_e[c] *= shot.white_e / bench_white_gain[c];
      const auto known = chroma_crb(linear_to_xyz() * diagonal3(bench_white_gain), patch);
      if (!known || known->weight_snr < min_weight_snr) continue;
      patches_.push_back({x, y, known->uv});
      sum += std::pow(rss_std(known->uv_covariance), 2);
    }
  }
  bound_uv_ = patches_.empty() ? std::numeric_limits<double>::quiet_NaN()
                               : std::sqrt(sum / static_cast<double>(patches_.size()));
}

double PatchBound::distance_uv(const SceneLinear& light) const {
  double sum = 0;
  for (const Patch& patch : patches_) {
    const Xyz colour = xyz_of(linear_to_xyz() * mean_of(light.view(), patch.x, patch.y));
    const double weight = colour.x + 15 * colour.y + 3 * colour.z;
    if (!(weight > 0)) return std::numeric_limits<double>::infinity();
    sum += std::pow(4 * colour.x / weight - patch.truth.u, 2) + std::pow(9 * colour.y / weight - patch.truth.v, 2);
  }
  return patches_.empty() ? std::numeric_limits<double>::quiet_NaN()
                          : std::sqrt(sum / static_cast<double>(patches_.size()));
}

}  // namespace lowlux::isp
