#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "isp/cli/develop/cost_file.h"
#include "isp/cli/shared/machine.h"
#include "tests/cli/command.h"
#include "tests/cli/simulate/simulate_command.h"
#include "tests/support/reference_cost.h"

namespace lowlux {
namespace {

using test::lowlux;

using Json = nlohmann::json;

/// `develop` of a simulated night, with a kept speed of this machine, so that none is measured.
class EffectsCommand : public test::SimulateCommand {
 protected:
  void SetUp() override {
    simulated("chart:macbeth", "night.dng", {"--luminance", "0.2", "--size", "160x120", "--no-truth"});
    setenv("XDG_CACHE_HOME", file("cache").c_str(), 1);
    keep_speed(0);
  }
  /// This machine, as the tested command names it: that of another build may lack kernels that the tests have.
  static std::string machine_of_command() {
    const std::string version = lowlux({"--version"}).out, label = "kernels: ";
    const std::size_t start = version.find(label) + label.size();
    std::string name = cli::machine_name();
    const std::string own = fmt::format(", {}, lowlux ", cli::this_machine(1).kernels);
    return name.replace(name.rfind(own), own.size(),
                        fmt::format(", {}, lowlux ", version.substr(start, version.find('\n', start) - start)));
  }
  /// @param pace_s  0: it is not looked how busy the machine is
  void keep_speed(double pace_s, const std::string& machine = machine_of_command()) {
    isp::CostModel model = *test::reference_cost();
    model.machine = machine;
    model.threads = cli::threads_of_each(1);
    model.pace_s = pace_s;
    std::filesystem::create_directories(file("cache/lowlux"));
    std::ofstream(*cli::cost_file(model.threads)) << cli::cost_text(model);
  }
  void TearDown() override { unsetenv("XDG_CACHE_HOME"); }
  test::ProcessResult developed(const std::vector<std::string>& more) {
    std::vector<std::string> args{"develop", file("night.dng"), "-o", file("out.png"), "--force"};
    args.insert(args.end(), more.begin(), more.end());
    return lowlux(args);
  }
  Json effects_of(std::vector<std::string> more) {
    more.emplace_back("--json");
    const auto result = developed(more);
    EXPECT_EQ(result.exit_code, 0) << result.err;
    const Json json = Json::parse(result.out, nullptr, false);
    return json.is_array() && !json.empty() ? json[0]["effects"] : Json();
  }
  void refused(const std::vector<std::string>& more, int code, const std::string& why) {
    std::filesystem::remove(file("out.png"));
    const auto result = developed(more);
    EXPECT_EQ(result.exit_code, code) << result.err;
    EXPECT_NE(result.err.find(why), std::string::npos) << why << "\n" << result.err;
    EXPECT_FALSE(std::filesystem::exists(file("out.png")));
  }
};

TEST_F(EffectsCommand, AreDecidedWithinATolerance) {
  const Json strict = effects_of({"--tolerance", "0.01"}), loose = effects_of({"--tolerance", "90"});
  EXPECT_EQ(strict["mode"], "auto");
  EXPECT_EQ(strict["effects"][0]["name"], "noise");
  EXPECT_EQ(strict["effects"][0]["used"], true);
  EXPECT_EQ(loose["effects"][0]["used"], false);
  EXPECT_LT(loose["effects"][0]["left_ciede2000"].get<double>(), 90);
  EXPECT_EQ(effects_of({})["tolerance_ciede2000"], 0.5);
  EXPECT_EQ(effects_of({"--effects", "all"})["mode"], "all");
}

TEST_F(EffectsCommand, FitABudgetThatIsToldWithThePrediction) {
  const Json small = effects_of({"--budget-ms", "3"}), large = effects_of({"--budget-ms", "100000"});
  EXPECT_EQ(small["budget_s"], 0.003);
  EXPECT_LE(small["predicted_s"].get<double>(), 0.003);
  EXPECT_GT(large["predicted_s"].get<double>(), small["predicted_s"].get<double>());
  EXPECT_TRUE(large["effects"][0]["decision"].get<std::string>().starts_with("best"));
  EXPECT_TRUE(small["tolerance_ciede2000"].is_null());
  // 160 x 120 pixels at so many megapixels in a second.
  EXPECT_NEAR(effects_of({"--budget-mpps", "1.92"})["budget_s"].get<double>(), 0.01, 1e-12);
  const auto told = developed({"--budget-ms", "100000", "--explain"});
  EXPECT_NE(told.out.find("predicted"), std::string::npos) << told.out;
}

// Also of what is left out; another machine's times are not believed.
TEST_F(EffectsCommand, StateTheirTimeWithoutABudget) {
  const Json strict = effects_of({"--tolerance", "0.01"}), loose = effects_of({"--tolerance", "90"});
  EXPECT_TRUE(strict["pace"].is_null());
  EXPECT_GT(strict["predicted_s"].get<double>(), loose["predicted_s"].get<double>());
  EXPECT_EQ(loose["effects"][0]["used"], false);
  EXPECT_GT(loose["effects"][0]["predicted_s"].get<double>(), 0);
  EXPECT_DOUBLE_EQ(loose["effects"][0]["predicted_s"].get<double>(), strict["effects"][0]["predicted_s"].get<double>());
  const std::string told = developed({"--tolerance", "90", "--explain"}).out;
  EXPECT_NE(told.find("would take"), std::string::npos) << told;
  EXPECT_NE(told.find("for one file at a time"), std::string::npos) << told;
  // Of several files too, as one at a time takes it.
  std::filesystem::copy(file("night.dng"), file("again.dng"));
  const auto two =
      lowlux({"develop", file("night.dng"), file("again.dng"), "-o", file("two/"), "--json", "--jobs", "2"});
  const Json both = Json::parse(two.out, nullptr, false);
  ASSERT_EQ(both.size(), 2) << two.err;
  EXPECT_EQ(both[1]["effects"]["predicted_s"], effects_of({})["predicted_s"]);
  keep_speed(0, "another machine");
  EXPECT_FALSE(cli::kept_cost(cli::threads_of_each(1)));
  EXPECT_TRUE(effects_of({})["predicted_s"].is_null());
  EXPECT_NE(developed({"--explain"}).out.find("bench --calibrate-cost"), std::string::npos);
}

TEST_F(EffectsCommand, RefuseWhatCannotBe) {
  refused({"--budget-ms", "0.001"}, 1, "cheapest plan");
  refused({"--budget-ms", "0"}, 2, "--budget-ms");
  refused({"--budget-ms", "nan"}, 2, "--budget-ms");
  refused({"--budget-ms", "5", "--budget-mpps", "5"}, 2, "mutually exclusive");
  refused({"--budget-ms", "5", "--jobs", "2"}, 2, "--jobs");
  refused({"--effects", "all", "--tolerance", "1"}, 2, "--tolerance");
  refused({"--effects", "all", "--budget-ms", "5"}, 2, "budget");
  refused({"--effects", "hue"}, 2, "--look eye");
  refused({"--tolerance", "0"}, 2, "--tolerance");
}

// A machine calibrated when it took 1000 s for what takes it some hundredths now.
TEST_F(EffectsCommand, GoByTheMachinesPace) {
  const Json calibrated = effects_of({"--budget-ms", "1000"});
  EXPECT_TRUE(calibrated["pace"].is_null());
  keep_speed(1000);
  const Json now = effects_of({"--budget-ms", "1000"});
  EXPECT_GT(now["pace"].get<double>(), 0);
  EXPECT_LT(now["pace"].get<double>(), 0.01);
  EXPECT_LT(now["predicted_s"].get<double>(), 0.01 * calibrated["predicted_s"].get<double>());
  const auto told = developed({"--budget-ms", "1000", "--explain"});
  EXPECT_NE(told.out.find("times as long as when its speed was measured"), std::string::npos) << told.out;
  keep_speed(0);
  EXPECT_EQ(developed({"--budget-ms", "1000", "--explain"}).out.find("when its speed was measured"), std::string::npos);
}

// A budget does not wait for a measurement.
TEST_F(EffectsCommand, AreEstimatedWhereThisMachineWasNotMeasured) {
  keep_speed(0, "another");
  const auto estimated = developed({"--budget-ms", "100000", "--explain"});
  ASSERT_EQ(estimated.exit_code, 0) << estimated.err;
  EXPECT_EQ(std::count(estimated.err.begin(), estimated.err.end(), '\n'), 1) << estimated.err;
  for (const std::string& said : {std::string("rough estimates until `lowlux bench --calibrate-cost`"),
                                  "another machine: another, and this is " + machine_of_command()}) {
    EXPECT_NE(estimated.err.find(said), std::string::npos) << estimated.err;
  }
  EXPECT_NE(estimated.out.find("times that of two cores"), std::string::npos) << estimated.out;
  EXPECT_EQ(developed({"--budget-ms", "100000", "--quiet"}).err, "");
  std::filesystem::remove_all(file("cache"));
  EXPECT_NE(developed({"--budget-ms", "100000"}).err.find("rough estimates"), std::string::npos);
  EXPECT_FALSE(std::filesystem::exists(file("cache"))) << "an estimate is not kept";
  EXPECT_EQ(developed({"--budget-ms", "100000", "--json"}).exit_code, 0);
}

TEST_F(EffectsCommand, GoByWhatWasCalibrated) {
  if (std::getenv("LOWLUX_NIGHTLY") == nullptr) GTEST_SKIP() << "runs with LOWLUX_NIGHTLY";
  std::filesystem::remove_all(file("cache"));
  const auto calibrated = lowlux({"bench", "--calibrate-cost", "--json"});
  ASSERT_EQ(calibrated.exit_code, 0) << calibrated.err;
  const int threads = cli::threads_of_each(1);
  EXPECT_EQ(test::read_file(*cli::cost_file(threads)), calibrated.out);
  const auto kept = cli::kept_cost(threads);
  ASSERT_TRUE(kept) << kept.error().message;
  EXPECT_GT(kept->pace_s, 0);
  for (int i = 0; i < isp::cost_parts; ++i) EXPECT_FALSE(kept->points[static_cast<std::size_t>(i)].empty()) << i;
  const auto told = developed({"--budget-ms", "1000", "--json"});
  EXPECT_EQ(told.err, "");  // not measured again
  EXPECT_GT(Json::parse(told.out)[0]["effects"]["pace"].get<double>(), 0);
}

TEST_F(EffectsCommand, AKeptSpeedIsBelievedOfThisMachineFormatAndNumberOfThreadsAlone) {
  keep_speed(0, cli::machine_name());
  const int threads = cli::threads_of_each(1);
  const std::string path = *cli::cost_file(threads), good = test::read_file(path);
  const auto kept = cli::kept_cost(threads);
  ASSERT_TRUE(kept) << kept.error().message;
  EXPECT_EQ(cli::cost_text(*kept), good);
  const auto refused_with = [&](const std::string& from, const std::string& to, const std::string& why) {
    std::string text = good;
    ASSERT_NE(text.find(from), std::string::npos) << from;
    text.replace(text.find(from), from.size(), to);
    std::ofstream(path) << text;
    const auto model = cli::kept_cost(threads);
    ASSERT_FALSE(model) << to;
    EXPECT_NE(model.error().message.find(why), std::string::npos) << model.error().message;
  };
  refused_with("\"lowlux_cost_model\": 7", "\"lowlux_cost_model\": 6", "lowlux_cost_model");
  const Json machine = cli::machine_name();
  refused_with(machine.dump(), "\"\"", "another machine");
  refused_with(" processors", "0 processors", "another machine");
  refused_with(", lowlux ", ", lowlux 9", "another machine");  // other versions may be faster
  refused_with(fmt::format("\"threads\": {}", threads), fmt::format("\"threads\": {}", threads + 1), "threads");
  refused_with(good, "", "no cost model");
  std::filesystem::remove(path);
  const auto none = cli::kept_cost(threads);
  ASSERT_FALSE(none);
  EXPECT_EQ(none.error().code, ErrorCode::not_found);
}

TEST(CostFile, TextComesBackAndFaultsAreNamed) {
  isp::CostModel model = *test::reference_cost();
  model.pace_s = 0.0125;
  const auto back = cli::parse_cost(cli::cost_text(model));
  ASSERT_TRUE(back) << back.error().message;
  EXPECT_EQ(back->machine, model.machine);
  EXPECT_EQ(back->threads, model.threads);
  EXPECT_EQ(back->pace_s, model.pace_s);
  for (int i = 0; i < isp::cost_parts; ++i) {
    const auto part = static_cast<isp::CostPart>(i);
    EXPECT_DOUBLE_EQ(back->seconds(part, {3, 3}), model.seconds(part, {3, 3})) << name_of(part);
  }
  const std::string good = cli::cost_text(model);
  const auto changed = [&](const std::string& from, const std::string& to) {
    std::string text = good;
    text.replace(text.find(from), from.size(), to);
    return text;
  };
  for (const std::string& text :
       {std::string(), std::string("[]"), std::string("{\"lowlux_cost_model\": 7}"), good.substr(0, good.size() / 2),
        changed("\"lowlux_cost_model\": 7", "\"x\": 1"), changed("\"threads\": 2", R"("threads": "2")"),
        changed("\"threads\": 2", "\"threads\": 0"), changed("\"threads\": 2", "\"threads\": 4294967298"),
        changed("\"look\"", "\"loop\""), changed("9.009", "-1"), changed("9.009", "1e999"), changed("0.0125", "-1"),
        changed("\"pace_s\"", "\"race_s\"")}) {
    const auto wrong = cli::parse_cost(text);
    ASSERT_FALSE(wrong) << text;
    EXPECT_NE(wrong.error().message.find("--calibrate-cost"), std::string::npos);
  }
}

// A machine is as fast as it is now, not as it was when it was calibrated.
TEST(MachineSpeed, GoesByThePaceOfNow) {
  PoolExecutor executor(2);
  isp::CostModel model = *test::reference_cost();
  const auto unknown = cli::MachineSpeed(model).now(executor);
  ASSERT_TRUE(unknown);
  EXPECT_EQ((*unknown)->pace, 1);
  for (const double calibrated_s : {1e-6, 1e3}) {
    model.pace_s = calibrated_s;
    const auto now = cli::MachineSpeed(model).now(executor);
    ASSERT_TRUE(now);
    EXPECT_EQ(calibrated_s<1, (*now)->pace> 1) << (*now)->pace;
    EXPECT_GT((*now)->pace, 0);
    const double calm = model.seconds(isp::CostPart::high_0, {2, 2});
    EXPECT_NEAR((*now)->seconds(isp::CostPart::high_0, {2, 2}) / calm, (*now)->pace, 1e-12 * (*now)->pace);
  }
}

}  // namespace
}  // namespace lowlux
