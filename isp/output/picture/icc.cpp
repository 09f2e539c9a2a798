#include "isp/output/picture/icc.h"

#include <lcms2.h>

#include <algorithm>
#include <array>
#include <memory>

#include "isp/model/colour/colorimetry.h"

namespace lowlux::isp {
namespace {

constexpr Chromaticities xyz_axes{{1, 0}, {0, 1}, {0, 0}, {1.0 / 3, 1.0 / 3}};
constexpr Vector3 icc_d50{0.9642, 1.0, 0.8249};  // ICC.1:2022 section 7.2.16

Chromaticities to_chromaticities(const RgbPrimaries& p) {
  const auto xy = [](const Xy& from) { return Chromaticities::Xy{from.x, from.y}; };
  return {xy(p.red), xy(p.green), xy(p.blue), xy(p.white)};
}

constexpr std::size_t date_offset = 24;  // ICC.1:2022 table 17: creation date, 12 bytes
constexpr std::size_t id_offset = 84;    // profile ID, 16 bytes

struct DeleteContext {
  void operator()(cmsContext context) const { cmsDeleteContext(context); }
};
struct CloseProfile {
  void operator()(cmsHPROFILE profile) const { cmsCloseProfile(profile); }
};
struct FreeCurve {
  void operator()(cmsToneCurve* curve) const { cmsFreeToneCurve(curve); }
};
struct FreeText {
  void operator()(cmsMLU* text) const { cmsMLUfree(text); }
};
using Context = std::unique_ptr<std::remove_pointer_t<cmsContext>, DeleteContext>;
using Profile = std::unique_ptr<std::remove_pointer_t<cmsHPROFILE>, CloseProfile>;
using Curve = std::unique_ptr<cmsToneCurve, FreeCurve>;
using Text = std::unique_ptr<cmsMLU, FreeText>;

const char* profile_name(OutputSpace space) {
  switch (space) {
    case OutputSpace::srgb:
      return "sRGB";
    case OutputSpace::display_p3:
      return "Display P3";
    case OutputSpace::rec2020:
      return "Rec. 2020";
    case OutputSpace::linear_srgb:
      return "Linear sRGB";
    case OutputSpace::linear_rec2020:
      return "Linear Rec. 2020";
    case OutputSpace::xyz:
      return "CIE XYZ, white D65";
    case OutputSpace::camera:
      break;
  }
  return "";
}

/// Returns the curve from code to light, as ICC parametric curve type 3: (a X + b)^g from d on, c X below.
Curve curve_of(cmsContext context, OutputSpace space) {
  if (is_linear(space)) return Curve(cmsBuildGamma(context, 1.0));
  if (space == OutputSpace::rec2020) {  // inverse of BT.2020-2 table 4, its constants for 12 bits
    constexpr double alpha = 1.0993, beta = 0.0181;
    const std::array<double, 5> p{1 / 0.45, 1 / alpha, (alpha - 1) / alpha, 1 / 4.5, 4.5 * beta};
    return Curve(cmsBuildParametricToneCurve(context, 4, p.data()));
  }
  const std::array<double, 5> p{2.4, 1 / 1.055, 0.055 / 1.055, 1 / 12.92, 0.04045};  // IEC 61966-2-1
  return Curve(cmsBuildParametricToneCurve(context, 4, p.data()));
}

bool set_text(cmsContext context, cmsHPROFILE profile, cmsTagSignature tag, const char* words) {
  const Text text(cmsMLUalloc(context, 1));
  return text != nullptr && cmsMLUsetASCII(text.get(), "en", "US", words) && cmsWriteTag(profile, tag, text.get());
}

/// Makes the axes of XYZ, adapted to the D50 of profiles, the colorants of a profile.
bool set_colorants_of_xyz(cmsHPROFILE profile) {
  constexpr std::array tags{cmsSigRedColorantTag, cmsSigGreenColorantTag, cmsSigBlueColorantTag};
  const Matrix3 to_d50 = *bradford_adaptation(white_d65, *xy_of(xyz_of(icc_d50)));
  for (std::size_t c = 0; c < tags.size(); ++c) {
    const cmsCIEXYZ colorant{to_d50[0][c], to_d50[1][c], to_d50[2][c]};
    if (!cmsWriteTag(profile, tags[c], &colorant)) return false;
  }
  return true;
}

std::vector<std::byte> bytes_of(cmsHPROFILE profile) {
  cmsUInt32Number size = 0;
  if (!cmsSaveProfileToMem(profile, nullptr, &size)) return {};
  std::vector<std::byte> bytes(size);
  if (!cmsSaveProfileToMem(profile, bytes.data(), &size)) return {};
  return bytes;
}

/// Removes the date and sets the profile ID to the MD5 of the remaining bytes (ICC.1:2022 7.2.18).
void make_deterministic(cmsContext context, std::vector<std::byte>& bytes) {
  if (bytes.size() < 128) return;
  std::fill_n(bytes.begin() + date_offset, 12, std::byte{0});
  const Profile again(cmsOpenProfileFromMemTHR(context, bytes.data(), static_cast<cmsUInt32Number>(bytes.size())));
  std::array<cmsUInt8Number, 16> id{};
  if (again == nullptr || !cmsMD5computeID(again.get())) return;
  cmsGetHeaderProfileID(again.get(), id.data());
  std::transform(id.begin(), id.end(), bytes.begin() + id_offset, [](cmsUInt8Number b) { return std::byte{b}; });
}

}  // namespace

std::optional<Chromaticities> chromaticities_of(OutputSpace space) {
  switch (space) {
    case OutputSpace::srgb:
    case OutputSpace::linear_srgb:
      return to_chromaticities(primaries_rec709);
    case OutputSpace::display_p3:
      return to_chromaticities(primaries_p3_d65);
    case OutputSpace::rec2020:
    case OutputSpace::linear_rec2020:
      return to_chromaticities(primaries_rec2020);
    case OutputSpace::xyz:
      return xyz_axes;
    case OutputSpace::camera:
      break;
  }
  return std::nullopt;
}

std::vector<std::byte> icc_profile(OutputSpace space) {
  const bool is_xyz = space == OutputSpace::xyz;
  const auto c = is_xyz ? to_chromaticities(primaries_rec709) : chromaticities_of(space);
  if (!c) return {};
  const Context context(cmsCreateContext(nullptr, nullptr));
  const Curve curve = curve_of(context.get(), space);
  if (curve == nullptr) return {};
  const cmsCIExyY white{c->white.x, c->white.y, 1};
  const cmsCIExyYTRIPLE primaries{{c->red.x, c->red.y, 1}, {c->green.x, c->green.y, 1}, {c->blue.x, c->blue.y, 1}};
  std::array<cmsToneCurve*, 3> curves{curve.get(), curve.get(), curve.get()};
  const Profile profile(cmsCreateRGBProfileTHR(context.get(), &white, &primaries, curves.data()));
  if (profile == nullptr || (is_xyz && !set_colorants_of_xyz(profile.get()))) return {};
  if (!set_text(context.get(), profile.get(), cmsSigProfileDescriptionTag, profile_name(space)) ||
      !set_text(context.get(), profile.get(), cmsSigCopyrightTag, "No copyright, use freely")) {
    return {};
  }
  std::vector<std::byte> bytes = bytes_of(profile.get());
  make_deterministic(context.get(), bytes);
  return bytes;
}

}  // namespace lowlux::isp
