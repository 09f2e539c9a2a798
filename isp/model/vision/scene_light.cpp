#include "isp/model/vision/scene_light.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "isp/base/text.h"
#include "isp/model/spectrum/cie_data.h"
#include "isp/model/spectrum/spectral_data.h"
#include "isp/model/vision/mesopic.h"

namespace lowlux::isp {
namespace {

constexpr std::array lamp_sets{SpectrumSet::street_lamps, SpectrumSet::cie_illuminants, SpectrumSet::laboratory_lamps};

// CAT02 of CIE 159:2004.
constexpr Matrix3 cat02{{{0.7328, 0.4296, -0.1624}, {-0.7036, 1.6975, 0.0061}, {0.0030, 0.0136, 0.9834}}};

bool is_supported(double ratio) { return ratio >= min_scotopic_ratio && ratio <= max_scotopic_ratio; }

std::string range_text() { return number_text(min_scotopic_ratio) + " to " + number_text(max_scotopic_ratio); }

}  // namespace

Result<SceneLight> light_of_ratio(double scotopic_ratio) {
  if (!is_supported(scotopic_ratio)) {
    return fail(ErrorCode::invalid_argument,
                "the S/P of a light is from " + range_text() + ", not " + number_text(scotopic_ratio));
  }
  return SceneLight{{}, scotopic_ratio, {}, {}};
}

Result<SceneLight> light_of_spectrum(std::string name, Spectrum spectrum) {
  const LuminancePair light = luminance_of(spectrum);
  const std::optional<Xy> white = xy_of(xyz_of(spectrum));
  const double ratio = light.scotopic / light.photopic;
  if (!(light.photopic > 0) || !white) {
    return fail(ErrorCode::insufficient, "the light has no luminance: its power from 360 to 830 nm is 0");
  }
  if (!is_supported(ratio)) {
    return fail(ErrorCode::invalid_argument,
                "the light has an S/P of " + number_text(ratio) + "; supported are " + range_text());
  }
  return SceneLight{std::move(name), ratio, white, std::move(spectrum)};
}

Result<SceneLight> light_of_lamp(std::string_view name) {
  const auto same = [&](std::string_view known) {
    return std::ranges::equal(known, name, {}, ascii_lower, ascii_lower);
  };
  for (const SpectrumSet set : lamp_sets) {
    for (NamedSpectrum& lamp : spectra_of(set)) {
      if (same(lamp.name)) return light_of_spectrum(std::string(lamp.name), std::move(lamp.spectrum));
    }
  }
  std::string names;
  for (const std::string_view known : lamp_names()) names.append(names.empty() ? "" : ", ").append(known);
  return fail(ErrorCode::invalid_argument, "there is no light '" + std::string(name) + "'; the lights are " + names);
}

std::vector<std::string_view> lamp_names() {
  std::vector<std::string_view> names;
  for (const SpectrumSet set : lamp_sets) {
    for (const NamedSpectrum& lamp : spectra_of(set)) names.push_back(lamp.name);
  }
  return names;
}

double degree_of_adaptation(double adapting_cd_m2) {
  return 1 - std::exp(-(std::max(adapting_cd_m2, 0.0) + 42) / 92) / 3.6;
}

std::optional<Matrix3> incomplete_adaptation(const Xy& scene, const Xy& adapted, double degree) {
  const auto from = xyz_of(scene), to = xyz_of(adapted);
  if (!from || !to) return std::nullopt;
  const Vector3 of_scene = cat02 * vector_of(*from), of_adapted = cat02 * vector_of(*to);
  Vector3 factor{};
  for (int i = 0; i < 3; ++i) {
    if (!(of_adapted[i] > 0)) return std::nullopt;
    factor[i] = degree + (1 - degree) * of_scene[i] / of_adapted[i];
    if (!(factor[i] > 0)) return std::nullopt;
  }
  return *inverse(cat02) * diagonal3(factor) * cat02;
}

}  // namespace lowlux::isp
