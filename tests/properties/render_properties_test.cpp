#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <utility>
#include <variant>
#include <vector>

#include "isp/base/executor.h"
#include "isp/model/colour/colorimetry.h"
#include "isp/output/picture/orient.h"
#include "isp/pipeline/finished/encode_picture.h"
#include "isp/render/colour_table.h"
#include "isp/render/exposure.h"
#include "isp/render/night/night_look.h"
#include "isp/render/output_space.h"
#include "isp/render/retarget/retarget.h"
#include "isp/render/tone.h"
#include "isp/render/white_balance.h"
#include "tests/properties/draws.h"

namespace lowlux::isp {
namespace {

using namespace properties;

RC_GTEST_PROP(ExposureProperty, IsWithinItsRangeAndTheOrderOfBlocksDoesNotMatter, ()) {
  const auto blocks = any_plane(size_between(1, 60), 1, -0.1F, 1.5F, 9);
  std::vector<float> luminance(blocks.data(), blocks.data() + blocks.size());
  const double noise = *rc::gen::element(0.0, 1e-5, 1e-3);
  const AutoExposure found = auto_exposure(luminance, luminance, noise);
  RC_ASSERT(found.ev >= 0 && found.ev <= AutoExposureOptions{}.max_ev);
  std::ranges::reverse(luminance);
  std::vector<float> largest = luminance;
  const AutoExposure other = auto_exposure_reordering(luminance, largest, noise);
  RC_ASSERT(other.ev == found.ev && other.rule == found.rule);
}

RC_GTEST_PROP(ExposureProperty, HalfTheLightGetsOneStopMore, ()) {
  const auto blocks = any_plane(size_between(20, 60), 1, 0.01F, 0.1F);
  std::vector<float> luminance(blocks.data(), blocks.data() + blocks.size());
  const AutoExposure full = auto_exposure(luminance, luminance, 0);
  for (float& y : luminance) y /= 2;
  RC_ASSERT(std::abs(auto_exposure(luminance, luminance, 0).ev - full.ev - 1) < 1e-5);  // EV of floats
}

/// A camera whose sensitivities are Rec. 709's, each channel as sensitive as it may be.
CameraColour any_camera() {
  const Vector3 sensitivity{any_between(0.2, 1), any_between(0.2, 1), any_between(0.2, 1)};
  CameraColour out;
  out.calibrations = {
      {.cct_k = 6504, .xyz_to_camera = diagonal3(sensitivity) * *xyz_to_output(OutputSpace::linear_srgb)}};
  return out;
}

RC_GTEST_PROP(WhiteBalanceProperty, ANeutralIsTheTemperatureItWasMadeOf, ()) {
  CameraColour camera = any_camera();
  const double kelvin = any_between(2500, 12000);
  const auto asked = white_balance_of_temperature(camera, kelvin);
  RC_ASSERT(asked.has_value());
  RC_ASSERT(std::abs(*std::ranges::max_element(asked->neutral) - 1) < 1e-12);
  const double scale = any_between(0.1, 5);
  camera.as_shot_neutral = {scale * asked->neutral[0], scale * asked->neutral[1], scale * asked->neutral[2]};
  const auto found = as_shot_white_balance(camera);
  RC_ASSERT(found.has_value());
  for (std::size_t c = 0; c < 3; ++c) RC_ASSERT(std::abs(found->neutral[c] - asked->neutral[c]) < 1e-12);
  RC_ASSERT(std::abs(found->white->cct_k / kelvin - 1) < 2e-3);  // daylight's own formula is that exact
}

RC_GTEST_PROP(WhiteBalanceProperty, TheOrderOfBlocksAndTheExposureDoNotMatter, ()) {
  const CameraColour camera = any_camera();
  const int blocks = size_between(32, 100);
  std::array<Plane<float>, 3> light, turned;
  const float exposure = *rc::gen::element(0.5F, 0.25F);  // exact in binary
  for (std::size_t c = 0; c < 3; ++c) {
    light[c] = any_plane(blocks, 1, 0.05F, 0.8F);
    turned[c] = mirrored(light[c]);
    for (int i = 0; i < blocks; ++i) turned[c].at(i, 0) *= exposure;
  }
  const auto view = [](const std::array<Plane<float>, 3>& planes) {
    return RgbView<const float>{planes[0].view(), planes[1].view(), planes[2].view()};
  };
  const WhiteBalance a = auto_white_balance(view(light), 0, camera), b = auto_white_balance(view(turned), 0, camera);
  RC_ASSERT(a.source == b.source);
  for (std::size_t c = 0; c < 3; ++c) RC_ASSERT(std::abs(a.neutral[c] - b.neutral[c]) < 1e-9);
}

RC_GTEST_PROP(EncodeProperty, AnythingBecomesCodesAndGreysStayGrey, ()) {
  const int width = size_between(1, 30), height = size_between(1, 20);
  InlineExecutor executor;
  SceneLinear xyz(width, height);
  for (auto& plane : xyz.plane) plane = any_plane(width, height, -0.2F, 1.5F, 9);
  const Matrix3 white = *rgb_to_xyz(primaries_rec709);
  const auto grey = static_cast<float>(any_between(0, 1.2));
  for (int c = 0; c < 3; ++c) {
    const Vector3& row = white[static_cast<std::size_t>(c)];
    xyz.plane[c].at(0, 0) = grey * static_cast<float>(row[0] + row[1] + row[2]);
  }
  for (const OutputSpace space : {OutputSpace::srgb, OutputSpace::display_p3, OutputSpace::rec2020}) {
    const Picture picture = encode_picture(xyz, space, SampleType::u16, executor);
    const auto& codes = std::get<Encoded16>(picture);
    RC_ASSERT(codes.width() == width && codes.height() == height);
    const std::uint16_t* const first = codes.codes.row(0);
    for (int c = 1; c < 3; ++c) RC_ASSERT(std::abs(first[c] - first[0]) <= 1);
  }
}

RC_GTEST_PROP(ToneProperty, RisesFromBlackToWhite, ()) {
  const ToneCurve curve = *rc::gen::element(ToneCurve::standard, ToneCurve::none);
  const double limit = tone_limit(curve, any_between(-4, 14));
  const double a = any_between(0, limit), b = any_between(0, limit);
  const double low = apply_tone(curve, std::min(a, b), limit), high = apply_tone(curve, std::max(a, b), limit);
  RC_ASSERT(low >= 0 && low <= high && high <= 1);
  RC_ASSERT(apply_tone(curve, 0, limit) == 0);
  RC_ASSERT(apply_tone(curve, limit, limit) == 1);
}

RC_GTEST_PROP(OrientProperty, TurningBackGivesTheSamePicture, ()) {
  const int width = size_between(1, 20), height = size_between(1, 20);
  const auto codes = any_codes(3 * width, height, 65535);
  const auto orientation = static_cast<Orientation>(size_between(1, 8));
  const bool turned = orientation == Orientation::rotate_90 || orientation == Orientation::rotate_270;
  const Orientation back = !turned                                 ? orientation
                           : orientation == Orientation::rotate_90 ? Orientation::rotate_270
                                                                   : Orientation::rotate_90;
  PoolExecutor three(3);
  Picture there = oriented(Encoded16{codes.clone()}, orientation, three);
  const auto& upright = std::get<Encoded16>(there);
  RC_ASSERT(upright.width() == (orientation >= Orientation::transpose ? height : width));
  const Picture again = oriented(std::move(there), back, three);
  const auto& same = std::get<Encoded16>(again).codes;
  RC_ASSERT(same.width() == codes.width() && same.height() == height);
  for (std::size_t i = 0; i < codes.size(); ++i) RC_ASSERT(same.data()[i] == codes.data()[i]);
}

RC_GTEST_PROP(RetargetProperty, CodesStayCodesAndGreysStayGrey, ()) {
  const auto& named = *rc::gen::elementOf(retarget_methods);
  RetargetOptions options;
  options.method = named.method;
  options.source_cd_m2 = *rc::gen::element(0.5, 20.0, 250.0, 2000.0);
  options.display_cd_m2 = *rc::gen::element(0.5, 2.0, 80.0, 250.0);
  const auto map = retargeting(options);
  RC_ASSERT(map.has_value());
  for (int i = 0; i < 5; ++i) {
    const Vector3 code{any_between(0, 1), any_between(0, 1), any_between(0, 1)};
    const Vector3 out = (*map)(code).code;
    for (const double channel : out) RC_ASSERT(channel >= 0 && channel <= 1);
    if (named.method == RetargetMethod::cao) continue;  // adds the rods' own colour
    const Vector3 grey = (*map)({code[0], code[0], code[0]}).code;
    // Derivatives by differences of 1e-5.
    RC_ASSERT(std::abs(grey[0] - grey[1]) < 2e-5 && std::abs(grey[1] - grey[2]) < 2e-5);
  }
}

// Linear maps are linear in the shares, which is what the table interpolates.
RC_GTEST_PROP(ColourTableProperty, ALinearMapComesOutExactly, ()) {
  const double x = any_between(0.2, 1.5), y = any_between(0.2, 1.5), z = any_between(0.2, 1.5);
  const auto table = make_colour_table([=](const Xyz& in) { return Xyz{x * in.x, y * in.y, z * in.z}; }, {});
  RC_ASSERT(table.has_value());
  SceneLinear picture(size_between(1, 40), 3);
  for (auto& plane : picture.plane) plane = any_plane(picture.width(), 3, 0, 1);
  SceneLinear out(picture.width(), 3);
  InlineExecutor one;
  apply_colour_table(*table, std::as_const(picture).view(), out.view(), one);
  const Matrix3 to_xyz = *rgb_to_xyz(primaries_rec709);
  const Matrix3 map = *inverse(to_xyz) * diagonal3({x, y, z}) * to_xyz;
  for (std::size_t i = 0; i < picture.plane[0].size(); ++i) {
    const Vector3 in{picture.plane[0].data()[i], picture.plane[1].data()[i], picture.plane[2].data()[i]};
    const Vector3 expected = map * in;
    for (std::size_t c = 0; c < 3; ++c) {
      RC_ASSERT(std::abs(out.plane[c].data()[i] - expected[c]) < 1e-5);  // floats of tables and shares, sums up to 5
    }
  }
}

RC_GTEST_PROP(NightLookProperty, TheGridIsFiniteWhateverTheCameraSaw, ()) {
  const int width = size_between(1, 40), height = size_between(1, 40);
  SceneLinear camera(width, height);
  for (auto& plane : camera.plane) plane = any_plane(width, height, -0.1F, 2, 9);
  NightLook look;
  look.cd_m2_per_unit = *rc::gen::element(1e-4, 0.01, 1.0, 1000.0);
  look.effects.glare = look.effects.visual_noise = *rc::gen::arbitrary<bool>();
  look.luminance = look.rods = {0.2126F, 0.7152F, 0.0722F};
  NightLookGrid grids(4 * width, 4 * height);
  PoolExecutor three(3);
  const std::array<float, 9> matrix{1, 0, 0, 0, 1, 0, 0, 0, 1};
  const LookGrid grid = grids.make(std::as_const(camera).view(), matrix, std::numeric_limits<float>::infinity(), look,
                                   std::nullopt, three);
  for (const auto& part : grid.part) {
    RC_ASSERT(part.width == width && part.height == height);
    for (int y = 0; y < height; ++y) {
      for (int i = 0; i < width; ++i) RC_ASSERT(std::isfinite(part.at(i, y)));
    }
  }
}

}  // namespace
}  // namespace lowlux::isp
