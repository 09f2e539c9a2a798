#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include <nlohmann/json.hpp>

#include "isp/base/executor.h"
#include "isp/model/colour/colour_difference.h"
#include "isp/output/picture/image_writer.h"
#include "isp/render/output_space.h"
#include "tests/cli/command.h"
#include "tests/cli/simulate/simulate_command.h"

namespace lowlux {
namespace {

using test::lowlux;

using Json = nlohmann::json;
using Codes = std::array<int, 3>;

constexpr Codes paint{90, 120, 70}, other_paint{94, 120, 70};

// Pictures of three fields of colour, so that they span an area; the last field is what differs.
class CompareCommand : public test::SimulateCommand {
 protected:
  void write(const std::string& name, const Codes& last, int width = 48) {
    const std::array<Codes, 3> field{{{255, 60, 60}, {60, 60, 200}, last}};
    Encoded8 picture{Plane<std::uint8_t>(3 * width, 32)};
    for (int y = 0; y < 32; ++y) {
      for (int i = 0; i < 3 * width; ++i) {
        picture.codes.at(i, y) = static_cast<std::uint8_t>(field[static_cast<std::size_t>(i / width)][i % 3]);
      }
    }
    InlineExecutor one;
    ASSERT_TRUE(isp::write_picture(Picture(std::move(picture)), OutputSpace::srgb, {}, file(name), {}, one));
  }

