#include "isp/cli/shared/option_values.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "tests/cli/command.h"
#include "tests/support/process.h"
#include "tests/support/scratch_directory.h"

namespace lowlux {
namespace {

using test::dog;

using Json = nlohmann::json;

struct Form {
  const char* text;
  const char* unit;
  double value;
};

TEST(OptionValues, NumbersAreReadAsPeopleAndThisProgramWriteThem) {
  for (const Form& form : {Form{"1.5", "EV", 1.5},
                           {"+1.5", "EV", 1.5},
                           {"-1.5", "EV", -1.5},
                           {"+1.76 EV", "EV", 1.76},
                           {"1EV", "EV", 1},
                           {"-2ev", "EV", -2},
                           {"+1/3", "EV", 1.0 / 3},
                           {"-2/3 EV", "EV", -2.0 / 3},
                           {".5", "", 0.5},
                           {"1e-3", "", 1e-3},
                           {"3000K", "K", 3000},
                           {"3000 k", "K", 3000},
                           {"1/60", "s", 1.0 / 60},
                           {"1/60 s", "s", 1.0 / 60},
                           {"4.5s", "s", 4.5},
                           {"f/2.8", "f/", 2.8},
                           {"F/2.8", "f/", 2.8},
                           {"2.8", "f/", 2.8},
                           {"0.05 cd/m2", "cd/m2", 0.05},
                           {"0.05", "cd/m2", 0.05}}) {
    const auto value = cli::quantity_of(form.text, form.unit);
    ASSERT_TRUE(value) << form.text;
    EXPECT_EQ(*value, form.value) << form.text;
  }
}

TEST(OptionValues, AnythingElseIsNoNumber) {
  for (const Form& form :
       {Form{"", "EV", 0},  {"EV", "EV", 0},   {" ", "EV", 0},      {"1,5", "EV", 0},     {"1.5.2", "EV", 0},
        {"++1", "EV", 0},   {"+-1", "EV", 0},  {"-+1", "EV", 0},    {"1 EV EV", "EV", 0}, {"1 s", "EV", 0},
        {"1/0", "s", 0},    {"1/-60", "s", 0}, {"1/", "s", 0},      {"/60", "s", 0},      {"1/60/2", "s", 0},
        {"nan", "s", 0},    {"inf", "s", 0},   {"1e999", "s", 0},   {"0x10", "s", 0},     {"f/", "f/", 0},
        {"2.8f/", "f/", 0}, {"1.5 EV", "", 0}, {"EV 1.5", "EV", 0}, {"1/1e-9", "s", 0}}) {
    EXPECT_FALSE(cli::quantity_of(form.text, form.unit)) << "'" << form.text << "' " << form.unit;
  }
}

class OptionForms : public testing::Test {
 protected:
  test::ProcessResult developed(const std::string& option, const std::string& value) const {
    return test::run_process({test::tested_command(), "develop", dog, "-o", scratch_.file("x.png"), "--force", "--half",
                              "--denoise", "off", "--json", option, value});
  }
  test::ScratchDirectory scratch_;
};

TEST_F(OptionForms, ExposureTakesWhatIsPrinted) {
  for (const char* text : {"1.5", "+1.5", "1.5EV", "+1.5 EV", "3/2"}) {
    const auto result = developed("--exposure", text);
    ASSERT_EQ(result.exit_code, 0) << text << result.err;
    EXPECT_EQ(Json::parse(result.out)[0]["exposure"]["ev"], 1.5) << text;
  }
  EXPECT_EQ(Json::parse(developed("--exposure", "-1EV").out)[0]["exposure"]["ev"], -1);
}

TEST_F(OptionForms, WhiteBalanceTakesKelvin) {
  const auto plain = developed("--wb", "3000"), unit = developed("--wb", "3000K");
  ASSERT_EQ(unit.exit_code, 0) << unit.err;
  EXPECT_EQ(Json::parse(plain.out)[0]["white_balance"], Json::parse(unit.out)[0]["white_balance"]);
}

TEST_F(OptionForms, ADecimalCommaGetsTheNumberWithAPoint) {
  for (const auto& [option, text, right] : std::vector<std::array<std::string, 3>>{{"--exposure", "1,5", "1.5"},
                                                                                   {"--exposure", "+1,5EV", "+1.5EV"},
                                                                                   {"--tolerance", "0,5", "0.5"},
                                                                                   {"--dark-noise", "0,1", "0.1"},
                                                                                   {"--budget-ms", "2,5", "2.5"}}) {
    const auto result = developed(option, text);
    EXPECT_EQ(result.exit_code, 2) << option;
    EXPECT_NE(result.err.find("write decimals with a point: " + right), std::string::npos) << result.err;
  }
  for (const auto& [option, text] :
       std::vector<std::array<std::string, 2>>{{"--exposure", "bright"}, {"--exposure", "1,2,3"}, {"--wb", "2,5"}}) {
    const auto result = developed(option, text);
    EXPECT_EQ(result.exit_code, 2) << option;
    EXPECT_EQ(result.err.find("decimals"), std::string::npos) << result.err;
  }
}

TEST_F(OptionForms, TheCommaBeforeATintIsNotTakenForADecimalComma) {
  for (const char* text : {"5000,151", "5000,-151"}) {
    const auto result = developed("--wb", text);
    EXPECT_EQ(result.exit_code, 2);
    EXPECT_NE(result.err.find("with a tint from -150 to 150"), std::string::npos) << result.err;
    EXPECT_EQ(result.err.find("decimals"), std::string::npos) << result.err;
  }
}

}  // namespace
}  // namespace lowlux
