#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "isp/model/appearance/cao.h"
#include "isp/model/appearance/entropy_model.h"
#include "isp/model/appearance/hunt.h"
#include "isp/model/appearance/icam06.h"
#include "isp/model/appearance/khan_pattanaik.h"
#include "isp/model/appearance/kwak.h"
#include "isp/model/appearance/mikamo.h"
#include "isp/model/appearance/wanat_mantiuk.h"
#include "isp/model/vision/mesopic.h"
#include "tests/hard_cases/hard_case.h"
#include "tests/hard_cases/model_pictures.h"
#include "tests/reference/exact_ref.h"
#include "tests/support/numbers.h"
#include "tests/support/sweep.h"

// Models of appearance: sections 2 to 4 of the mesopic specification.
namespace lowlux::hard_cases {
namespace {

using isp::Xyz;
using test::inf;
using test::nan;

constexpr std::string_view appearance_group = "Mesopic vision";
constexpr double eps = std::numeric_limits<double>::epsilon();
const Matrix3 srgb_to_xyz{{{0.4124, 0.3576, 0.1805}, {0.2126, 0.7152, 0.0722}, {0.0193, 0.1192, 0.9505}}};

double relative(double found, double expected) {
  return std::abs(found - expected) / std::max(std::abs(expected), 1e-300);
}

TEST(HardCaseMesopic, HuntsRodSignal) {
  model_row({appearance_group, "2.1 Hunt: L_AS of 1e-9 to 1e4, none, below 1600 K, S below 0",
             "50 digits; 1 - j^2 cancels to 4 eps / (2 u / 1e-5), to the fourth", "relative to 16 eps"},
            {1, rounding}, [](Denormals m) {
              const auto found = [&](double l_as, double s) {
                return in_mode(m, [&] { return isp::rod_signal(isp::rod_adaptation(l_as), s); });
              };
              double worst = std::abs(found(0, 1) - 0.3) + std::abs(found(1, -3) - 0.3);
              for (const double l_as : test::ratios(1e-9, 1e4, 10)) {
                for (const double s : {1e-6, 0.2, 1.0, 10.0}) {
                  keep_worst(worst, relative(found(l_as, s), reference::hunt_rod_signal(l_as, s)) / (16 * eps));
                }
              }
              return worst + in_mode(m, [] { return isp::scotopic_adaptation(2, 1500); });
            });
}

TEST(HardCaseMesopic, KwaksPower) {
  model_row({appearance_group, "2.2 Kwak: cones from -100 to 1e9, odd", "50 digits; power 0.42 of a double",
             "relative to 16 eps"},
            {1, rounding}, [](Denormals m) {
              double worst = 0;
              for (const double cone : {-100.0, -1e-9, 0.0, 1e-30, 1e-9, 1.0, 100.0, 1e9}) {
                const double found = in_mode(m, [&] { return isp::ciecam02_response(0.3, cone); });
                const double expected = reference::ciecam02_response(0.3, cone);
                keep_worst(worst, expected == 0 ? std::abs(found) : relative(found, expected) / (16 * eps));
              }
              const double dark = in_mode(m, [] { return isp::kwak_lightness(-1, 1, 0.2, 0.69); });
              return worst + std::abs(dark);
            });
}

// Without rods both signals vanish with light, and their ratio does not.
TEST(HardCaseMesopic, KwaksLightnessWithoutRods) {
  model_row({appearance_group, "2.2 Kwak: lightness at alpha 0 and F_L of 1e-15 to 1, negative cones",
             "responses in 50 digits", "relative to 16 eps"},
            {1, rounding}, [](Denormals m) {
              constexpr Vector3 white{95, 101, 108};
              const double power = 0.69 * (1.48 + std::sqrt(0.2));
              const auto signal = [](double level, const Vector3& c) {
                return 2 * reference::ciecam02_response(level, c[0]) + reference::ciecam02_response(level, c[1]) +
                       0.05 * reference::ciecam02_response(level, c[2]);
              };
              double worst = 0;
              for (const double level : {1e-15, 1e-9, 1e-4, 1.0}) {
                for (const Vector3& c : {Vector3{19, 20, 22}, {95, 101, 108}, {30, 15, -5}, {-40, -30, 2}}) {
                  const double found = in_mode(m, [&] {
                    return isp::kwak_lightness(isp::kwak_achromatic(level, c, 0, 0),
                                               isp::kwak_achromatic(level, white, 0, 0), 0.2, 0.69);
                  });
                  const double ratio = signal(level, c) / signal(level, white);
                  const double expected = ratio > 0 ? 100 * std::pow(ratio, power) : 0;
                  keep_worst(worst, expected == 0 ? std::abs(found) : relative(found, expected) / (16 * eps));
                }
              }
              return worst;
            });
}

TEST(HardCaseMesopic, KhansResponseAndItsInverse) {
  model_row({appearance_group, "2.3 Khan: intensities of 1e-12 to 1e3, none, and back",
             "50 digits, and the intensity itself", "relative to 64 eps"},
            {1, rounding}, [](Denormals m) {
              const auto rods = in_mode(m, [] { return isp::khan_rods(0.03); });
              double worst = std::abs(in_mode(m, [&] { return isp::khan_response(rods, -1); }));
              for (const double i : test::ratios(1e-12, 1e3, 10)) {
                const double r = in_mode(m, [&] { return isp::khan_response(rods, i); });
                keep_worst(worst, relative(r, reference::pattanaik_rods(0.03, i)) / (64 * eps));
                // Near B an error of the response is B / (B - R) times that of the intensity, over n.
                const double steep = 1 / (0.73 * (1 - r / rods.bleaching));
                const double back = in_mode(m, [&] { return isp::khan_intensity(rods, r); });
                keep_worst(worst, relative(back, i) / (64 * eps * steep));
              }
              return worst;
            });
}

// Conditions of 15 to 17, twice, which add up: rounding seldom takes the worst direction of both.
TEST(HardCaseMesopic, CaosMatricesThereAndBack) {
  model_row({appearance_group, "2.4 Cao: 1e-4 to 100 cd/m2 and back, condition 17", "closed form: the identity",
             "largest element off"},
            {17 * 2 * eps, rounding}, [](Denormals m) {
              const auto receptors = isp::cao_receptors(srgb_to_xyz, isp::scotopic_weights);
              double worst = 0;
              for (const double from : {1e-4, 0.1, 0.3, 2.0, 100.0}) {
                const auto there = in_mode(m, [&] { return *isp::cao_retargeting(from, 1, receptors); });
                const auto back = in_mode(m, [&] { return *isp::cao_retargeting(1, from, receptors); });
                const Matrix3 one = reference::product(back, there);
                for (int i = 0; i < 3; ++i) {
                  for (int j = 0; j < 3; ++j) keep_worst(worst, std::abs(one[i][j] - (i == j ? 1 : 0)));
                }
              }
              return worst;
            });
}

TEST(HardCaseMesopic, WanatsExponentAndLuminance) {
  model_row({appearance_group, "2.5 Wanat: no light, negative channels, exponents held to 0..4",
             "closed form: luminance stays", "relative to 4 eps"},
            {1, rounding}, [](Denormals m) {
              const Vector3 weights{0.2126, 0.7152, 0.0722};
              double worst = 0;
              for (const auto& light :
                   {std::pair{1e9, 1e-12}, {1e-12, 1e9}, {0.0, 0.0}, {0.0, 1.0}, {1.0, 0.0}, {0.1, 100.0}}) {
                const double e = in_mode(m, [&] { return isp::wanat_exponent(light.first, light.second); });
                if (!(e >= 0 && e <= 4)) return inf;
                for (const Vector3& rgb :
                     {Vector3{0.6, 0.3, 0.1}, {0.6, -0.05, 0.1}, {-0.3, -0.2, 0.1}, {1e-30, 1e-30, 2e-30}}) {
                  const Vector3 out = in_mode(m, [&] { return isp::wanat_saturated(rgb, e, weights); });
                  const auto luminance = [&](const Vector3& c) {
                    return weights[0] * c[0] + weights[1] * c[1] + weights[2] * c[2];
                  };
                  keep_worst(worst, relative(luminance(out), luminance(rgb)) / (4 * eps));
                }
                const Vector3 black = in_mode(m, [&] { return isp::wanat_saturated({0, 0, 0}, e, weights); });
                keep_worst(worst, std::abs(black[0]) + std::abs(black[1]) + std::abs(black[2]));
              }
              return worst;
            });
}

TEST(HardCaseMesopic, MikamoInTheDark) {
  model_row({appearance_group, "2.8 Mikamo: 0 Td, powers of 0", "closed form: the coefficients of 1e-4 Td",
             "largest difference"},
            0, [](Denormals m) {
              const auto zero = in_mode(m, [] { return isp::mikamo_coefficients(0); });
              const auto least = in_mode(m, [] { return isp::mikamo_coefficients(1e-4); });
              double worst = 0;
              for (int i = 0; i < 3; ++i) {
                keep_worst(worst, std::abs(zero.shift_nm[i] - least.shift_nm[i]));
                keep_worst(worst, std::abs(zero.red_green[i] - least.red_green[i]));
                keep_worst(worst, std::abs(zero.blue_yellow[i] - least.blue_yellow[i]));
              }
              return worst;
            });
}

// Compression by the power 0.7 of what is near its floor: an error of R is that of I times R / (0.7 I).
TEST(HardCaseMesopic, Icam06AndBack) {
  model_row({appearance_group, "2.9 iCAM06: white of 1e-6 to 1e4 cd/m2 and back", "closed form: the colour itself",
             "relative to white"},
            {1.5e-11, rounding}, [](Denormals m) {
              double worst = 0;
              for (const double white : {1e-6, 1e-3, 0.1, 10.0, 1e4}) {
                const isp::Icam06State state{white, white};
                for (const Vector3& rgb : {Vector3{0.5, 0.2, 0.1}, {1, 1, 1}, {0, 0, 0}, {1e-3, 1e-3, 2e-3}}) {
                  Vector3 xyz = srgb_to_xyz * rgb;
                  for (double& v : xyz) v *= white;
                  const Vector3 back =
                      in_mode(m, [&] { return isp::icam06_expand(isp::icam06_compress(xyz, state).xyz_tc, state); });
                  for (int i = 0; i < 3; ++i) keep_worst(worst, std::abs(back[i] - xyz[i]) / white);
                }
              }
              return worst;
            });
}

// The fit stops at a gradient of 1e-10 (spec 3.2).
TEST(HardCaseMesopic, EntropyOfWhatNoSpectrumGives) {
  model_row({appearance_group, "3.2 largest entropy: moments outside the hull, rods alone, gamma 1e-4",
             "its gradient in 50 digits", "gradient"},
            {1e-10, rounding}, [](Denormals m) {
              isp::NodePower even{};
              even.fill(1);
              double worst = 0;
              for (const double adaptation : {0.0, 0.48, 1.0}) {
                const isp::EntropyModel model = *isp::entropy_model(adaptation, even, {});
                for (const Vector3& eta : {Vector3{0.1, 0.9, 0.1}, {0.6, 0.57, 0.1}, {0.0, 0.0, 1.0}}) {
                  for (const double gamma : {2.0, 1e-2, 1e-4}) {
                    const auto fit =
                        in_mode(m, [&] { return isp::fit_max_entropy<3>(model.explained, eta, identity3(), gamma); });
                    if (!fit) return nan;
                    keep_worst(worst, reference::entropy_gradient(model.explained.f, model.explained.weight_nm,
                                                                  fit->theta, eta, gamma));
                  }
                }
              }
              return worst;
            });
}

// Noise from a thousandth to a thousand times the signal, equal in R, G and B behind the matrix of sRGB.
TEST(HardCaseMesopic, EntropyOfNoisyPixels) {
  model_row(
      {appearance_group, "spectral model: noise of 1e-3 to 1e3 times the signal", "its gradient in 50 digits",
       "gradient"},
      {1e-10, rounding}, [](Denormals m) {
        isp::NodePower even{};
        even.fill(1);
        const Matrix3 noise = isp::noise_covariance_of_xyz({.variance_e2 = {1, 1, 1}, .camera_to_xyz = srgb_to_xyz});
        double worst = 0;
        for (const double adaptation : {0.0, 0.48, 1.0}) {
          const isp::EntropyModel model = *isp::entropy_model(adaptation, even, {.noise_covariance = noise});
          for (const Vector3& eta : {Vector3{0.1, 0.9, 0.1}, {0.6, 0.57, 0.1}, {0.0, 0.0, 1.0}}) {
            for (double ratio = 1e-3; ratio < 2e3; ratio *= 10) {
              const double variance = 0.09 * ratio * ratio;  // the eye's weight of an even spectrum is 0.3
              const auto fit = in_mode(m, [&] { return isp::entropy_fit(model, eta, variance); });
              if (!fit) return nan;
              const Vector3 by_noise = model.noise * fit->theta;
              Vector3 target = eta;
              for (std::size_t c = 0; c < 3; ++c) target[c] -= variance * by_noise[c];
              keep_worst(worst, reference::entropy_gradient(model.explained.f, model.explained.weight_nm, fit->theta,
                                                            target, model.gamma));
            }
          }
        }
        return worst;
      });
}

TEST(HardCaseMesopic, EveryModelKeepsFiniteColoursFinite) {
  HardCase row({appearance_group, "every model: black, negative, 1e-300 and 1e300, in light of 1e-11 to 1e12 cd/m2",
                "finite figures", "results that are not finite; images with values that are not finite (file)"});
  row.on(Path::reference, 0, [](Denormals m) {
    double wrong = 0;
    for (const isp::AppearanceModel& model : isp::appearance_models()) {
      for (const double white : {1e-11, 1e-3, 0.1, 30.0, 1e12}) {
        const auto map = in_mode(m, [&] { return model.at({.white_cd_m2 = white}); });
        if (!map) return inf;
        for (const Xyz& c : {Xyz{0, 0, 0},
                             {-1, -1, -1},
                             {1, 0, 0},
                             {0, 0, 1},
                             {0.3, -0.2, 0.4},
                             {1e300, 1e300, 1e300},
                             {-1e300, 1, 1},
                             {1e-300, 2e-300, 1e-300}}) {
          const Xyz out = in_mode(m, [&] { return (*map)(c); });
          wrong += std::isfinite(out.x) && std::isfinite(out.y) && std::isfinite(out.z) ? 0 : 1;
        }
      }
    }
    return wrong;
  });
  row.none(levels, "looks come after").none(instruction_sets, through_tables);
  row.on(Path::file, 0, [](Denormals m) { return models_through_file(m); });
  row.none(Path::live, no_models);
}

TEST(HardCaseMesopic, PicturesAreWhatTheModelsSay) {
  HardCase row({appearance_group, "tables of models: every one of `develop --look`, 768 colours at 0.05 and 2 cd/m2",
                "the table in plain double (sets); the model itself, from which a hundredth may be farther off (file)",
                "relative (sets), CIEDE2000 (file)"});
  row.none(Path::reference, "is the reference itself").none(levels, "looks come after");
  // Float: 2^-24 in each of ten steps and in the place within a cell, times the number of cells, 32
  // (colour_table_test.cpp).
  row.on_each_set({42 * 0x1p-24, rounding}, tables_against_reference);
  row.on(Path::file, 0.5, pictures_against_models);  // ColourTableRequest::error_bound
  row.none(Path::live, no_models);
}

}  // namespace
}  // namespace lowlux::hard_cases