  test::ProcessResult compare(const std::string& a, const std::string& b, const std::vector<std::string>& more = {}) {
    std::vector<std::string> args{"compare", file(a), file(b)};
    args.insert(args.end(), more.begin(), more.end());
    return lowlux(args);
  }
};

isp::Lab lab_of_codes(const Codes& codes) {
  Vector3 linear{};
  for (std::size_t c = 0; c < 3; ++c) linear[c] = isp::decode_transfer(OutputSpace::srgb, codes[c] / 255.0);
  return isp::lab_of(isp::xyz_of(*isp::rgb_to_xyz(isp::primaries_rec709) * linear), *isp::xyz_of(isp::white_d65));
}

TEST_F(CompareCommand, OfAPictureWithItselfFindsNoDifference) {
  write("a.png", paint);
  const auto result = compare("a.png", "a.png", {"--json"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_EQ(result.err, "");
  const Json json = Json::parse(result.out);
  EXPECT_NEAR(json["spectra"]["jeffreys_nat"].get<double>(), 0, 1e-9);
  for (const char* name : {"delta_e_ab", "delta_e_94c", "ciede2000"}) EXPECT_EQ(json[name]["largest"], 0) << name;
  EXPECT_TRUE(json["psnr_db"].is_null());
  EXPECT_EQ(json["identical_codes"], true);
  EXPECT_NEAR(json["ssim"].get<double>(), 1, 1e-12);
  EXPECT_NEAR(json["egr"]["convex_percent"].get<double>(), 100, 1e-4);
  EXPECT_EQ(json["egr"]["occupancy_percent"], 100);
  EXPECT_TRUE(json["egr"]["why_no_convex"].is_null());
  const auto text = compare("a.png", "a.png");
  EXPECT_NE(text.out.find("identical codes"), std::string::npos) << text.out;
}

TEST_F(CompareCommand, AKnownShiftHasItsFigures) {
  write("a.png", paint);
  write("b.png", other_paint);
  const auto result = compare("a.png", "b.png", {"--json"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const Json json = Json::parse(result.out);
  const isp::Lab a = lab_of_codes(paint), b = lab_of_codes(other_paint);
  // 1e-3: X, Y, Z in floats, 6e-8 relative, times 500 and the slopes of the cube root.
  EXPECT_NEAR(json["delta_e_ab"]["largest"].get<double>(), isp::delta_e_ab(a, b), 1e-3);
  EXPECT_NEAR(json["delta_e_94c"]["largest"].get<double>(), isp::delta_e_94c(a, b), 1e-3);
  EXPECT_NEAR(json["ciede2000"]["largest"].get<double>(), isp::ciede2000(a, b), 1e-3);
  EXPECT_NEAR(json["ciede2000"]["mean"].get<double>(), isp::ciede2000(a, b) / 3, 1e-3);
  EXPECT_EQ(json["ciede2000"]["median"], 0) << "two fields of three are equal";
  // 4 of 255 codes in one channel of one field of three.
  EXPECT_NEAR(json["psnr_db"].get<double>(), -10 * std::log10(16 / (255.0 * 255) / 9), 1e-3);
  EXPECT_EQ(json["identical_codes"], false);
  EXPECT_EQ(json["outside_display_a"], 0) << "rounded colorants of the ICC profile do not count";
}

TEST_F(CompareCommand, LinearFloatsAreTheSamePictureAsTheCodesTheyStandFor) {
  write("a.png", paint);
  InlineExecutor one;
  SceneLinear light(48, 32);
  const std::array<Codes, 3> field{{{255, 60, 60}, {60, 60, 200}, paint}};
  for (int y = 0; y < 32; ++y) {
    for (int x = 0; x < 48; ++x) {
      for (std::size_t c = 0; c < 3; ++c) {
        const int code = field[static_cast<std::size_t>(x / 16)][c];
        light.plane[c].at(x, y) = static_cast<float>(isp::decode_transfer(OutputSpace::srgb, code / 255.0));
      }
    }
  }
  isp::WriteOptions full;
  full.exr.depth = isp::ExrOptions::Depth::full;
  ASSERT_TRUE(isp::write_picture(Picture(std::move(light)), OutputSpace::linear_srgb, {}, file("b.exr"), full, one));
  const auto result = compare("a.png", "b.exr", {"--json"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const Json json = Json::parse(result.out);
  // The ICC profile of the codes states its colorants in steps of 1 / 65536: 1.5e-5, times 500 and the slope 1 of f.
  EXPECT_LT(json["delta_e_ab"]["largest"], 0.01);
  EXPECT_GT(json["psnr_db"], 90);  // -20 log10 of 3e-5, of two such steps
}

TEST_F(CompareCommand, TakesNegativeValuesOfNoiseAsBlackWithAWarning) {
  SceneLinear signed_light(48, 32), clipped(48, 32);
  for (std::size_t c = 0; c < 3; ++c) {
    for (std::size_t i = 0; i < signed_light.plane[c].size(); ++i) {
      const float value = (i + c) % 2 == 0 ? 0.02F : -0.01F;
      signed_light.plane[c].data()[i] = value;
      clipped.plane[c].data()[i] = std::max(value, 0.0F);
    }
  }
  InlineExecutor one;
  ASSERT_TRUE(isp::write_picture(Picture(std::move(signed_light)), OutputSpace::xyz, {}, file("a.tif"), {}, one));
  ASSERT_TRUE(isp::write_picture(Picture(std::move(clipped)), OutputSpace::xyz, {}, file("b.exr"), {}, one));
  const auto result = compare("a.tif", "b.exr", {"--json"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_LT(Json::parse(result.out)["ciede2000"]["largest"], 0.02) << "a TIFF of XYZ is read as XYZ, and half floats";
  EXPECT_NE(result.err.find("50 % of the samples are negative, down to -0.01"), std::string::npos) << result.err;
}

TEST_F(CompareCommand, RefusesWhatCannotBeCompared) {
  write("a.png", paint);
  write("wide.png", paint, 50);
  scratch_.write("words.png", "no picture");
  const auto sizes = compare("a.png", "wide.png");
  EXPECT_EQ(sizes.exit_code, 1);
  EXPECT_NE(sizes.err.find("wide.png"), std::string::npos) << sizes.err;
  EXPECT_NE(sizes.err.find("50 x 32 pixels"), std::string::npos) << sizes.err;
  EXPECT_NE(sizes.err.find("crop or scale"), std::string::npos) << sizes.err;
  const auto words = compare("a.png", "words.png");
  EXPECT_EQ(words.exit_code, 1);
  EXPECT_NE(words.err.find("words.png: lowlux does not read this format"), std::string::npos) << words.err;
  const auto raw = lowlux({"compare", LOWLUX_TESTDATA "/raws/canon_kissx4_ml_colorchart.dng", file("a.png")});
  EXPECT_EQ(raw.exit_code, 1);
  EXPECT_NE(raw.err.find("develop it first"), std::string::npos) << raw.err;
  // Little-endian TIFF with one tag: NewSubfileType is 1.
  const char thumbnail[] = "II*\0\x08\0\0\0\x01\0\xFE\0\x04\0\x01\0\0\0\x01\0\0\0\0\0\0";
  test::write_file(file("camera.nef"), thumbnail, sizeof thumbnail);
  const auto nef = compare("a.png", "camera.nef");
  EXPECT_EQ(nef.exit_code, 1);
  EXPECT_NE(nef.err.find("camera.nef: this file begins with a thumbnail"), std::string::npos) << nef.err;
  const auto missing = compare("no.png", "a.png", {"--json"});
  EXPECT_EQ(missing.exit_code, 1);
  EXPECT_NE(Json::parse(missing.out)["file"].get<std::string>().find("no.png"), std::string::npos);
  EXPECT_EQ(lowlux({"compare", file("a.png")}).exit_code, 2);
  EXPECT_EQ(compare("a.png", "a.png", {"--luck"}).exit_code, 2);
}

}  // namespace
}  // namespace lowlux
