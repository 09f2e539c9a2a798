#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <utility>
#include <vector>

#include "isp/bench/gamut_ratio.h"
#include "isp/model/colour_difference.h"
#include "isp/model/mesopic.h"
#include "isp/model/seeing.h"
#include "isp/model/spectral_divergence.h"
#include "isp/render/retarget.h"
#include "isp/render/retarget_rows.h"
#include "isp/render/retarget_table.h"
#include "tests/hard_cases/hard_case.h"
#include "tests/hard_cases/looks.h"
#include "tests/hard_cases/rendering.h"
#include "tests/reference/exact_ref.h"
#include "tests/reference/retarget_ref.h"
#include "tests/support/sweep.h"

// The state of adaptation, seeing, and what compares colours: section 4 of the sensor model; sections 0, 1, 4 and 5 of
// the mesopic specification.
namespace lowlux::hard_cases {
namespace {

using isp::Lab;
using isp::Xyz;

constexpr std::string_view group = "Colour and light", mesopic = "Mesopic vision";
constexpr std::string_view no_picture = "a measure of pictures, none itself";
constexpr double eps = std::numeric_limits<double>::epsilon();

void figures_row(const About& about, double bound, const Measure& measure, std::string_view reason = no_picture) {
  HardCase row(about);
  row.on(Path::reference, bound, measure);
  row.none(levels, reason).none(instruction_sets, reason).none(pipelines, reason);
}

double relative(double found, double expected) {
  return std::abs(found - expected) / std::max(std::abs(expected), 1e-300);
}

/// A row of the eye's look, whose grids are made by vector kernels: of a field that is seen as given.
void look_row(const About& about, const SeenField& field, double bound, const Measure& measure) {
  HardCase row(about);
  row.on(Path::reference, bound, measure).none(levels, "looks come after");
  // Tables of 256 luminances and 32 S/P, and straight lines between cells: night_look_test.cpp.
  row.on_each_set(0.03, [&](Denormals m) { return look_against_reference(field, m); });
  row.on(Path::file, 0, [&](Denormals m) { return look_through_file(field, m); });
  row.on(Path::live, 0, [&](Denormals m) { return look_through_live(field, m); });
}

constexpr std::string_view look_unit = "m (reference), parts of a grid of 0..1 (sets), wrong codes (file, live)";

TEST(HardCaseMesopic, NoLightAtAll) {
  look_row({mesopic, "1.1 both luminances 0", "closed form: m = 0, luminance 0, and code 0", look_unit},
           {.cd_m2 = 1, .rgb = {0, 0, 0}}, 0, [](Denormals m) {
             const auto state = in_mode(m, [] { return isp::mesopic_state({0, 0}); });
             return std::abs(state.m) + std::abs(state.luminance_cd_m2);
           });
}

// |h| of the answer is below 1e-12 (mesopic.cpp) and dh/dm is -1 or steeper where S/P is above 1.
TEST(HardCaseMesopic, TheCycleOfTwo) {
  look_row({mesopic, "1.1 S/P of 18 to 60, where the plain iteration never ends", "root by bisection in 50 digits",
            look_unit},
           {.cd_m2 = 0.7, .rgb = {0.02f, 0.3f, 0.9f}, .scotopic_ratio = 25}, 1.1e-12, [](Denormals m) {
             double worst = 0;
             for (const double ratio : {18.0, 25.0, 30.0, 50.0, 60.0}) {
               for (const double light : test::ratios(1e-3, 6, 1.7)) {
                 const auto state = in_mode(m, [&] { return isp::mesopic_state({light, ratio * light}); });
                 keep_worst(worst, std::abs(state.m - reference::mes2_root(light, ratio * light)));
               }
             }
             return worst;
           });
}

TEST(HardCaseMesopic, ThreeFixedPoints) {
  look_row({mesopic, "1.1 S/P of 0.05 to 0.26, where there may be three roots",
            "a + b log10 L - m in 50 digits at the answer, or 0 where it is not positive at 0", look_unit},
           {.cd_m2 = 0.04, .rgb = {0.9f, 0.3f, 0.0f}, .scotopic_ratio = 0.2}, 1.1e-12, [](Denormals m) {
             double worst = 0;
             for (const double ratio : {0.05, 0.1, 0.2, 0.26}) {
               for (const double light : test::ratios(1e-3, 6, 1.3)) {
                 const auto state = in_mode(m, [&] { return isp::mesopic_state({light, ratio * light}); });
                 const bool below = reference::mes2_residual(0, light, ratio * light) <= 0;
                 const bool above = reference::mes2_residual(1, light, ratio * light) >= 0;
                 const double expected = below ? 0 : 1;
                 keep_worst(worst, below || above ? std::abs(state.m - expected)
                                                  : std::abs(reference::mes2_residual(state.m, light, ratio * light)));
               }
             }
             return worst;
           });
}

// By the weights, exactly: three products and two sums.
TEST(HardCaseMesopic, NegativeScotopicLuminance) {
  look_row({mesopic, "0.1 saturated reds: negative scotopic luminance",
            "closed form: 0, and the weighted sum elsewhere", look_unit},
           {.cd_m2 = 0.3, .rgb = {0.9f, -0.01f, -0.02f}}, 8 * eps, [](Denormals m) {
             const auto found = [&](const Xyz& c) { return in_mode(m, [&] { return isp::scotopic_luminance(c); }); };
             double worst = found({1, 0.3, 0}) + found({0.64, 0.33, 0.03});
             for (const Xyz& c : {Xyz{0.95, 1, 1.09}, {0.2, 0.1, 1}}) {
               keep_worst(worst, relative(found(c), -1.52356 * c.x + 2.71012 * c.y + 1.09735 * c.z));
             }
             return worst;
           });
}

TEST(HardCaseMesopic, WardWithoutX) {
  figures_row(
      {mesopic, "0.1 Ward's formula where X vanishes", "closed form: the weighted sum from 1e-9 down", "relative"}, eps,
      [](Denormals m) {
        double worst = 0;
        for (const double x : {1e-9, 1e-300, 0.0, -1.0}) {
          const Xyz c{x, 0.4, 0.7};
          const auto [ward, sum] = in_mode(m, [&] {
            return std::pair{isp::scotopic_luminance_ward(c), isp::scotopic_luminance(c)};
          });
          keep_worst(worst, relative(ward, sum));
        }
        return worst;
      },
      no_image);
}

TEST(HardCaseColour, FrequencyOfSeeingWhereItIsTiny) {
  figures_row(
      {group, "probability of seeing from 1e-180 up", "sum of Poisson terms in 50 digits", "relative"}, 1e-12,
      [](Denormals m) {
        double worst = 0;
        for (const int threshold : {1, 2, 6, 20, 60}) {
          for (const double mean : {1e-3, 0.1, 1.0, 5.0, 40.0}) {
            const double found = in_mode(m, [&] { return *isp::frequency_of_seeing({mean, 1, 0}, threshold); });
            keep_worst(worst, std::abs(found / reference::poisson_at_least(threshold, mean) - 1));
          }
        }
        return worst;
      },
      no_image);
}

// Hue angles near their branches: errors of an atan2 of 1e-16 over chroma; 1e-13 of what is 7 or less elsewhere.
TEST(HardCaseColour, Ciede2000AtItsBranches) {
  figures_row({group, "5.3 CIEDE2000: opposite hues, grey, blue's turn, 27 x 27 colours", "50 digits", "CIEDE2000"},
              1e-11, [](Denormals m) {
                std::vector<std::pair<Lab, Lab>> pairs{{{50, 2.49, -0.001}, {50, -2.49, 0.0009}},
                                                       {{50, 2.49, -0.001}, {50, -2.49, 0.0011}},
                                                       {{50, -0.001, 2.49}, {50, 0.0009, -2.49}},
                                                       {{50, -0.001, 2.49}, {50, 0.0011, -2.49}},
                                                       {{50, 0, 0}, {50, -1, 2}},
                                                       {{50, 2.5, 0}, {50, 0, -2.5}},
                                                       {{0, 0, 0}, {100, 0, 0}},
                                                       {{22.7233, 20.0904, -46.694}, {23.0331, 14.973, -42.5619}}};
                std::vector<Lab> colours;
                colours.reserve(27);
                colours.reserve(27);
                for (const double l : {0.0, 40.0, 90.0}) {
                  for (const double a : {-70.0, 0.0, 55.0}) {
                    for (const double b : {-110.0, 0.0, 75.0}) colours.push_back({l, a, b});
                  }
                }
                for (const Lab& first : colours) {
                  // Opposite hues exactly have two mean hues; rounding chooses, and either is right.
                  for (const Lab& second : colours)
                    pairs.push_back({first, {second.l, second.a + 1.3, second.b + 0.7}});
                }
                double worst = 0;
                for (const auto& [first, second] : pairs) {
                  const double found = in_mode(m, [&, a = first, b = second] { return isp::ciede2000(a, b); });
                  keep_worst(worst, std::abs(found - reference::ciede2000(first, second)));
                }
                return worst;
              });
}

TEST(HardCaseColour, CielabOfNegativeLight) {
  figures_row({group, "5 CIELAB of negative, zero, tiny, 1e6 times white", "50 digits: the line goes on below 0",
               "relative to 8 eps"},
              1, [](Denormals m) {
                double worst = 0;
                for (const double y : {-5.0, -1e-3, 0.0, 1e-12, 0.008, 0.009, 1.0, 1e6}) {
                  const Lab found = in_mode(m, [&] { return isp::lab_of({0.95 * y, y, 1.09 * y}, {0.95, 1, 1.09}); });
                  const double expected = 116 * reference::lab_f(y) - 16;
                  keep_worst(worst, std::abs(found.l - expected) / std::max(16.0, std::abs(expected)) / (8 * eps));
                }
                return worst;
              });
}

TEST(HardCaseColour, ChromaAloneHasNoHueDifference) {
  figures_row(
      {group, "5.2 Delta E 94c where rounding makes dH^2 negative", "closed form: dC / S_C", "relative to sqrt(eps)"},
      1, [](Denormals m) {
        double worst = 0;
        for (int i = 1; i < 400; ++i) {
          const double angle = 0.0157 * i, from = 0.37 * i, to = 0.11 * i;
          const Lab first{50, from * std::cos(angle), from * std::sin(angle)};
          const Lab second{50, to * std::cos(angle), to * std::sin(angle)};
          const double found = in_mode(m, [&] { return isp::delta_e_94c(first, second); });
          keep_worst(worst, std::abs(found / ((from - to) / (1 + 0.045 * from)) - 1) / std::sqrt(eps));
        }
        return worst;
      });
}

TEST(HardCaseColour, DivergencesOfSpectraWithZeros) {
  figures_row(
      {group, "5.5 Kullback-Leibler of spectra that are 0 in places", "sum in 50 digits, floors of 1e-12", "relative"},
      1e-12, [](Denormals m) {
        const std::vector<double> nm{400, 410, 430, 500, 505, 700};
        const std::vector<double> p{0, 1, 3, 0, 2, 0.5}, q{1, 0, 0, 2, 1e-300, 4};
        const Spectrum first = *Spectrum::of(nm, p), second = *Spectrum::of(nm, q);
        const double found = in_mode(m, [&] { return *isp::kullback_leibler(first, second); });
        return std::abs(found / reference::kullback_leibler(nm, p, q, 1e-12) - 1);
      });
}

TEST(HardCaseColour, GamutsWithoutArea) {
  figures_row(
      {group, "5.4 gamuts of no area, of one line, of no colour", "closed form: no number, 0", "answers that are not"},
      0, [](Denormals m) {
        return in_mode(m, [] {
          const isp::GamutBins none;
          double wrong = std::isnan(isp::convex_percent({1e-10, 5, 0})) ? 0 : 1;
          wrong += isp::convex_percent({400, 0, 0}) == 0 ? 0 : 1;
          wrong += std::isnan(isp::gamut_ratio(none, none, nullptr).occupancy_percent) ? 0 : 1;
          return wrong;
        });
      });
}

// Single precision: 8 products and sums of values up to 65535, and half a code of rounding.
TEST(HardCaseColour, RetargetingToADisplayThatIsNearlyDark) {
  HardCase row({group, "4 retargeted from 250 to 0.05 cd/m2: colours no display shows",
                "tetrahedra in plain double; half a code, and float", "codes of 16 bits"});
  row.none(Path::reference, "is the oracle").none(levels, "pictures are finished");
  isp::RetargetOptions options;
  options.display_cd_m2 = 0.05;
  const auto map = *isp::retargeting(options);
  PoolExecutor pool(2);
  const isp::RetargetTable table = isp::tabulated([&](const Vector3& code) { return map(code).code; }, 9, pool);
  const auto error = [&](Denormals m) {
    std::vector<std::uint16_t> in, out;
    in.reserve(3 * 2197);
    for (int i = 0; i < 3 * 2197; ++i) in.push_back(static_cast<std::uint16_t>((i * 40503U) % 65536U));
    out.resize(in.size());
    in_mode(m, [&] { isp::apply(table, in.data(), static_cast<int>(in.size() / 3), out.data()); });
    double worst = 0;
    for (std::size_t i = 0; i < in.size(); i += 3) {
      const Vector3 expected = reference::looked_up(table, {in[i] / 65535.0, in[i + 1] / 65535.0, in[i + 2] / 65535.0});
      for (std::size_t c = 0; c < 3; ++c) keep_worst(worst, std::abs(out[i + c] - 65535 * expected[c]));
    }
    return worst;
  };
  row.on_each_set(0.5 + 65535 * 16 * 0x1p-24, error).none(Path::file, "the same kernel: see the sets");
  row.none(Path::live, "streams are for the display at hand");
}

TEST(HardCaseColour, ColoursOutsideTheGamut) {
  HardCase row({group, "negative and over-white colours moved into the gamut",
                "plain double; float, 1e-6 of the largest term", "of white"});
  row.none(Path::reference, "is the oracle").none(levels, "looks come after");
  const isp::RgbTransform transform{
      {4, -2.5f, -0.5f, -1.5f, 3, -0.5f, 0.1f, -2.1f, 3}, {0.2126f, 0.7152f, 0.0722f}, 1.0f, true};
  const auto error = [&](Denormals m) { return linear_error({.transform = transform}, m); };
  row.on_each_set(1e-5, error);
  row.none(pipelines, "the same kernel: see the sets");
}

}  // namespace
}  // namespace lowlux::hard_cases
