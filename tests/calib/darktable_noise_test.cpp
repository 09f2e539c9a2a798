#include "calib/noise/darktable_noise.h"

#include <cmath>
#include <string>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "calib/noise/sensor_class.h"

namespace lowlux::calib {
namespace {

std::string entry(const char* iso, const char* a, const char* b, const char* more = "") {
  return fmt::format(R"({{"name": "x", "iso": {}, "a": [9e-6, {}, 9e-6], "b": [1e-7, {}, 1e-7]{}}})", iso, a, b, more);
}

std::string table_of(const std::string& entries, const char* maker = "Acme", const char* model = "Acme One") {
  return fmt::format(
      R"({{"version": 0, "noiseprofiles": [{{"maker": "{}", "models": [{{"model": "{}", "profiles": [{}]}}]}}]}})",
      maker, model, entries);
}

DarktableTable parsed(const std::string& json) {
  auto table = parse_darktable_noise(json);
  EXPECT_TRUE(table) << table.error().message;
  return table ? *table : DarktableTable{};
}

TEST(DarktableNoise, IsTheGreenOfEachSettingByRisingIso) {
  const auto table = parsed(table_of(entry("400", "8e-6", "-1e-8") + "," + entry("100", "2e-6", "1e-9")));
  ASSERT_EQ(table.size(), 1U);
  EXPECT_EQ(table[0].maker, "Acme");
  EXPECT_EQ(table[0].model, "Acme One");
  ASSERT_EQ(table[0].settings.size(), 2U);
  EXPECT_EQ(table[0].settings[0].iso, 100);
  EXPECT_EQ(table[0].settings[0].a, 2e-6);
  EXPECT_EQ(table[0].settings[1].b, -1e-8);
}

TEST(DarktableNoise, LeavesOutEntriesThatAreSkippedOrNoNoise) {
  const std::string good = entry("100", "2e-6", "1e-9");
  for (const std::string& bad :
       {entry("200", "4e-6", "1e-9", R"(, "skip": true)"), entry("200", "0", "1e-9"), entry("200", "-1", "0"),
        entry("200", "1e300", "0"), entry("-200", "4e-6", "0"), entry("200", "4e-6", "5"), std::string("{}"),
        std::string(R"({"iso": 200, "a": [1e-6], "b": [0]})"), std::string(R"({"iso": "200", "a": null})")}) {
    const auto table = parsed(table_of(bad + "," + good));
    ASSERT_EQ(table.size(), 1U) << bad;
    EXPECT_EQ(table[0].settings.size(), 1U) << bad;
  }
}

TEST(DarktableNoise, RefusesFilesThatAreNotTables) {
  const std::string deep = std::string(100'000, '[') + std::string(100'000, ']');
  const std::string nan = table_of(entry("100", "NaN", "0"));
  for (const std::string& json : {std::string(), std::string("{"), std::string("[]"), std::string("{}"), deep, nan,
                                  table_of(""), table_of(entry("100", "1e999", "0")), std::string(1, '\0')}) {
    EXPECT_FALSE(parse_darktable_noise(json)) << json.substr(0, 80);
  }
}

TEST(DarktableNoise, RefusesAMillionEntries) {
  std::string entries;
  const std::string one = R"({"iso":100,"a":[1e-6,1e-6,1e-6],"b":[0,0,0]},)";
  for (int i = 0; i < 300'000; ++i) entries += one;
  entries.pop_back();
  const auto more = parse_darktable_noise(table_of(entries));
  ASSERT_FALSE(more);
  EXPECT_EQ(more.error().code, ErrorCode::too_large);
  EXPECT_FALSE(parse_darktable_noise(std::string(max_darktable_bytes + 1, ' ')));
}

TEST(DarktableNoise, GivesTheElectronsAtWhiteOfItsCoefficient) {
  const auto table = parsed(table_of(entry("100", "2e-6", "1e-10") + "," + entry("400", "8e-6", "1e-9")));
  const auto at = find_darktable_noise(table, "ACME CORPORATION", "Acme One", 100, 10'000);
  ASSERT_TRUE(at);
  EXPECT_DOUBLE_EQ(at->figures.gain_dn_per_e, 10'000 * 2e-6 / darktable_a_of_variance);
  EXPECT_EQ(at->figures.gain_factor, darktable_gain_factor);
  EXPECT_FALSE(at->is_beyond);
  const auto between = find_darktable_noise(table, "Acme", "one", 200, 10'000);
  ASSERT_TRUE(between);
  EXPECT_NEAR(between->figures.gain_dn_per_e, 2 * at->figures.gain_dn_per_e, 1e-12);
  EXPECT_EQ(between->low_iso, 100);
  EXPECT_EQ(between->high_iso, 400);
  const auto beyond = find_darktable_noise(table, "Acme", "One", 1600, 10'000);
  ASSERT_TRUE(beyond);
  EXPECT_NEAR(beyond->figures.gain_dn_per_e, 16 * at->figures.gain_dn_per_e, 1e-12);
  EXPECT_NEAR(beyond->figures.gain_factor, darktable_gain_factor * 2, 1e-12);
  EXPECT_TRUE(beyond->is_beyond);
  EXPECT_FALSE(find_darktable_noise(table, "Acme", "One", 6400, 10'000));
  EXPECT_FALSE(find_darktable_noise(table, "Acme", "Two", 100, 10'000));
  EXPECT_FALSE(find_darktable_noise(table, "Other", "One", 100, 10'000));
  EXPECT_FALSE(find_darktable_noise(table, "Acme", "One", 0, 10'000));
  EXPECT_FALSE(find_darktable_noise(table, "Acme", "One", NAN, 10'000));
}

TEST(DarktableNoise, FindsTheReadNoiseInB) {
  constexpr double a = 2e-5, electrons = darktable_a_of_variance / a;
  const auto read_of = [](double read_noise_e) {
    const double b = darktable_a_of_variance * std::pow(read_noise_e / electrons, 2);
    const auto table = parsed(table_of(entry("100", "2e-5", fmt::format("{}", b).c_str())));
    return find_darktable_noise(table, "Acme", "One", 100, 1000)->figures.read_noise_e;
  };
  const double of_class = class_read_noise_e(electrons);
  EXPECT_NEAR(read_of(of_class * 1.5), of_class * 1.5, 1e-9 * of_class);
  EXPECT_NEAR(read_of(of_class * 5), of_class * read_noise_factor, 1e-9 * of_class);
  const auto negative = parsed(table_of(entry("100", "2e-5", "-1e-8")));
  EXPECT_NEAR(find_darktable_noise(negative, "Acme", "One", 100, 1000)->figures.read_noise_e, of_class, 1e-12);
}

TEST(DarktableNoise, KnowsCamerasByTheNamesOfTheirRegions) {
  const auto table = parsed(table_of(entry("100", "2e-6", "0"), "Canon", "EOS 550D"));
  for (const char* model : {"Canon EOS 550D", "Canon EOS Kiss X4", "Canon EOS REBEL T2i"}) {
    EXPECT_TRUE(find_darktable_noise(table, "Canon", model, 100, 1000)) << model;
  }
  EXPECT_FALSE(find_darktable_noise(table, "Canon", "Canon EOS 500D", 100, 1000));
  const auto nikon = parsed(table_of(entry("100", "2e-6", "0"), "Nikon", "D850"));
  EXPECT_TRUE(find_darktable_noise(nikon, "NIKON CORPORATION", "NIKON D850", 100, 1000));
  const auto pentax = parsed(table_of(entry("100", "2e-6", "0"), "Pentax", "K-1"));
  EXPECT_TRUE(find_darktable_noise(pentax, "RICOH IMAGING COMPANY, LTD.", "PENTAX K-1", 100, 1000));
}

}  // namespace
}  // namespace lowlux::calib
