#include "calib/dark/dark_library.h"

#include <string>

#include <gtest/gtest.h>

#include "tests/sensor_bench/sensor_bench.h"

namespace lowlux::calib {
namespace {

RawDn dark(double iso, double time_s, double celsius, int width = 64) {
  const test::SensorBench bench{.sensor = test::modern_small(), .width = width, .height = 32};
  RawDn raw = bench.frame({time_s, celsius}, 0);
  raw.info.iso = iso;
  return raw;
}

TEST(DarkSorter, PutsFramesTogetherInWhateverOrderTheyCome) {
  DarkSorter sorter;
  for (const double iso : {800.0, 100.0}) {
    ASSERT_TRUE(sorter.add(dark(iso, 2, 20)));
    ASSERT_TRUE(sorter.add(dark(iso, 1, 20)));
    ASSERT_TRUE(sorter.add(dark(iso, 2, 30)));
    ASSERT_TRUE(sorter.add(dark(iso, 2, 20.9)));  // within a degree of the first
  }
  const auto sets = sorter.sets();
  ASSERT_EQ(sets.size(), 2U);
  EXPECT_EQ(sets[0].iso, 100);
  EXPECT_EQ(sets[1].iso, 800);
  for (const DarkSet& set : sets) {
    ASSERT_EQ(set.groups.size(), 3U);
    EXPECT_EQ(set.groups[0].setting.exposure_s, 1);
    EXPECT_EQ(set.groups[1].frames, 2);
    EXPECT_EQ(set.groups[2].setting.temperature_c, 30);
  }
}

TEST(DarkSorter, RefusesAnotherSizeWhateverTheGain) {
  DarkSorter sorter;
  ASSERT_TRUE(sorter.add(dark(100, 1, 20)));
  const auto other = sorter.add(dark(200, 1, 20, 66));
  ASSERT_FALSE(other);
  EXPECT_NE(other.error().message.find("66 x 32"), std::string::npos);
}

TEST(DarkSorter, HoldsABoundedNumberOfSettings) {
  DarkSorter sorter;
  for (int i = 1; i <= 16; ++i) ASSERT_TRUE(sorter.add(dark(100 * i, 1, 20)));
  EXPECT_EQ(sorter.add(dark(1700, 1, 20)).error().code, ErrorCode::too_large);
  for (int i = 2; i <= 32; ++i) ASSERT_TRUE(sorter.add(dark(100, i, 20)));
  EXPECT_EQ(sorter.add(dark(100, 33, 20)).error().code, ErrorCode::too_large);
}

}  // namespace
}  // namespace lowlux::calib
