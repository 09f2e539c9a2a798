// What live frames tell of their sensor's noise, on pictures behind a lens.
#include <gtest/gtest.h>

#include <cstdio>
#include <cstdlib>
#include <optional>
#include <span>
#include <string_view>

#include "isp/raw/tile_noise.h"
#include "tests/sensor_bench/picture_raw.h"
#include "tests/support/tile_columns.h"

namespace lowlux::isp {
namespace {

// A sensor of 10 bits as phones have it: 0.24 DN/e-, 2 e-. Detail only adds. Half a megapixel full of texture (a wall
// of shingles, leaves) has no flat place of each level; the bounds were set above what the pictures give: they guard
// against worse.
TEST(TileNoiseOfPictures, GainIsWithinAFifthButWhereTextureIsEverywhere) {
  constexpr double gain_dn = 0.24, black_dn = 64;
  const SensorModel sensor{.name = "tile noise",
                           .system_gain_dn_per_e = gain_dn,
                           .read_noise_e = 2,
                           .full_well_e = 15000,
                           .bits = 10,
                           .black_level_dn = black_dn,
                           .white_level_dn = 1023};
  const auto most_of = [](std::string_view name, double mean_e) {
    if (name == "kodim05.png") return mean_e > 50 ? 1.0 : 0.6;
    if (name == "kodim08.png") return mean_e > 50 ? 0.7 : 0.4;
    return name == "StillLife.exr" ? 0.4 : 0.2;
  };
  const bool nightly = std::getenv("LOWLUX_NIGHTLY") != nullptr;
  InlineExecutor one;
  for (const char* name : std::span(test::clean_pictures).first(nightly ? test::clean_pictures.size() : 3)) {
    const auto light = test::picture_light(name, one, 0.9);
    ASSERT_TRUE(light) << light.error().message;
    for (const double mean_e : {20.0, 100.0}) {
      const RawDn raw = test::take_picture(*light, sensor, {.mean_green_e = mean_e}, one);
      TileNoise tiles(raw.active.width, raw.active.height, 16);
      ASSERT_TRUE(raw.active.width == raw.dn.width() && raw.active.height == raw.dn.height());
      test::measure(raw.dn, tiles);
      const std::optional<NoiseLine> line = tiles.line({black_dn, black_dn, black_dn, black_dn}, 1023);
      ASSERT_TRUE(line) << name;
      std::printf("%-14s %4.0f e-: gain %+5.1f %%, offset %.3f DN^2\n", name, mean_e,
                  100 * (line->gain_dn / gain_dn - 1), line->offset_dn2);
      EXPECT_GT(line->gain_dn, 0.95 * gain_dn) << name << " at " << mean_e;
      EXPECT_LT(line->gain_dn, (1 + most_of(name, mean_e)) * gain_dn) << name << " at " << mean_e;
    }
  }
}

}  // namespace
}  // namespace lowlux::isp
