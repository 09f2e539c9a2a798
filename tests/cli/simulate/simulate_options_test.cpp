#include <gtest/gtest.h>

#include <array>
#include <map>
#include <regex>
#include <span>
#include <stdexcept>

#include <nlohmann/json.hpp>

#include "isp/codec/pfm.h"
#include "tests/cli/command.h"
#include "tests/cli/simulate/simulate_command.h"

namespace lowlux {
namespace {

using test::holds;
using test::lowlux;

using Json = nlohmann::json;
using Words = std::vector<std::string>;

class SimulateOptions : public test::SimulateCommand {
 protected:
  /// The noise-free electrons of R, G and B of a flat under the light of a table.
  std::array<double, 3> electrons(const std::string& table) {
    scratch_.write("light.csv", table);
    simulated("flat", "flat.dng",
              {"--light", file("light.csv"), "--truth-electrons", file("flat.pfm"), "--no-truth", "--force"});
    const std::string bytes = test::read_file(file("flat.pfm"));
    const auto decoded = isp::decode_pfm(std::as_bytes(std::span(bytes)));
    if (!decoded) throw std::runtime_error(decoded.error().message);
    const auto& plane = std::get<SceneLinear>(decoded->picture).plane;
    return {plane[0].at(5, 5), plane[1].at(5, 5), plane[2].at(5, 5)};
  }
  /// Decisions on the effects of a flat's only region.
  std::map<std::string, Json> decisions(const std::string& effects) {
    const auto json = Json::parse(simulated("flat", "flat.dng",
                                            {"--effects", effects, "--json", "--force", "--prnu", "0.01", "--dsnu",
                                             "0.1", "--dark-current", "50", "--exposure", "1"})
                                      .out);
    std::map<std::string, Json> out;
    for (const Json& decision : json["regions"][0]["effects"]) out[decision["effect"]] = decision;
    return out;
  }
};

TEST_F(SimulateOptions, TheListSaysWhichSensorsNeedMoreFigures) {
  const std::string list = lowlux({"simulate", "--list"}).out;
  EXPECT_TRUE(holds(list, "analog gain 1 (needs --peak-qe); analog gain 16 (needs --system-gain, --peak-qe)")) << list;
  EXPECT_TRUE(std::regex_search(list, std::regex("\n  QHY600 +\\(needs --system-gain, --read-noise, --peak-qe\\)\n")));
  EXPECT_TRUE(std::regex_search(list, std::regex("\n  thesis +G=141.67\n")));
}

TEST_F(SimulateOptions, ACameraThatIsChosenIsNoAssumption) {
  const auto assumed = [this](const std::string& name, const Words& options) {
    Words words{"--sensor", "HWK4123_low_gain"};
    words.insert(words.end(), options.begin(), options.end());
    return holds(simulated("flat", name, words).out, "the colours of a Nikon_D5100");
  };
  EXPECT_TRUE(assumed("a.dng", {}));
  EXPECT_FALSE(assumed("b.dng", {"--camera", "Nikon_D5100"}));
}

TEST_F(SimulateOptions, SaturationIsThatOfD65AndThereIsNoneInNoTime) {
  EXPECT_TRUE(std::regex_search(simulated("flat", "a.dng").out, std::regex("saturates at [0-9.e+]+ cd/m2 of D65\n")));
  EXPECT_FALSE(holds(simulated("flat", "b.dng", {"--exposure", "0"}).out, "saturates"));
  const Json json = Json::parse(simulated("flat", "c.dng", {"--exposure", "0", "--json"}).out);
  EXPECT_FALSE(json.contains("saturation_luminance_cd_m2"));
}

TEST_F(SimulateOptions, AListOfEffectsToLeaveOutIsAllButThose) {
  auto found = decisions("-prnu");
  EXPECT_EQ(found["prnu"]["kept"], false);
  for (const char* kept : {"photon-noise", "dark-current", "dsnu", "read-noise"}) EXPECT_EQ(found[kept]["kept"], true);
  EXPECT_EQ(found, decisions("all,-prnu"));
}

TEST_F(SimulateOptions, DsnuIsLeftOutWithDarkCurrentAndTheReasonSaid) {
  auto found = decisions("all,-dark-current");
  EXPECT_EQ(found["dsnu"]["kept"], false);
  EXPECT_EQ(found["dsnu"]["reason"], "has no effect without dark current");
  EXPECT_EQ(found["dark-current"]["reason"], "as asked");
  EXPECT_EQ(decisions("all")["dsnu"]["reason"], "as asked");
  EXPECT_EQ(decisions("photon-noise,clipping")["dsnu"]["reason"], "as asked");
}

// A light that rises by a factor of 5 from 380 to 780 nm.
std::string rising_light(int step_nm) {
  std::string text = "nm,light\n";
  for (int nm = 380; nm <= 780; nm += step_nm) {
    text += std::to_string(nm) + "," + std::to_string(1 + (nm - 380) / 100.0) + "\n";
  }
  return text;
}

TEST_F(SimulateOptions, ALightGivesTheSameElectronsHoweverFewNodesItsTableHas) {
  const auto expected = electrons(rising_light(5));  // 81 nodes
  for (const int step_nm : {400, 100, 50, 10}) {     // 2, 5, 9 and 41
    const auto found = electrons(rising_light(step_nm));
    // Linear between equal nodes it is the same light; floats and the table's six digits are what is left, 1e-6.
    for (int k = 0; k < 3; ++k) EXPECT_NEAR(found[k] / expected[k], 1, 1e-5) << step_nm << " nm, channel " << k;
  }
}

// Between 200 and 2500 nm alone are nodes added, so that no table asks for more of them than memory holds.
TEST_F(SimulateOptions, ALightReachesAsFarAsItLikes) {
  const auto expected = electrons("nm,light\n300,1\n900,1\n"), found = electrons("nm,light\n1e-6,1\n1e12,1\n");
  for (int k = 0; k < 3; ++k) EXPECT_NEAR(found[k] / expected[k], 1, 1e-6) << k;  // floats
}

TEST_F(SimulateOptions, AFineTableKeepsItsNodes) {
  // A line of 2 nm between nodes 1 nm apart, off the grid of 5 nm: resampled to that grid it would be lost.
  const auto line = electrons("nm,light\n400,0\n521,0\n522,1\n523,0\n700,0\n");
  const auto alone = electrons("nm,light\n521,0\n522,1\n523,0\n");
  for (int k = 0; k < 3; ++k) EXPECT_NEAR(line[k] / alone[k], 1, 1e-6) << k;  // floats
}

// An address space of 600 MB holds the program (not one with sanitizers) and no frame of 16384 x 16384 pixels.
TEST_F(SimulateOptions, WithoutMemoryItSaysSoInOneLine) {
  const auto confined = [](const std::string& words) {
    return test::run_process({"sh", "-c", "ulimit -v 600000; exec " + test::tested_command() + " " + words});
  };
  if (confined("--version").exit_code != 0) GTEST_SKIP() << "a program with sanitizers needs terabytes of addresses";
  const auto result = confined("simulate flat --size 16384x16384 -o " + file("a.dng"));
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_EQ(result.err, "lowlux: not enough memory\n");
  EXPECT_TRUE(scratch_.names().empty());
}

}  // namespace
}  // namespace lowlux
