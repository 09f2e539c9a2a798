#include "isp/render/night/eye_tables.h"

#include <cmath>
#include <cstddef>

#include "isp/model/vision/mesopic.h"
#include "isp/model/vision/night_eye.h"

namespace lowlux::isp {
namespace {

using rows::EyeTables;

double node(int i, int nodes, double first, double last) { return first + (last - first) * i / (nodes - 1); }

// Returns the coefficient before it is clamped to 0..1, so that interpolation is linear at the ends too.
double unheld_coefficient(double log2_light, double log2_ratio) {
  const LuminancePair field{std::exp2(log2_light), std::exp2(log2_light + log2_ratio)};
  const double m = mesopic_state(field).m;
  const double end = mes2_response(m == 0 ? field.scotopic : field.photopic);
  return m == 0 || m == 1 ? end : m;
}

EyeTables make_tables() {
  EyeTables t{};
  for (int j = 0; j < EyeTables::ratios; ++j) {
    for (int i = 0; i < EyeTables::lights; ++i) {
      t.m[static_cast<std::size_t>(j) * EyeTables::lights + i] = static_cast<float>(
          unheld_coefficient(node(i, EyeTables::lights, EyeTables::first_log2_light, EyeTables::last_log2_light),
                             node(j, EyeTables::ratios, EyeTables::first_log2_ratio, EyeTables::last_log2_ratio)));
    }
  }
  for (int i = 0; i < EyeTables::lights; ++i) {
    const double light = std::exp2(node(i, EyeTables::lights, EyeTables::first_log2_light, EyeTables::last_log2_light));
    const double blur_deg = blur_std_deg(light);
    t.blue[i] = static_cast<float>(rod_blue(light));
    t.variance_deg2[i] = static_cast<float>(blur_deg * blur_deg);
  }
  t.half_saturation_cd_m2 = static_cast<float>(half_saturation_cd_m2);
  t.chroma_scale = static_cast<float>(1 + half_saturation_cd_m2 / 100);
  return t;
}

}  // namespace

const EyeTables& eye_tables() {
  static const EyeTables tables = make_tables();
  return tables;
}

}  // namespace lowlux::isp
