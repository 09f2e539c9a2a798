#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "capture/file/dng_source.h"
#include "capture/file/picture_source.h"
#include "isp/base/executor.h"
#include "tests/cli/command.h"
#include "tests/cli/simulate/simulate_command.h"
#include "tests/codec/pictures.h"

namespace lowlux {
namespace {

using test::lowlux;

using Json = nlohmann::json;

class DenoiseCommand : public test::SimulateCommand {
 protected:
  void SetUp() override {
    simulated("chart:macbeth", "night.dng",
              {"--luminance", "0.2", "--size", "192x128", "--masked-columns", "32", "--no-truth"});
  }

  test::ProcessResult denoised(const std::vector<std::string>& more = {}) {
    std::vector<std::string> args{"denoise", file("night.dng"), "-o", file("clean.dng")};
    args.insert(args.end(), more.begin(), more.end());
    return lowlux(args);
  }
  void refused(const std::vector<std::string>& args, int exit_code, const std::string& why) {
    const auto result = lowlux(args);
    EXPECT_EQ(result.exit_code, exit_code) << result.err;
    EXPECT_NE(result.err.find(why), std::string::npos) << why << "\n" << result.err;
    EXPECT_FALSE(std::filesystem::exists(file("clean.dng")));
  }
  SceneLinear developed(const std::string& raw, const std::vector<std::string>& more) {
    std::vector<std::string> args{"develop", file(raw),    "-o", file("out.png"), "--force", "--bits", "16", "--tone",
                                  "none",    "--exposure", "0",  "--repair",      "off"};
    args.insert(args.end(), more.begin(), more.end());
    const auto result = lowlux(args);
    EXPECT_EQ(result.exit_code, 0) << result.err;
    InlineExecutor one;
    auto picture = capture::read_picture(file("out.png"), one);
    EXPECT_TRUE(picture) << picture.error().message;
    return std::move(picture->xyz);
  }
};

TEST_F(DenoiseCommand, CompressedFilesAreSmallerAndHoldTheSameSamples) {
  ASSERT_EQ(denoised().exit_code, 0);
  const auto plain = capture::read_raw(file("clean.dng"));
  const auto plain_bytes = std::filesystem::file_size(file("clean.dng"));
  ASSERT_EQ(denoised({"--force", "--compression", "lossless"}).exit_code, 0);
  const auto compressed = capture::read_raw(file("clean.dng"));
  ASSERT_TRUE(plain && compressed);
  EXPECT_TRUE(test::same_bits(compressed->raw.dn, plain->raw.dn));
  EXPECT_LT(std::filesystem::file_size(file("clean.dng")), plain_bytes * 3 / 4);
  EXPECT_EQ(denoised({"--force", "--compression", "best"}).exit_code, 2);
}

TEST_F(DenoiseCommand, GivesACleanRawThatSaysHowNoisyItIs) {
  const auto result = denoised({"--json"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const Json report = Json::parse(result.out)[0];
  EXPECT_EQ(report["denoise"]["noise_source"], "file");
  EXPECT_NE(report["denoise"]["level"], "off");
  const auto noisy = capture::read_raw(file("night.dng")), clean = capture::read_raw(file("clean.dng"));
  ASSERT_TRUE(noisy && clean) << clean.error().message;
  EXPECT_EQ(clean->raw.dn.width(), 192);
  EXPECT_EQ(clean->raw.info.model, noisy->raw.info.model);
  EXPECT_EQ(clean->raw.info.exposure_s, noisy->raw.info.exposure_s);
  EXPECT_EQ(clean->colour.calibrations.size(), noisy->colour.calibrations.size());
  ASSERT_TRUE(clean->noise);
  EXPECT_LT(clean->noise->offset[1], noisy->noise->offset[1]);
  EXPECT_LT(clean->noise->scale[1], 0.2 * noisy->noise->scale[1]);
}

// Two ways to one picture: clean raw, then develop; or denoise while developing. They differ by the rounding of codes,
// which demosaicing, white balance and matrix enlarge.
TEST_F(DenoiseCommand, IsWhatDevelopDoes) {
  ASSERT_EQ(denoised({"--denoise", "standard", "--repair", "off"}).exit_code, 0);
  const SceneLinear one = developed("clean.dng", {"--denoise", "off", "--demosaic", "malvar"});
  const SceneLinear other = developed("night.dng", {"--denoise", "standard", "--demosaic", "malvar"});
  for (std::size_t k = 0; k < 3; ++k) {
    double worst = 0;
    for (std::size_t i = 0; i < one.plane[k].size(); ++i) {
      worst = std::max(worst, std::abs(static_cast<double>(one.plane[k].data()[i] - other.plane[k].data()[i])));
    }
    EXPECT_LT(worst, 20.0 / 61000) << k;  // a code either way, times 2.3 of white balance, times the matrix and filters
  }
}

TEST_F(DenoiseCommand, WritesMapsBesideIt) {
  ASSERT_EQ(denoised({"--maps"}).exit_code, 0);
  InlineExecutor one;
  const auto noise = capture::read_picture(file("clean.noise.pfm"), one);
  const auto confidence = capture::read_picture(file("clean.confidence.pfm"), one);
  ASSERT_TRUE(noise && confidence);
  EXPECT_EQ(noise->xyz.width(), 96);
  EXPECT_EQ(confidence->xyz.height(), 64);
  const auto again = denoised({"--maps"});
  EXPECT_EQ(again.exit_code, 1);
  std::filesystem::remove(file("clean.dng"));
  const auto map_in_the_way = denoised({"--maps"});
  EXPECT_EQ(map_in_the_way.exit_code, 1);
  EXPECT_NE(map_in_the_way.err.find("clean.noise.pfm exists"), std::string::npos) << map_in_the_way.err;
  EXPECT_FALSE(std::filesystem::exists(file("clean.dng")));
}

TEST_F(DenoiseCommand, ExplainsWhatItDecided) {
  const auto result = denoised({"--explain", "--denoise", "draft"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_NE(result.out.find("draft: given"), std::string::npos) << result.out;
  EXPECT_NE(result.out.find("stated by the file"), std::string::npos) << result.out;
}

TEST_F(DenoiseCommand, TheNoiseIsThatOfTheProfileIfThereIsOne) {
  const auto result = denoised({"--json", "--profile", std::string(LOWLUX_PROFILES) + "/ELD_NikonD850.json"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_EQ(Json::parse(result.out)[0]["denoise"]["noise_source"], "profile");
}

TEST_F(DenoiseCommand, RefusesWhatCannotBe) {
  const std::string night = file("night.dng");
  refused({"denoise", night, "-o", file("clean.tif")}, 2, "must end with .dng");
  refused({"denoise", file("missing.dng"), "-o", file("CLEAN.DNG")}, 1, "missing.dng");
  refused({"denoise", night, "-o", night}, 2, "would replace the input");
  refused({"denoise", night, "-o", file("clean.dng"), "--denoise", "off"}, 2, "none of auto");
  refused({"denoise", night, "-o", file("clean.dng"), "--denoise", "finest"}, 2, "is none of");
  refused({"denoise", night}, 2, "--output");
  refused({"denoise", file("missing.dng"), "-o", file("clean.dng")}, 1, "missing.dng");
  refused({"denoise", night, "-o", file("nowhere/clean.dng")}, 1, "nowhere");
}

TEST_F(DenoiseCommand, DoesNotReplaceAFileUnlessTold) {
  ASSERT_EQ(denoised().exit_code, 0);
  const std::string before = test::read_file(file("clean.dng"));
  const auto second = denoised({"--denoise", "draft"});
  EXPECT_EQ(second.exit_code, 1);
  EXPECT_NE(second.err.find("--force"), std::string::npos);
  EXPECT_EQ(test::read_file(file("clean.dng")), before);
  EXPECT_EQ(denoised({"--denoise", "draft", "--force"}).exit_code, 0);
}

TEST_F(DenoiseCommand, ManyFilesGoToAFolder) {
  std::filesystem::copy_file(file("night.dng"), file("other.dng"));
  const auto result = lowlux({"denoise", file("night.dng"), file("other.dng"), "-o", file("clean/")});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_TRUE(std::filesystem::exists(file("clean/night.dng")));
  EXPECT_TRUE(std::filesystem::exists(file("clean/other.dng")));
}

class DevelopDenoise : public DenoiseCommand {
 protected:
  static std::string real(const std::string& name) { return std::string(LOWLUX_TESTDATA) + "/raws/" + name; }
  Json report(const std::string& raw, const std::vector<std::string>& more) {
    std::vector<std::string> args{"develop", raw, "-o", file("out.png"), "--force", "--json", "--half"};
    args.insert(args.end(), more.begin(), more.end());
    const auto result = lowlux(args);
    EXPECT_EQ(result.exit_code, 0) << result.err;
    return result.exit_code == 0 ? Json::parse(result.out)[0] : Json();
  }
};

TEST_F(DevelopDenoise, TheNoiseOfARealFileThatStatesNoneIsMeasured) {
  const Json json = report(real("canon_kissx4_ml_colorchart.dng"), {});
  EXPECT_EQ(json["denoise"]["noise_source"], "picture");
  EXPECT_EQ(json["denoise"]["level"], "high");
  // Nothing is wrong that a photographer could mend: the figures are in the report, and no warning.
  EXPECT_EQ(json["denoise"]["noise_model"]["source"], "picture");
  EXPECT_GT(json["denoise"]["noise_model"]["gain_dn_per_e"], 0);
  EXPECT_EQ(json["warnings"], Json::array());
}

TEST_F(DevelopDenoise, WherePicturesTellNothingTheNoiseIsThatOfTheClassOfTheSensor) {
  const std::string raw = real("openisp_test_rggb10.dng");
  const Json json = report(raw, {});
  EXPECT_EQ(json["denoise"]["noise_source"], "sensor-class");
  EXPECT_NE(json["denoise"]["level"], "off");
  EXPECT_EQ(json["warnings"].size(), 1U);
  const Json& model = json["denoise"]["noise_model"];
  EXPECT_EQ(model["basis"], "small sensor, ISO not stated");
  EXPECT_GT(model["gain_factor"].get<double>(), 1.2);
  // It was processed before, and uses only every fourth code: its noise is measured, and not that of the class.
  EXPECT_LT(model["measured_over_expected"].get<double>(), 0.1);
  EXPECT_NE(model["unmeasurable"], "");
  EXPECT_NE(json["warnings"].dump().find("--noise GAIN,READ"), std::string::npos);
  const Json info = Json::parse(lowlux({"info", "--json", raw}).out)[0];
  EXPECT_EQ(info["noise_model"], model);
  EXPECT_EQ(info["noise_profile"], nullptr);  // of the file, which states none
}

TEST_F(DevelopDenoise, NoiseThatIsGivenIsUsedBeforeThatOfTheFile) {
  const Json json = report(file("night.dng"), {"--noise", "2,3.5"});
  EXPECT_EQ(json["denoise"]["noise_source"], "given");
  // Quantisation is not part of read noise: 3.5^2 + 1 / (12 * 2^2) e-^2, and the dark charge.
  EXPECT_GE(json["denoise"]["variance_e2"][1].get<double>(), 3.5 * 3.5 + 1.0 / 48 - 1e-6);
  for (const char* wrong : {"2", "2,3,4", "0,3", "-1,3", "nan,3", "2,-1", "2,x", "1e7,3", ""}) {
    const auto refused = lowlux({"develop", file("night.dng"), "-o", file("no.png"), "--noise", wrong});
    EXPECT_EQ(refused.exit_code, 2) << wrong;
    EXPECT_EQ(std::count(refused.err.begin(), refused.err.end(), '\n'), 1) << refused.err;
    EXPECT_FALSE(std::filesystem::exists(file("no.png")));
  }
}

TEST_F(DevelopDenoise, OffLeavesEverythingAsItIs) {
  const Json json = report(file("night.dng"), {"--denoise", "off"});
  EXPECT_EQ(json["denoise"]["level"], "off");
  EXPECT_EQ(json["denoise"]["reason"], "not asked for");
}

}  // namespace
}  // namespace lowlux
