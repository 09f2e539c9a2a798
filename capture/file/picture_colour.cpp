#include "capture/file/picture_colour.h"

#include <lcms2.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <memory>
#include <string>

#include "isp/model/colour/colorimetry.h"

namespace lowlux::capture {
namespace {

constexpr Vector3 icc_d50{0.9642, 1.0, 0.8249};  // ICC.1:2022 section 7.2.16

struct DeleteContext {
  void operator()(cmsContext context) const { cmsDeleteContext(context); }
};
struct CloseProfile {
  void operator()(cmsHPROFILE profile) const { cmsCloseProfile(profile); }
};
using Context = std::unique_ptr<std::remove_pointer_t<cmsContext>, DeleteContext>;
using Profile = std::unique_ptr<std::remove_pointer_t<cmsHPROFILE>, CloseProfile>;

double srgb_to_linear(double code) { return code <= 0.04045 ? code / 12.92 : std::pow((code + 0.055) / 1.055, 2.4); }

template <class Curve>
std::vector<float> tabulate(int codes, const Curve& curve) {
  std::vector<float> table(static_cast<std::size_t>(codes));
  for (int i = 0; i < codes; ++i) table[i] = static_cast<float>(curve(static_cast<double>(i) / (codes - 1)));
  return table;
}

tl::unexpected<Error> damaged(const std::string& what) {
  return fail(ErrorCode::malformed, "the ICC profile of the image " + what + ": remove it, or convert to sRGB");
}

/// Returns a curve, clamped to 0..1, the range ICC defines.
Result<std::vector<float>> curve_of(cmsHPROFILE profile, cmsTagSignature tag, int codes) {
  const auto* curve = static_cast<const cmsToneCurve*>(cmsReadTag(profile, tag));
  if (curve == nullptr) return damaged("has a curve that cannot be read");
  std::vector<float> table = tabulate(codes, [&](double v) {
    return std::clamp(cmsEvalToneCurveFloat(curve, static_cast<cmsFloat32Number>(v)), 0.0F, 1.0F);
  });
  if (std::any_of(table.begin(), table.end(), [](float v) { return std::isnan(v); })) {
    return damaged("has a curve that is not a number");
  }
  return table;
}

/// Returns the matrix from colorants (XYZ under D50) to XYZ under D65.
Result<Matrix3> matrix_of(cmsHPROFILE profile) {
  constexpr cmsTagSignature tags[] = {cmsSigRedColorantTag, cmsSigGreenColorantTag, cmsSigBlueColorantTag};
  Matrix3 colorants{};
  for (int c = 0; c < 3; ++c) {
    const auto* xyz = static_cast<const cmsCIEXYZ*>(cmsReadTag(profile, tags[c]));
    if (xyz == nullptr) return damaged("has a colorant that cannot be read");
    colorants[0][c] = xyz->X;
    colorants[1][c] = xyz->Y;
    colorants[2][c] = xyz->Z;
  }
  const auto adaptation = isp::bradford_adaptation(*isp::xy_of(isp::xyz_of(icc_d50)), isp::white_d65);
  if (!inverse(colorants) || !adaptation) return damaged("has colorants that lie on one line");
  return *adaptation * colorants;
}

Result<DisplayColour> grey_colour(cmsHPROFILE profile, int codes) {
  auto curve = curve_of(profile, cmsSigGrayTRCTag, codes);
  if (!curve) return tl::make_unexpected(curve.error());
  DisplayColour colour;
  colour.curve.fill(*curve);
  colour.to_xyz = *isp::rgb_to_xyz(isp::primaries_rec709);  // for R = G = B any primaries with a D65 white are valid
  colour.grey = true;
  return colour;
}

}  // namespace

DisplayColour srgb_colour(int codes) {
  DisplayColour colour;
  colour.curve.fill(tabulate(codes, srgb_to_linear));
  colour.to_xyz = *isp::rgb_to_xyz(isp::primaries_rec709);
  return colour;
}

Result<DisplayColour> icc_colour(std::span<const std::byte> bytes, int codes) {
  const Context context(cmsCreateContext(nullptr, nullptr));
  const Profile profile(
      cmsOpenProfileFromMemTHR(context.get(), bytes.data(), static_cast<cmsUInt32Number>(bytes.size())));
  if (profile == nullptr) return damaged("cannot be read");
  const bool shaped = cmsIsMatrixShaper(profile.get()) != 0 && cmsGetPCS(profile.get()) == cmsSigXYZData;
  const cmsColorSpaceSignature space = cmsGetColorSpace(profile.get());
  if (shaped && space == cmsSigGrayData) return grey_colour(profile.get(), codes);
  if (!shaped || space != cmsSigRgbData) {
    return fail(ErrorCode::unsupported,
                "the ICC profile of the image is not one of three curves and a matrix: convert the image to sRGB");
  }
  DisplayColour colour;
  constexpr cmsTagSignature tags[] = {cmsSigRedTRCTag, cmsSigGreenTRCTag, cmsSigBlueTRCTag};
  for (int c = 0; c < 3; ++c) {
    auto curve = curve_of(profile.get(), tags[c], codes);
    if (!curve) return tl::make_unexpected(curve.error());
    colour.curve[c] = *std::move(curve);
  }
  const auto matrix = matrix_of(profile.get());
  if (!matrix) return tl::make_unexpected(matrix.error());
  colour.to_xyz = *matrix;
  return colour;
}

Result<Matrix3> primaries_to_xyz(const isp::Chromaticities& p) {
  const Matrix3 directions{{{p.red.x, p.green.x, p.blue.x},
                            {p.red.y, p.green.y, p.blue.y},
                            {1 - p.red.x - p.red.y, 1 - p.green.x - p.green.y, 1 - p.blue.x - p.blue.y}}};
  const auto white = isp::xyz_of(isp::Xy{p.white.x, p.white.y});
  const auto back = inverse(directions);
  if (!white || !back) {
    return fail(ErrorCode::malformed,
                "the chromaticities of the file are no colour space: its primaries lie on one "
                "line, or its white is no colour");
  }
  return directions * diagonal3(*back * isp::vector_of(*white));
}

}  // namespace lowlux::capture
