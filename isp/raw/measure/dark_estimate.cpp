#include "isp/raw/measure/dark_estimate.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <span>
#include <vector>

namespace lowlux::isp {
namespace {

constexpr int max_side = 48;  // blocks are joined until no side has more: their noise is then small
constexpr std::size_t min_blocks = 64;
constexpr double darkest_fraction = 0.02, unsaturated = 0.9;
constexpr double max_clipped = 0.05;  // of a block's difference from the darkest, by saturated pixels
constexpr double min_contrast = 5;    // of brighter over darkest blocks, in standard deviations of a block's noise
constexpr double std_tint = 0.17, std_temperature = 0.4, std_between_channels = 0.05;
constexpr Vector3 fraction_of_pixels{0.25, 0.5, 0.25};
constexpr Vector3 tint{0.408248290463863, -0.816496580927726, 0.408248290463863};  // (1, -2, 1) / sqrt(6)
constexpr Vector3 temperature{0.707106781186548, 0, -0.707106781186548};           // (1, 0, -1) / sqrt(2)

struct Block {
  Vector3 charge_e{};
  double clipped = 0;  // fraction of its samples
};

/// Holds joined blocks in ascending order of their charge.
struct Blocks {
  std::vector<Block> block;
  double pixels = 1;  // in a block
};

Blocks joined_blocks(const DarkEvidence& e) {
  const int width = e.mean.width(), height = e.mean.height();
  const int side = std::max(1, (std::max(width, height) + max_side - 1) / max_side);
  Blocks out{{}, e.pixels * side * side};
  for (int top = 0; top + side <= height; top += side) {
    for (int left = 0; left + side <= width; left += side) {
      const auto mean_of_plane = [&](const Plane<float>& plane) {
        double sum = 0;
        for (int i = 0; i < side * side; ++i) sum += static_cast<double>(plane.at(left + i % side, top + i / side));
        return sum / (side * side);
      };
      Block& joined = out.block.emplace_back();
      for (std::size_t c = 0; c < 3; ++c) {
        joined.charge_e[c] = mean_of_plane(e.mean.plane[c]) * e.electrons_at_white[c];
      }
      if (e.clipped != nullptr) joined.clipped = mean_of_plane(*e.clipped);
    }
  }
  std::ranges::sort(out.block, {}, [](const Block& block) { return dot(fraction_of_pixels, block.charge_e); });
  return out;
}

/// Returns the variance of a block's mean.
Vector3 block_variance(const DarkEvidence& e, const Blocks& blocks, const Vector3& charge_e) {
  Vector3 out{};
  for (std::size_t c = 0; c < 3; ++c) {
    out[c] = (std::max(charge_e[c], 0.0) + e.variance_e2[c]) / (fraction_of_pixels[c] * blocks.pixels);
  }
  return out;
}

Block mean_of(std::span<const Block> blocks) {
  Block out;
  const auto n = static_cast<double>(blocks.size());
  for (const Block& block : blocks) {
    for (std::size_t c = 0; c < 3; ++c) out.charge_e[c] += block.charge_e[c] / n;
    out.clipped += block.clipped / n;
  }
  return out;
}

/// Returns whether saturation changes the colour of a block's difference from the darkest blocks.
bool is_saturated(const DarkEvidence& e, const Block& block, const Block& darkest) {
  double difference = 0;  // in fractions of white
  for (std::size_t c = 0; c < 3; ++c) {
    if (block.charge_e[c] > unsaturated * e.electrons_at_white[c]) return true;
    difference += fraction_of_pixels[c] * (block.charge_e[c] - darkest.charge_e[c]) / e.electrons_at_white[c];
  }
  return block.clipped - darkest.clipped > max_clipped * difference;
}

/// Returns the colour of the light, relative to green, from the differences that it makes between blocks.
std::optional<Vector3> colour_of_contrast(const DarkEvidence& e, const Blocks& blocks, const Block& darkest) {
  std::vector<Block> brighter(blocks.block.begin() + static_cast<std::ptrdiff_t>(blocks.block.size() / 2),
                              blocks.block.end());
  std::erase_if(brighter, [&](const Block& block) { return is_saturated(e, block, darkest); });
  if (brighter.empty()) return std::nullopt;
  const Block bright = mean_of(brighter);
  const Vector3 variance = block_variance(e, blocks, darkest.charge_e);
  Vector3 out{};
  for (std::size_t c = 0; c < 3; ++c) {
    out[c] = bright.charge_e[c] - darkest.charge_e[c];
    if (!(out[c] > min_contrast * std::sqrt(variance[c]))) return std::nullopt;
  }
  for (const std::size_t c : {0, 2}) out[c] /= out[1];
  out[1] = 1;
  return out;
}

/// Returns the geometric mean of two colours, relative to green.
Vector3 mean_colour(const Vector3& a, const Vector3& b) {
  Vector3 out{};
  for (std::size_t c = 0; c < 3; ++c) out[c] = std::sqrt(a[c] * b[c] / (a[1] * b[1]));
  return out;
}

/// Holds m = d (1, 1, 1) + L n, solved for d and L.
struct Fit {
  double dark_e = 0;
  double light_e = 0;
  double dark_variance_e2 = 0;
  Vector3 weighted_residual{};  // inverse covariance times residual
  double misfit = 0;
};

Matrix3 covariance(const Vector3& noise, const Vector3& neutral, double dark_e, double light_e) {
  Matrix3 out{};
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t j = 0; j < 3; ++j) {
      const double colour =
          std_tint * std_tint * tint[i] * tint[j] + std_temperature * std_temperature * temperature[i] * temperature[j];
      out[i][j] = light_e * light_e * neutral[i] * neutral[j] * colour;
    }
    out[i][i] += noise[i] + std_between_channels * std_between_channels * dark_e * dark_e;
  }
  return out;
}

