#include "isp/raw/measure/saturation_level.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <random>
#include <vector>

#include "tests/support/frames.h"

namespace lowlux::isp::saturation_level_test {
namespace {

using Rgb = std::array<double, 3>;

constexpr int width = 480, height = 320;

double drawn(std::mt19937& random, double low, double high) {
  return std::uniform_real_distribution<double>(low, high)(random);
}

double drawn_log(std::mt19937& random, double low, double high) {
  return std::exp(drawn(random, std::log(low), std::log(high)));
}

/// A sensor that saturates at a fraction of its white level, at codes that scatter.
struct Sensor {
  double white_dn = 4095;
  double black_dn = 128;
  double full_e = 30000;  // at white
  double read_noise_dn = 2;
  double saturation = 1;  // fraction of white
  double scatter_dn = 0;  // of the level
  bool has_noise = true;  // of the light

  double range_dn() const { return white_dn - black_dn; }
  double level_dn() const { return black_dn + saturation * range_dn(); }

  static Sensor draw(std::mt19937& random) {
    const int bits = std::uniform_int_distribution<int>(10, 14)(random);
    Sensor out{.white_dn = std::exp2(bits) - 1, .full_e = drawn_log(random, 5000, 100000)};
    out.black_dn = drawn(random, 0, 0.1) * out.white_dn;
    out.read_noise_dn = drawn_log(random, 1, 20) * out.range_dn() / out.full_e;
    return out;
  }
};

/// Light of each colour through its filter as a fraction of white, at a pixel.
using Light = std::function<double(int x, int y, int colour)>;

RawDn frame_of(const Sensor& sensor, const Light& light, std::mt19937& random) {
  std::normal_distribution<double> normal;
  const auto phase = static_cast<BayerPhase>(random() % 4);
  RawDn out = test::bayer_frame(width, height, phase, [&](int x, int y) {
    const double fraction = light(x, y, static_cast<int>(colour_at(phase, x, y)));
    const double shot = sensor.has_noise ? std::sqrt(std::max(fraction, 0.0) / sensor.full_e) * normal(random) : 0;
    const double dn = sensor.range_dn() * (fraction + shot);
    const double level = sensor.range_dn() * sensor.saturation + sensor.scatter_dn * normal(random);
    const double read = sensor.has_noise ? sensor.read_noise_dn * normal(random) : 0;
    const bool is_saturated = dn >= level;
    const double code = sensor.black_dn + (is_saturated ? level : dn + read);
    return static_cast<int>(std::lround(std::clamp(code, 0.0, sensor.white_dn)));
  });
  out.white_dn = {sensor.white_dn, sensor.white_dn, sensor.white_dn};
  return out;
}

std::optional<SaturationLevel> found_in(const RawDn& raw, const Sensor& sensor) {
  const double black = sensor.black_dn;
  return measure_saturation_below_white(raw, {.pedestal_dn = {black, black, black, black}}, std::nullopt);
}

/// Filters of a camera under some light: green passes most.
Rgb drawn_filters(std::mt19937& random) { return {drawn(random, 0.3, 0.9), 1, drawn(random, 0.3, 0.9)}; }

struct Lamp {
  double x, y, radius, peak;
  Rgb colour;
};

std::vector<Lamp> drawn_lamps(std::mt19937& random, int count, double peak_low, double peak_high) {
  std::vector<Lamp> out;
  for (int i = 0; i < count; ++i) {
    const Rgb colour{drawn_log(random, 0.3, 3), 1, drawn_log(random, 0.2, 2)};
    out.push_back({drawn(random, 0, width), drawn(random, 0, height), drawn_log(random, 4, 20),
                   drawn_log(random, peak_low, peak_high), colour});
  }
  return out;
}

/// A dim scene, and lamps with the glare of a lens around them.
Light night(std::vector<Lamp> lamps, const Rgb& filters, double dim) {
  return [lamps = std::move(lamps), filters, dim](int x, int y, int colour) {
    const auto c = static_cast<std::size_t>(colour);
    double sum = dim * (1 + 0.5 * std::sin(x / 37.0) * std::cos(y / 23.0));
    for (const Lamp& lamp : lamps) {
      const double distance = std::hypot(x - lamp.x, y - lamp.y) / lamp.radius;
      sum += lamp.peak * lamp.colour[c] * std::pow(1 + distance * distance, -1.5);
    }
    return filters[c] * sum;
  };
}

TEST(SaturationLevel, IsFoundInNightsOfAnySensor) {
  for (unsigned seed = 1; seed <= 30; ++seed) {
    std::mt19937 random(seed);
    Sensor sensor = Sensor::draw(random);
    sensor.saturation = drawn(random, 0.75, 0.985);
    sensor.scatter_dn = drawn(random, 0, 0.002) * sensor.range_dn();
    const Rgb filters = drawn_filters(random);
    const Light light = night(drawn_lamps(random, 20, 2, 100), filters, drawn_log(random, 0.01, 0.3));
    SCOPED_TRACE(testing::Message() << "seed " << seed << ": white " << sensor.white_dn << " saturates at "
                                    << sensor.level_dn() << " +- " << sensor.scatter_dn << " full " << sensor.full_e);
    const auto found = found_in(frame_of(sensor, light, random), sensor);
    EXPECT_TRUE(found);
    if (!found) continue;
    // Light just below saturation belongs to the peak as well, below its middle.
    const double tolerance_dn = 1 + 0.25 * sensor.scatter_dn + 0.0005 * sensor.range_dn();
    EXPECT_NEAR(found->mean_dn, sensor.level_dn(), tolerance_dn);
    EXPECT_NEAR(found->std_dn, sensor.scatter_dn, 1 + 0.3 * sensor.scatter_dn);
  }
}

/// Sensors of scenes in which nothing saturates: of any number of bits, with the noise of light and without.
Sensor drawn_for_surfaces(std::mt19937& random) {
  Sensor out = Sensor::draw(random);
  if (random() % 3 == 0) out = {.white_dn = 255, .black_dn = drawn(random, 0, 16), .read_noise_dn = 0.5};
  out.full_e = drawn_log(random, 5000, 1e6);
  out.has_noise = random() % 2 == 0;
  return out;
}

/// Checks that no level is found in scenes of `make`, for filters that differ, that are alike, and that make white
/// surfaces magenta.
void expect_none(const char* what, const std::function<Light(std::mt19937&, const Rgb& filters, double top)>& make) {
  for (unsigned seed = 1; seed <= 18; ++seed) {
    std::mt19937 random(seed);
    const Sensor sensor = drawn_for_surfaces(random);
    const double magenta = drawn(random, 0.3, 0.9);
    const Rgb filters = std::array{drawn_filters(random), Rgb{1, 1, 1}, Rgb{1, magenta, 1}}[seed % 3];
    const double top = drawn(random, 0.76, 0.98);
    const RawDn raw = frame_of(sensor, make(random, filters, top), random);
    EXPECT_FALSE(found_in(raw, sensor)) << what << ": seed " << seed << ", white " << sensor.white_dn << ", top "
                                        << sensor.black_dn + top * sensor.range_dn()
                                        << (sensor.has_noise ? "" : ", no noise");
  }
}

/// A dim room of surfaces of many colours.
double room(int x, int y, std::size_t c) {
  const int surface = x / 40 * 7 + y / 40;
  return (0.05 + 0.4 * x / width) * (0.4 + 0.6 * ((surface * static_cast<int>(c + 2) * 37) % 100) / 100.0);
}

bool is_wall(int x, int y) { return x >= 120 && x < 360 && y >= 80 && y < 240; }

TEST(SaturationLevel, IsNotThatOfSurfacesThatAreEvenlyLit) {
  expect_none("a wall", [](std::mt19937&, const Rgb& filters, double top) {
    return [=](int x, int y, int c) { return filters[c] * (is_wall(x, y) ? top : room(x, y, c)); };
  });
  expect_none("a wall of equal codes in a room of other colours", [](std::mt19937&, const Rgb& filters, double top) {
    return [=](int x, int y, int c) { return is_wall(x, y) ? top : filters[c] * room(x, y, c); };
  });
  expect_none("a wall with pictures, print and stripes", [](std::mt19937&, const Rgb& filters, double top) {
    return [=](int x, int y, int c) {
      const bool is_picture = (x / 16 + y / 16) % 2 == 0, is_print = y % 24 < 8 && (x * 7 + y * 3) % 11 < 4;
      const bool is_stripe = y >= 200 && x % 2 == 0;
      if (!is_wall(x, y)) return filters[c] * room(x, y, c);
      return (is_picture ? room(x, y, c) : is_print || is_stripe ? 0.1 : 1.0) * top;
    };
  });
}

TEST(SaturationLevel, IsNotThatOfChartsOfFewLevels) {
  for (const int levels : {2, 3, 5}) {
    expect_none("a chart", [levels](std::mt19937& random, const Rgb& filters, double top) {
      std::vector<Rgb> patches(24 * 16);
      for (Rgb& patch : patches) {
        for (double& value : patch) value = static_cast<double>(random() % levels + 1) / levels;
      }
      return [=](int x, int y, int c) { return filters[c] * top * patches[x / 20 + 24 * (y / 20)][c]; };
    });
  }
}

TEST(SaturationLevel, IsNotThatOfLampsOutOfFocusThatDoNotSaturate) {
  expect_none("discs", [](std::mt19937& random, const Rgb& filters, double top) {
    return [lamps = drawn_lamps(random, 20, 1, 2), filters, top](int x, int y, int c) {
      for (const Lamp& lamp : lamps) {
        const double largest = *std::ranges::max_element(lamp.colour);
        const double edge = lamp.radius - std::hypot(x - lamp.x, y - lamp.y);
        if (edge > 0) return filters[c] * top * std::min(1.0, edge) * lamp.colour[c] / largest;
      }
      return filters[c] * 0.02;
    };
  });
  expect_none("discs of one green", [](std::mt19937& random, const Rgb& filters, double top) {
    return [lamps = drawn_lamps(random, 6, 1, 2), filters, top](int x, int y, int c) {
      for (const Lamp& lamp : lamps) {
        if (std::hypot(x - lamp.x, y - lamp.y) < 2 * lamp.radius)
          return filters[c] * top * std::min(1.0, lamp.colour[c]);
      }
      return filters[c] * 0.02;
    };
  });
}

TEST(SaturationLevel, IsNotThatOfSkies) {
  expect_none("a sky", [](std::mt19937& random, const Rgb& filters, double top) {
    const double horizon = drawn(random, 100, 300), blue = drawn(random, 0.3, 1);
    return [=](int x, int y, int c) {
      const double height_px = (horizon - y) / horizon;  // brightest at the horizon
      const Rgb sky{1 - blue * height_px, 1 - 0.5 * blue * height_px, 1};
      return filters[c] * (y > horizon ? room(x, y, c) : top * sky[c] * (1 - 0.3 * height_px * height_px));
    };
  });
}

TEST(SaturationLevel, IsOneOfAllColoursBetweenThreeQuartersAndWhite) {
  for (unsigned seed = 1; seed <= 3; ++seed) {
    SCOPED_TRACE(testing::Message() << "seed " << seed);
    std::mt19937 random(seed);
    Sensor sensor = Sensor::draw(random);
    const Rgb filters = drawn_filters(random);
    const Light light = night(drawn_lamps(random, 20, 2, 100), filters, 0.1);
    const auto is_found = [&](double saturation, const Light& of) {
      sensor.saturation = saturation;
      sensor.scatter_dn = 0.001 * sensor.range_dn();
      return found_in(frame_of(sensor, of, random), sensor).has_value();
    };
    EXPECT_TRUE(is_found(0.9, light));
    EXPECT_FALSE(is_found(1, light)) << "at white";
    EXPECT_FALSE(is_found(0.994, light)) << "at white";
    EXPECT_FALSE(is_found(0.7, light)) << "too low: half of the range would be white";
    sensor.has_noise = false;
    const auto is_found_below = [&](const std::function<double(int colour)>& end) {
      return is_found(1, [&](int x, int y, int c) { return std::min(light(x, y, c), end(c)); });
    };
    EXPECT_TRUE(is_found_below([](int) { return 0.9; }));
    EXPECT_FALSE(is_found_below([](int c) { return Rgb{0.95, 0.9, 0.93}[c]; })) << "each colour has a level of its own";
    EXPECT_FALSE(is_found_below([&](int) { return random() % 20 == 0 ? 0.94 : 0.9; })) << "some pixels are brighter";
    sensor.has_noise = true;
    const Light white = night(drawn_lamps(random, 0, 1, 1), {0.3, 1, 0.4}, 1);
    EXPECT_FALSE(is_found(0.9, white)) << "one colour alone";
    Sensor scattered = sensor;
    scattered.saturation = 0.9;
    scattered.scatter_dn = 0.005 * sensor.range_dn();
    EXPECT_FALSE(found_in(frame_of(scattered, light, random), scattered)) << "as wide as the noise of light";
    const RawDn scattering = frame_of({.saturation = 0.9, .scatter_dn = 8}, light, random);
    const auto is_found_in_noise = [&](double light_dn) {
      NoiseProfile noise;
      noise.offset.fill(light_dn * light_dn / (Sensor().range_dn() * Sensor().range_dn()));
      return measure_saturation_below_white(scattering, {.pedestal_dn = {128, 128, 128, 128}}, noise).has_value();
    };
    EXPECT_TRUE(is_found_in_noise(20));
    EXPECT_FALSE(is_found_in_noise(12)) << "the light of an even surface may be as narrow";
    const Light grey = night(drawn_lamps(random, 6, 2, 5), {1, 1, 1}, 0.6);
    EXPECT_FALSE(is_found(0.9, grey)) << "the colours of everything else agree";
  }
}

TEST(SaturationLevel, IsThatOfMosaicsOfCodes) {
  const Sensor sensor{.saturation = 0.9};
  const auto made = [&] {
    std::mt19937 random(1);
    return frame_of(sensor, night(drawn_lamps(random, 20, 2, 100), {0.6, 1, 0.5}, 0.1), random);
  };
  RawDn raw = made();
  ASSERT_TRUE(found_in(raw, sensor));
  for (const int side : {1, 2, 3, 5}) {
    raw.active = {0, 0, side, side};
    EXPECT_FALSE(found_in(raw, sensor)) << side;
  }
  RawDn mono = made();
  mono.layout = SensorLayout::monochrome;
  EXPECT_FALSE(found_in(mono, sensor));
  RawDn floats = made();
  floats.dn_float = Plane<float>(width, height);
  EXPECT_FALSE(found_in(floats, sensor));
}

}  // namespace
}  // namespace lowlux::isp::saturation_level_test
