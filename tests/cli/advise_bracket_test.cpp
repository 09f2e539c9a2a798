#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "tests/cli/command.h"
#include "tests/cli/simulate/simulate_command.h"

namespace lowlux {
namespace {

using test::holds;
using test::lowlux;
using Json = nlohmann::json;
using Words = std::vector<std::string>;

class AdviseBracket : public test::SimulateCommand {
 protected:
  void scene(const std::string& name, const Words& more) {
    Words words{"--luminance", "0.5", "--exposure", "0.1", "--sensor", "HWK4123_low_gain", "--no-truth"};
    words.insert(words.end(), more.begin(), more.end());
    ASSERT_EQ(simulate(LOWLUX_TESTDATA "/pictures/GoldenGate.exr", name, words).exit_code, 0);
  }
  Json advised(const std::string& name, const Words& more = {}) {
    Words words{"info", "--advise", file(name), "--json"};
    words.insert(words.end(), more.begin(), more.end());
    const auto result = lowlux(words);
    EXPECT_EQ(result.exit_code, 0) << result.err;
    return Json::parse(result.out);
  }
};

TEST_F(AdviseBracket, FramesTakenByTheAdviceMergeToThePredictedRatio) {
  scene("one.dng", {});
  const Json advice = advised("one.dng");
  ASSERT_TRUE(advice["bracket"]) << advice;
  std::string bracket_ev;
  Words merge{"merge", "-o", file("merged.dng"), "--json"};
  int count = 0;
  for (auto e = advice["exposures"].rbegin(); e != advice["exposures"].rend(); ++e) {
    for (int i = 0; i < (*e)["frames"].get<int>(); ++i, ++count) {
      bracket_ev += (count > 0 ? "," : "") + std::to_string(std::log2((*e)["exposure_s"].get<double>() / 0.1));
      merge.push_back(file("frame_000" + std::to_string(count) + ".dng"));
    }
  }
  ASSERT_LE(count, 10);
  scene("frame.dng", {"--bracket=" + bracket_ev, "--seed", "5"});
  const auto merged = lowlux(merge);
  ASSERT_EQ(merged.exit_code, 0) << merged.err;
  EXPECT_EQ(Json::parse(merged.out)["bracket"], true);
  const Json found = advised("merged.dng");
  // The raw shows its darkest tenth with the standard error of a block of 128 green pixels, and SNR goes with up to the
  // square of the signal.
  const double darkest_e = advice["darkest_e"], noise_e2 = advice["noise_variance_e2"];
  const double relative = std::sqrt((darkest_e + noise_e2) / 128) / darkest_e;
  EXPECT_NEAR(found["raw_snr_db"], advice["merged_snr_db"], 10 * std::log10(1 + 2 * relative));
  EXPECT_LE(found["saturated_fraction"], advice["saturated_fraction"].get<double>() / 2);
}

TEST_F(AdviseBracket, SaysExposuresReasonAndCommand) {
  scene("one.dng", {});
  const auto result = lowlux({"info", "--advise", file("one.dng"), "--snr", "12"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  for (const char* part : {"dB in the darkest tenth", "because", "exposures", "frames like this one would reach 12 dB",
                           "lowlux merge FRAME_1.dng"}) {
    EXPECT_TRUE(holds(result.out, part)) << part << '\n' << result.out;
  }
  const Json limited = advised("one.dng", {"--motion", "100", "--blur", "1", "--max-exposure", "0.02"});
  EXPECT_EQ(limited["longest_exposure_s"], 0.01);
  EXPECT_LE(limited["exposures"].back()["exposure_s"], 0.01 + 1e-12);
  EXPECT_FALSE(limited["bracket"]);
  EXPECT_GE(limited["merged_snr_db"], 20 - 1e-9);
}

TEST_F(AdviseBracket, RefusesWhatIsForASensorAndWhatCannotBe) {
  scene("one.dng", {});
  const std::string raw = file("one.dng");
  struct Case {
    Words words;
    int exit_code;
    const char* says;
  };
  for (const Case& c : std::vector<Case>{{{raw, "--luminance", "1"}, 2, "--luminance needs --sensor"},
                                         {{raw, "--report", "x.html"}, 2, "--report needs --sensor"},
                                         {{}, 2, "needs --sensor"},
                                         {{raw, "--snr", "90"}, 2, "--snr is not within"},
                                         {{raw, "--clip", "0"}, 2, "--clip is not within"},
                                         {{raw, "--max-exposure", "0"}, 2, "--max-exposure is not above 0"},
                                         {{raw, "--motion", "3"}, 2, "must be given together"},
                                         {{raw, "--max-exposure", "1e-5", "--snr", "60"}, 1, "more than 9999 frames"},
                                         {{raw, "--snr", "10", "--sensor", "thesis", "--max-exposure", "1"},
                                          2,
                                          "--snr and --sensor are mutually exclusive"}}) {
    Words words{"info", "--advise"};
    words.insert(words.end(), c.words.begin(), c.words.end());
    const auto result = lowlux(words);
    EXPECT_EQ(result.exit_code, c.exit_code) << testing::PrintToString(words) << result.err;
    EXPECT_TRUE(holds(result.err, c.says)) << testing::PrintToString(words) << result.err;
    EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
    EXPECT_EQ(result.out, "");
  }
}

}  // namespace
}  // namespace lowlux