/// Solves for the covariance that an earlier fit gives. Light that would be negative is none.
std::optional<Fit> solve(const Vector3& charge_e, const Vector3& neutral, const Matrix3& covariance) {
  const std::optional<Matrix3> weight = inverse(covariance);
  if (!weight) return std::nullopt;
  constexpr Vector3 ones{1, 1, 1};
  const Vector3 of_ones = *weight * ones, of_neutral = *weight * neutral;
  const double dd = dot(ones, of_ones), dl = dot(ones, of_neutral), ll = dot(neutral, of_neutral);
  const double determinant = dd * ll - dl * dl, d = dot(of_ones, charge_e), l = dot(of_neutral, charge_e);
  if (!(determinant > 1e-9 * dd * ll)) return std::nullopt;
  Fit out{.dark_e = (ll * d - dl * l) / determinant,
          .light_e = (dd * l - dl * d) / determinant,
          .dark_variance_e2 = ll / determinant};
  if (out.light_e < 0) {
    out.light_e = 0;
    out.dark_e = d / dd;
  }
  out.dark_e = std::max(out.dark_e, 0.0);
  Vector3 residual{};
  for (std::size_t c = 0; c < 3; ++c) residual[c] = charge_e[c] - out.dark_e - out.light_e * neutral[c];
  out.weighted_residual = *weight * residual;
  out.misfit = dot(residual, out.weighted_residual);
  return out;
}

/// Solves repeatedly, as the covariance depends on the solution. Half steps keep it from alternating.
std::optional<Fit> solved(const Vector3& charge_e, const Vector3& noise, const Vector3& neutral) {
  constexpr int steps = 24;
  double dark_e = std::max(dot(fraction_of_pixels, charge_e), 0.0) / 2, light_e = dark_e;
  std::optional<Fit> fit;
  for (int i = 0; i < steps; ++i) {
    fit = solve(charge_e, neutral, covariance(noise, neutral, dark_e, light_e));
    if (!fit) return std::nullopt;
    dark_e = (dark_e + fit->dark_e) / 2;
    light_e = (light_e + fit->light_e) / 2;
  }
  return fit;
}

bool is_positive(const Vector3& v) {
  return std::ranges::all_of(v, [](double x) { return x > 0 && std::isfinite(x); });
}

}  // namespace

std::optional<DarkEstimate> estimate_dark_charge(const DarkEvidence& e) {
  const Blocks blocks = joined_blocks(e);
  if (blocks.block.size() < min_blocks) return std::nullopt;
  const auto count = static_cast<std::size_t>(darkest_fraction * static_cast<double>(blocks.block.size()));
  const Block darkest_blocks = mean_of(std::span(blocks.block).first(std::max<std::size_t>(count, 4)));
  const Vector3& darkest = darkest_blocks.charge_e;
  std::optional<Vector3> neutral = colour_of_contrast(e, blocks, darkest_blocks);
  if (!neutral) return std::nullopt;
  if (e.neutral && is_positive(*e.neutral)) {
    Vector3 stated_e = *e.neutral;
    for (std::size_t c = 0; c < 3; ++c) stated_e[c] *= e.electrons_at_white[c];
    neutral = mean_colour(*neutral, stated_e);
  }
  // The darkest blocks were chosen by their noise too: it is counted as that of a single one.
  const std::optional<Fit> fit = solved(darkest, block_variance(e, blocks, darkest), *neutral);
  if (!fit) return std::nullopt;
  DarkEstimate out{
      .standard_error_e = std::sqrt(fit->dark_variance_e2), .light_e = fit->light_e, .misfit = fit->misfit};
  const double between = std_between_channels * fit->dark_e;
  for (std::size_t c = 0; c < 3; ++c) {
    out.charge_e[c] =
        std::clamp(fit->dark_e + between * between * fit->weighted_residual[c], 0.0, std::max(darkest[c], 0.0));
  }
  out.mean_e = dot(fraction_of_pixels, out.charge_e);
  return out;
}

}  // namespace lowlux::isp
