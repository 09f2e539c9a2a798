#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <string_view>

#include "isp/model/appearance/kirk_obrien.h"
#include "isp/model/appearance/shin.h"
#include "tests/hard_cases/model_pictures.h"
#include "tests/reference/exact_ref.h"
#include "tests/support/numbers.h"
#include "tests/support/sweep.h"

// Models whose rods speak through opponent channels: sections 2.6, 2.7 and 4 of the mesopic specification.
namespace lowlux::hard_cases::opponent_hard_cases_test {
namespace {

using isp::Xyz;
using test::inf;

constexpr std::string_view opponent_group = "Mesopic vision";
constexpr double eps = std::numeric_limits<double>::epsilon();
const Matrix3 srgb_to_xyz{{{0.4124, 0.3576, 0.1805}, {0.2126, 0.7152, 0.0722}, {0.0193, 0.1192, 0.9505}}};

/// Of the gains and of the changes of opponent signals, over what the terms of each round to: some ten roundings, and
/// those of 1 + 0.33 (...), whose terms cancel to 1 / gain^2.
double error_of_kirk(const Vector3& cones_td, double rods_td, Denormals mode) {
  const auto found = in_mode(mode, [&] { return isp::kirk_opponent_gain({cones_td, rods_td}); });
  const reference::KirkChange expected = reference::kirk_change(cones_td, rods_td);
  double worst = 0, cancelled = 1;
  for (int i = 0; i < 3; ++i) {
    const double terms = 1 + 0.33 * (std::abs(cones_td[i]) + 0.4 * rods_td);
    const bool held = expected.gain[i] == 1000;
    cancelled = std::max(cancelled, held ? 1 : terms * expected.gain[i] * expected.gain[i]);
  }
  for (int i = 0; i < 3; ++i) {
    keep_worst(worst, std::abs(found.gain[i] / expected.gain[i] - 1) / (16 * eps * cancelled));
    keep_worst(worst, std::abs(found.opponent[i] - expected.opponent[i]) /
                          (16 * eps * cancelled * std::max(expected.magnitude[i], 1e-300)));
  }
  return worst;
}

TEST(HardCaseMesopic, KirksNegativeCones) {
  model_row({opponent_group, "2.6 Kirk: cones of -100 to 100 Td, gain held to 1000, no rods", "50 digits",
             "relative to 16 eps of its terms"},
            {1, rounding}, [](Denormals m) {
              double worst = 0;
              for (const double rods : {0.0, 1e-6, 1.0, 100.0}) {
                for (const double l : test::steps(-100, 100, 12.5)) {
                  for (const double s : test::steps(-100, 100, 12.5)) {
                    keep_worst(worst, error_of_kirk({l, -l, s}, rods, m));
                  }
                }
                // 1 + 0.33 (...) of 0.01, 1e-5 and below 1e-6.
                for (const double base : {0.01, 1e-5, 1e-7, -1e-7}) {
                  keep_worst(worst, error_of_kirk({(base - 1) / 0.33 - 0.25 * rods, 1, 1}, rods, m));
                }
              }
              return worst;
            });
}

isp::ShinCoefficients shin_at(double e) { return isp::shin_coefficients(isp::shin_substitute(), e); }

constexpr std::array<Vector3, 5> shin_colours{{{0.5, 0.2, 0.1}, {1, 0, 0}, {0, 0, 1}, {1, 1, 1}, {1e-6, 1e-6, 1e-6}}};

// The smallest coefficient is 0.1: condition 10, 4.6 of the cones, a root to 1e-14.
TEST(HardCaseMesopic, ShinForwardAndInverse) {
  model_row({opponent_group, "2.7, 4 Shin: 0.01 to 1000 lx and back, reds, Y' below 0",
             "closed form: the colour itself", "relative to white"},
            {1e-14, rounding}, [](Denormals m) {
              const isp::ShinEye eye = isp::shin_eye({});
              double worst = 0;
              for (const double e : {0.01, 0.1, 1.0, 7.0, 250.0, 1000.0}) {
                for (const Vector3& rgb : shin_colours) {
                  const Xyz c = isp::xyz_of(srgb_to_xyz * rgb);
                  const auto back = in_mode(
                      m, [&] { return isp::shin_inverse(isp::shin_forward(c, shin_at(e), eye), shin_at(e), eye); });
                  if (!back.exact) return inf;
                  const double off = std::max(
                      {std::abs(back.colour.x - c.x), std::abs(back.colour.y - c.y), std::abs(back.colour.z - c.z)});
                  keep_worst(worst, off);
                }
              }
              return worst;
            });
}

// Cones have next to no part in what is seen, so that no colour can come back: the answer is that of 0.05.
TEST(HardCaseMesopic, ShinWhereAlphaIsHeld) {
  model_row({opponent_group, "4 Shin: 1e-3 and 3e-3 lx, where alpha is held to 0.05",
             "the signals, by the limited coefficients", "relative to white"},
            {5e-14, rounding}, [](Denormals m) {
              const isp::ShinEye eye = isp::shin_eye({});
              double worst = 0;
              for (const double e : {1e-3, 3e-3}) {
                isp::ShinCoefficients held = shin_at(e);
                if (!(held.alpha < 0.05)) return inf;
                held.alpha = 0.05;
                for (const Vector3& rgb : shin_colours) {
                  const Xyz c = isp::xyz_of(srgb_to_xyz * rgb);
                  const isp::OpponentSignals signals = isp::shin_forward(c, shin_at(e), eye);
                  const auto back = in_mode(m, [&] { return isp::shin_inverse(signals, shin_at(e), eye); });
                  if (back.exact) return inf;
                  const isp::OpponentSignals again = isp::shin_forward(back.colour, held, eye);
                  keep_worst(worst, std::abs(again.a - signals.a));
                  keep_worst(worst, std::abs(again.rg - signals.rg));
                  keep_worst(worst, std::abs(again.by - signals.by));
                }
              }
              return worst;
            });
}

// Y' of white is 0 for X = 1.7788, Z = 0; L_w + M_w = Y_w.
TEST(HardCaseMesopic, WhitesThatLeaveRodsOrConesDark) {
  HardCase row({opponent_group, "2.7 Shin: whites of Y'_w = 0, L_w + M_w = 0, below 0, not a number", "an error",
                "of six, accepted"});
  row.on(Path::reference, 0, [](Denormals m) {
    double taken = 0;
    for (const Xyz& white : {Xyz{2.71012 / 1.52356, 1, 0}, Xyz{2, 1, 0.2}, Xyz{1, 0, 1}, Xyz{0, 0, 0},
                             Xyz{-0.95, -1, -1.09}, Xyz{0.95, NAN, 1.09}}) {
      taken += in_mode(m, [&] { return isp::shin_appearance().at({.white = white}); }) ? 1 : 0;
    }
    return taken;
  });
  row.none(levels, "looks come after").none(instruction_sets, through_tables);
  row.none(Path::file, "the white of images is D65").none(Path::live, no_models);
}

}  // namespace
}  // namespace lowlux::hard_cases::opponent_hard_cases_test
