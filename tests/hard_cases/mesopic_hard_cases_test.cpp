#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <string_view>
#include <tuple>
#include <utility>
#include <vector>

#include "isp/base/random/exact_draw.h"
#include "isp/base/random/random.h"
#include "isp/model/vision/mesopic.h"
#include "isp/render/night/eye_rows.h"
#include "isp/render/night/eye_tables.h"
#include "isp/render/night/visual_noise.h"
#include "tests/hard_cases/hard_case.h"
#include "tests/hard_cases/looks.h"
#include "tests/hard_cases/rec709_camera.h"
#include "tests/reference/exact_ref.h"
#include "tests/support/sweep.h"

// The state of adaptation: sections 0 and 1 of the mesopic specification.
namespace lowlux::hard_cases::mesopic_hard_cases_test {
namespace {

using isp::Xyz;

constexpr std::string_view mesopic_group = "Mesopic vision";
constexpr double eps = std::numeric_limits<double>::epsilon();

double relative(double found, double expected) {
  return std::abs(found - expected) / std::max(std::abs(expected), 1e-300);
}

constexpr std::string_view look_unit =
    "m (reference), fraction of the range of a grid (sets), of white (file), codes (live)";
struct LookBounds {
  // Tables of 256 luminances and 32 S/P, and straight lines between cells: night_look_test.cpp.
  Bound sets{0.03, "the bound holds between the nodes of the look's tables: these fields are near one"};
  Bound file{1.0 / 255, "the bound is a code of 8 bits"};
  double live = 1 + 0.6;  // the same beyond rounding and the table of tone.h
};

void measure_pipelines(HardCase& row, const std::vector<SeenField>& fields, const LookBounds& bounds) {
  row.none(levels, "looks come after");
  row.on(Path::file, bounds.file, [&](Denormals m) { return look_through_file(fields, m); });
  row.on(Path::live, bounds.live, [&](Denormals m) { return look_through_live(fields, m); });
}

/// The columns of the eye's look: fields as they come, and through grids that vector kernels make.
void measure_look(HardCase& row, const std::vector<SeenField>& fields, const LookBounds& bounds = {}) {
  row.on_each_set(bounds.sets, [&](Denormals m) { return look_against_reference(fields, m); });
  measure_pipelines(row, fields, bounds);
}

/// A row of figures, which reach no image for this reason.
void figures_row(const About& about, const Bound& bound, const Measure& measure, std::string_view reason) {
  HardCase row(about);
  row.on(Path::reference, bound, measure);
  row.none(levels, "looks come after").none(instruction_sets, reason).none(pipelines, reason);
}

constexpr Xyz daylight{0.95047, 1, 1.08883};
constexpr Xyz blue_light{1.9, 1, 11.2};    // S/P 12.1
constexpr Xyz amber_light{1.66, 1, 0.02};  // S/P 0.203

// Means are floats: half a last digit of 1e6 counts is 3e-5 of their standard deviation, and above that the scale of
// the limit applies. Fields of less than one isomerisation up to 1e15 of them.
TEST(HardCaseMesopic, VisualNoiseAtAnyLight) {
  HardCase row({mesopic_group, "visual noise in 1e-7 to 1e9 cd/m2, 1 to 1000 pixels per degree",
                "the same words drawn in double", "standard deviations"});
  row.on_each_set({1e-4, rounding}, [](Denormals m) {
    constexpr int cells = 64;
    double worst = 0;
    for (const double pixels_per_degree : {1.0, 30.0, 1000.0}) {
      for (const double light : test::ratios(1e-7, 1e9, 3.1)) {
        isp::NightLook look;
        look.cd_m2_per_unit = look.scene_cd_m2 = light;
        look.pixels_per_degree = pixels_per_degree;
        const isp::VisualNoise noise = isp::visual_noise(look);
        const std::vector<float> cd_m2(cells, static_cast<float>(light));
        std::vector<float> cones(cells), rods(cells), scratch(cells);
        in_mode(m, [&] {
          isp::visual_noise_row(noise, 9, cells, cd_m2.data(), cd_m2.data(), cones.data(), rods.data(), scratch.data());
          return 0;
        });
        for (const auto& [found, kind, purpose] : {std::tuple{&rods, noise.rods, draw_purpose::visual_noise_rods},
                                                   {&cones, noise.cones, draw_purpose::visual_noise_cones}}) {
          const double mean = static_cast<double>(kind.counts_per_cd_m2) * cd_m2[0] + kind.dark_counts;
          const double drawn = std::min(mean, static_cast<double>(poisson_max_mean));
          for (int x = 0; x < cells; ++x) {
            const std::uint32_t word = words_at({look.seed, 0, purpose}, static_cast<std::uint32_t>(x), 9)[0];
            const double count = exact_poisson(word, static_cast<double>(static_cast<float>(drawn)));
            const double expected = (count - drawn) / std::sqrt(drawn);
            keep_worst(worst, std::abs((*found)[x] / kind.units_per_count / std::sqrt(mean) - expected));
          }
        }
      }
    }
    return worst;
  });
  row.none(Path::reference, "the sampler in double is the reference itself").none(levels, "looks come after");
  row.none(pipelines, "the same call as in the columns of instruction sets");
}

TEST(HardCaseMesopic, NoLightAtAll) {
  HardCase row({mesopic_group, "1.1 both luminances 0", "closed form: m = 0, luminance 0, and black", look_unit});
  row.on(Path::reference, 0, [](Denormals m) {
    const auto state = in_mode(m, [] { return isp::mesopic_state({0, 0}); });
    return std::abs(state.m) + std::abs(state.luminance_cd_m2);
  });
  measure_look(row, {{1, {0, 0, 0}, daylight}}, {.file = 0, .live = 0});
}

// |h| of the answer is below 1e-12 (mesopic.cpp) and dh/dm is -1 or steeper where S/P is above 1.
TEST(HardCaseMesopic, TheCycleOfTwo) {
  HardCase row({mesopic_group, "1.1 S/P of 18 to 60, where the plain iteration does not converge",
                "root by bisection in 50 digits (reference); the look in plain double and its formula (others)",
                look_unit});
  row.on(Path::reference, {1.1e-12, rounding}, [](Denormals m) {
    double worst = 0;
    for (const double ratio : {18.0, 25.0, 30.0, 50.0, 60.0}) {
      for (const double light : test::ratios(1e-3, 6, 1.7)) {
        const auto state = in_mode(m, [&] { return isp::mesopic_state({light, ratio * light}); });
        keep_worst(worst, std::abs(state.m - reference::mes2_root(light, ratio * light)));
      }
    }
    return worst;
  });
  // S/P of 23 and 56; luminances of 0.02, 0.2 and 1.5 cd/m2.
  constexpr Rec709 azure{0.02f, 0.3f, 0.9f}, blue{0, 0.02f, 0.9f};
  measure_look(row, {{0.07, azure, blue_light},
                     {0.7, azure, blue_light},
                     {5, azure, blue_light},
                     {0.25, blue, blue_light},
                     {2.5, blue, blue_light},
                     {19, blue, blue_light}});
}

TEST(HardCaseMesopic, ThreeFixedPoints) {
  figures_row(
      {mesopic_group, "1.1 S/P of 0.05 to 0.26, where there may be three roots",
       "a + b log10 L - m in 50 digits at the answer, or 0 where it is not positive at 0", "m"},
      {1.1e-12, rounding},
      [](Denormals m) {
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
      },
      "looks limit S/P to 0.27 or more: see the next row");
}

// A lookup of m is off by 0.02 where m leaves 0 (spec 1.2). There the share of the rods falls 1 / (v0 S/P) = 12.3 times
// as fast under this light: by 0.25, a quarter of what rods and cones differ by in orange, 0.23. Its channels keep a
// fifth of their distance, and codes rise by at most 257 over the light that is left.
TEST(HardCaseMesopic, FieldsOfALookAreHeldAboveTheThreeFixedPoints) {
  HardCase row({mesopic_group, "1.1 looks under lights of S/P 0.2, limited to 0.27",
                "the look in plain double, and its formula", look_unit});
  row.none(Path::reference, "is the reference itself");
  // Luminances of 0.01 to 0.2 cd/m2; at 0.0186 the table of m is farthest off.
  constexpr Rec709 grey{0.5f, 0.5f, 0.5f}, orange{0.9f, 0.3f, 0};
  measure_look(row,
               {{0.02, grey, amber_light},
                {0.0372, grey, amber_light},
                {0.4, grey, amber_light},
                {0.0458, orange, amber_light},
                {0.1, orange, amber_light}},
               {.sets = 0.25, .file = 0.07, .live = 257 * 0.07 + 0.6});
}

struct KnownState {
  isp::LuminancePair field;
  double m;
};

/// Fields as far as a node of the look's table around those where m leaves 0 and reaches 1: L_s and L_p of these
/// luminances.
const std::vector<KnownState>& kinks() {
  static const std::vector<KnownState> states = [] {
    const double dark = std::pow(10, -0.7670 / 0.3334), bright = std::pow(10, (1 - 0.7670) / 0.3334);
    std::vector<KnownState> out;
    for (const double ratio : {0.27, 0.3, 0.5, 1.0, 2.46, 10.0, 18.0, 60.0}) {
      for (const double kink : {dark / ratio, bright}) {
        for (const double octaves : test::steps(-0.14, 0.14, 0.014)) {
          const double light = kink * std::exp2(octaves);
          out.push_back({{light, ratio * light}, reference::mes2_root(light, ratio * light)});
        }
      }
    }
    return out;
  }();
  return states;
}

/// By the look's table: with white's S/P 1 / v0 the share of the rods is 1 - m.
double error_of_lookup(Denormals mode) {
  std::vector<float> photopic, scotopic;
  for (const KnownState& state : kinks()) {
    photopic.push_back(static_cast<float>(state.field.photopic));
    scotopic.push_back(static_cast<float>(state.field.scotopic));
  }
  const std::size_t n = photopic.size();
  std::vector<float> share(n), chroma(n), blue(n), variance(n);
  in_mode(mode, [&] {
    isp::rows::eye_row(isp::eye_tables(), 1699.0f / 683.0f, photopic.data(), scotopic.data(), static_cast<int>(n),
                       {share.data(), chroma.data(), blue.data(), variance.data()});
  });
  double worst = 0;
  for (std::size_t i = 0; i < n; ++i) keep_worst(worst, std::abs(1 - static_cast<double>(share[i]) - kinks()[i].m));
  return worst;
}

// The answer's |h| is below 1e-12, and dh/dm no nearer to 0 than 0.36 (1 / 0.27 - 1) - 1 = -0.027.
TEST(HardCaseMesopic, KinksOfTheState) {
  HardCase row({mesopic_group, "1.2 kinks of m at 0 and 1, S/P of 0.27 to 60",
                "root by bisection in 50 digits (reference, sets); the look in plain double and its formula (others)",
                "m (reference, sets), of white (file), codes (live)"});
  row.on(Path::reference, {1e-12 / 0.026, rounding}, [](Denormals m) {
    double worst = 0;
    for (const KnownState& state : kinks()) {
      keep_worst(worst, std::abs(in_mode(m, [&] { return isp::mesopic_state(state.field).m; }) - state.m));
    }
    return worst;
  });
  row.on_each_set(0.02, error_of_lookup);  // as the specification measured of a lookup
  // An azure of S/P 4.67, of 0.00107 and 5 cd/m2.
  constexpr Rec709 azure{0.02f, 0.3f, 0.9f};
  measure_pipelines(row, {{0.00378, azure, daylight}, {17.61, azure, daylight}}, {});
}

// By the weights, exactly: three products and two sums.
TEST(HardCaseMesopic, NegativeScotopicLuminance) {
  HardCase row({mesopic_group, "0.1 saturated reds: negative scotopic luminance",
                "closed form: 0, and the weighted sum elsewhere (reference); the look in plain double and its formula "
                "(others)",
                look_unit});
  row.on(Path::reference, {8 * eps, rounding}, [](Denormals m) {
    const auto found = [&](const Xyz& c) { return in_mode(m, [&] { return isp::scotopic_luminance(c); }); };
    double worst = found({1, 0.3, 0}) + found({0.64, 0.33, 0.03});
    for (const Xyz& c : {Xyz{0.95, 1, 1.09}, {0.2, 0.1, 1}}) {
      keep_worst(worst, relative(found(c), -1.52356 * c.x + 2.71012 * c.y + 1.09735 * c.z));
    }
    return worst;
  });
  measure_look(row, {{0.3, {0.9f, -0.01f, -0.02f}, daylight}, {0.01, {0.9f, 0, 0}, daylight}});
}

TEST(HardCaseMesopic, WardWithoutX) {
  figures_row(
      {mesopic_group, "0.1 Ward's formula where X vanishes", "closed form: the weighted sum from 1e-9 down",
       "relative"},
      {eps, rounding},
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

}  // namespace
}  // namespace lowlux::hard_cases::mesopic_hard_cases_test
