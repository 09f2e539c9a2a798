#include "isp/model/appearance/cao.h"

#include <algorithm>
#include <cmath>

#include "isp/model/appearance/seen_scene.h"
#include "isp/model/vision/mesopic.h"

namespace lowlux::isp {
namespace {

struct Node {
  double luminance_cd_m2;
  CaoWeights weights;
};

constexpr std::array<Node, 3> table{{{0.10, {0.173, 0.357}}, {0.62, {0.0173, 0.0101}}, {10, {0, 0}}}};
constexpr double photopic_cd_m2 = 10;

}  // namespace

CaoWeights cao_weights(double luminance_cd_m2) {
  if (luminance_cd_m2 <= table.front().luminance_cd_m2) return table.front().weights;
  for (std::size_t i = 1; i < table.size(); ++i) {
    const Node &low = table[i - 1], &high = table[i];
    if (luminance_cd_m2 > high.luminance_cd_m2) continue;
    const double t =
        std::log(luminance_cd_m2 / low.luminance_cd_m2) / std::log(high.luminance_cd_m2 / low.luminance_cd_m2);
    return {std::lerp(low.weights.k1, high.weights.k1, t), std::lerp(low.weights.k2, high.weights.k2, t)};
  }
  return table.back().weights;
}

ReceptorMatrix cao_receptors(const Matrix3& to_xyz, const Vector3& rod_weights, const Vector3& white) {
  const Matrix3 cones = xyz_to_smith_pokorny * to_xyz;
  Vector3 rods{};
  double of_white = 0;
  for (int j = 0; j < 3; ++j) {
    for (int i = 0; i < 3; ++i) rods[j] += rod_weights[i] * to_xyz[i][j];
    of_white += rods[j] * white[j];
  }
  for (double& weight : rods) weight /= of_white;
  return {cones[0], cones[1], cones[2], rods};
}

Matrix3 cao_signals(const CaoWeights& weights, const ReceptorMatrix& receptors) {
  const Vector3 k{weights.k1, weights.k1, weights.k2};
  Matrix3 out{};
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) out[i][j] = receptors[i][j] + k[i] * receptors[3][j];
  }
  return out;
}

std::optional<Matrix3> cao_retargeting(double from_cd_m2, double to_cd_m2, const ReceptorMatrix& receptors) {
  const auto back = inverse(cao_signals(cao_weights(to_cd_m2), receptors));
  if (!back) return std::nullopt;
  return *back * cao_signals(cao_weights(from_cd_m2), receptors);
}

namespace {

Result<ColourMap> cao_map(const ViewingConditions& conditions) {
  const auto scene = seen_scene(conditions);
  if (!scene) return tl::make_unexpected(scene.error());
  const ReceptorMatrix receptors = cao_receptors(identity3(), scotopic_weights, scene->white);
  const Matrix3 matrix = *cao_retargeting(scene->adaptation_cd_m2, photopic_cd_m2, receptors);
  return colour_map([matrix](const Vector3& xyz) { return matrix * xyz; });
}

}  // namespace

AppearanceModel cao_appearance() {
  return {.name = "cao",
          .source = "Cao, Pokorny, Smith & Zele 2008",
          .needs = "luminance of adaptation",
          .limits =
              "adds the signal of the rods to that of the cones, so white becomes up to a third brighter and some "
              "colours leave the gamut; the scale of the rods is our choice; there are no measurements below 0.1 cd/m2",
          .valid_from_cd_m2 = 0.5,
          .valid_to_cd_m2 = 1e5,
          .at = cao_map};
}

}  // namespace lowlux::isp
