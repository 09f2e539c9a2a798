#include "tests/hard_cases/model_pictures.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "isp/model/appearance/appearance_model.h"
#include "isp/pipeline/develop.h"
#include "isp/render/colour_table.h"
#include "tests/hard_cases/rec709_camera.h"
#include "tests/reference/colour_table_ref.h"
#include "tests/reference/exact_ref.h"

namespace lowlux::hard_cases {
namespace {

using isp::Xyz;

constexpr Xyz daylight{0.95047, 1, 1.08883};
constexpr double scotopic_ratio_of_daylight = -1.52356 * 0.95047 + 2.71012 + 1.09735 * 1.08883;
constexpr double mean_of_white = 0.18;  // what a frame's mean is taken for
constexpr std::array<double, 2> means_cd_m2{0.05, 2};

/// 0..1 in no order: 40503 is coprime to 65536.
double scattered(int i) { return static_cast<double>((static_cast<unsigned>(i) * 40503U) % 65536U) / 65536; }

isp::DevelopOptions options_for(const isp::AppearanceModel& model, double mean_cd_m2) {
  isp::DevelopOptions options{.exposure_ev = 0,
                              .tone = isp::ToneCurve::none,
                              .space = OutputSpace::linear_srgb,
                              .samples = SampleType::f32,
                              .demosaic = isp::DemosaicMethod::malvar,  // other methods reach into the next patch
                              .find_defects = false};
  options.look.look = isp::Look::model;
  options.look.model = std::string(model.name);
  options.look.scene_luminance_cd_m2 = mean_cd_m2;
  return options;
}

constexpr int patch_px = 8, columns = 32, rows = 24, patches = columns * rows;

/// Colours of patches of patch_px x patch_px, column by column of each row.
std::vector<Rec709> patch_colours() {
  std::vector<Rec709> out;
  for (int i = 0; i < patches; ++i) {
    const double light = std::exp2(-6 * scattered(4 * i + 3));
    Rec709 rgb{};
    for (int c = 0; c < 3; ++c) rgb[c] = static_cast<float>(light * scattered(4 * i + c));
    out.push_back(in_codes(rgb));
  }
  return out;
}

RawFrame frame_of(const std::vector<Rec709>& colours) {
  return rec709_frame(
      columns * patch_px, rows * patch_px,
      [&](int x, int y) {
        const int patch = y / patch_px * columns + x / patch_px;
        return colours[static_cast<std::size_t>(patch)];
      },
      daylight);
}

double mean_luminance(const std::vector<Rec709>& colours) {
  double sum = 0;
  for (const Rec709& c : colours) sum += 0.2126 * c[0] + 0.7152 * c[1] + 0.0722 * c[2];
  return sum / static_cast<double>(colours.size());
}

/// CIEDE2000 of each patch, light being relative to the scene's white.
std::vector<double> differences(const isp::AppearanceModel& model, double mean_cd_m2, const SceneLinear& picture,
                                const std::vector<Rec709>& colours) {
  isp::ViewingConditions scene{.white_cd_m2 = mean_cd_m2 / mean_of_white};
  scene.adaptation_cd_m2 = mean_cd_m2;
  scene.scotopic_ratio = scotopic_ratio_of_daylight;
  scene.colour_temperature_k = 6504;
  const auto map = *model.at(scene);
  const Matrix3 to_xyz = *isp::rgb_to_xyz(isp::primaries_rec709);
  const double of_white = mean_of_white / mean_luminance(colours);
  const auto lab = [&](const Xyz& c) { return isp::lab_of(c, daylight); };
  std::vector<double> out;
  for (int i = 0; i < patches; ++i) {
    const int x = i % columns * patch_px + patch_px / 2, y = i / columns * patch_px + patch_px / 2;
    Vector3 in{}, shown{};
    for (std::size_t c = 0; c < 3; ++c) {
      in[c] = of_white * static_cast<double>(colours[static_cast<std::size_t>(i)][c]);
      shown[c] = of_white * static_cast<double>(picture.plane[c].at(x, y));
    }
    out.push_back(reference::ciede2000(lab(map(isp::xyz_of(to_xyz * in))), lab(isp::xyz_of(to_xyz * shown))));
  }
  return out;
}

/// All but a hundredth stay below it, and five standard errors of that share.
double all_but_a_hundredth(std::vector<double> values) {
  const auto n = static_cast<double>(values.size());
  std::ranges::sort(values);
  return values[values.size() - 1 - static_cast<std::size_t>(0.01 * n + 5 * std::sqrt(0.0099 * n))];
}

/// Of a scene of `means_cd_m2[0]`; colours up to white.
const std::vector<isp::ColourTable>& tables_of_models() {
  static const std::vector<isp::ColourTable> tables = [] {
    std::vector<isp::ColourTable> out;
    for (const isp::AppearanceModel& model : isp::appearance_models()) {
      out.push_back(*isp::make_colour_table(*model.at({.white_cd_m2 = means_cd_m2[0] / mean_of_white}), {}));
    }
    return out;
  }();
  return tables;
}

}  // namespace

void model_row(const About& about, const Bound& bound, const Measure& measure) {
  HardCase row(about);
  row.on(Path::reference, bound, measure);
  row.none(levels, "looks come after").none(instruction_sets, through_tables).none(Path::file, through_tables);
  row.none(Path::live, no_models);
}

double models_through_file(Denormals mode) {
  const RawFrame frame = rec709_frame(
      64, 48,
      [](int x, int y) -> Rec709 {
        constexpr std::array<Rec709, 4> fields{{{0, 0, 0}, {-0.02f, -0.01f, -0.03f}, {1, 1, 1}, {0.8f, 0.01f, 0}}};
        const int quarter = 2 * (y / 24) + x / 32;
        return fields[static_cast<std::size_t>(quarter)];
      },
      daylight);
  PoolExecutor pool(2);
  test::ExecutorInMode executor(pool, mode);
  double wrong = 0;
  for (const isp::AppearanceModel& model : isp::appearance_models()) {
    const auto developed = in_mode(mode, [&] { return isp::develop(frame, options_for(model, 0.05), executor); });
    EXPECT_TRUE(developed) << developed.error().message;
    if (!developed) return NAN;
    for (const Plane<float>& plane : std::get<SceneLinear>(developed->picture).plane) {
      wrong += static_cast<double>(
          std::count_if(plane.data(), plane.data() + plane.size(), [](float v) { return !std::isfinite(v); }));
    }
  }
  return wrong;
}

double tables_against_reference(Denormals mode) {
  constexpr int side = 67;
  SceneLinear in(side, side), out(side, side);
  for (int i = 0; i < side * side; ++i) {
    const double size = std::exp2(24 * scattered(4 * i + 3) - 20);
    for (int c = 0; c < 3; ++c) in.plane[c].data()[i] = static_cast<float>(size * (1.5 * scattered(4 * i + c) - 0.5));
  }
  PoolExecutor pool(2);
  test::ExecutorInMode executor(pool, mode);
  double worst = 0;
  for (const isp::ColourTable& table : tables_of_models()) {
    in_mode(mode, [&] { isp::apply_colour_table(table, std::as_const(in).view(), out.view(), executor); });
    for (int i = 0; i < side * side; ++i) {
      Vector3 rgb{};
      double size = 0;
      for (int c = 0; c < 3; ++c) {
        rgb[c] = static_cast<double>(in.plane[c].data()[i]);
        size += std::abs(rgb[c]) * (std::abs(table.grey[0]) + 1);
      }
      const Vector3 expected = reference::through_colour_table(table, rgb);
      for (int c = 0; c < 3; ++c) {
        keep_worst(worst, std::abs(static_cast<double>(out.plane[c].data()[i]) - expected[c]) / size);
      }
    }
  }
  return worst;
}

double pictures_against_models(Denormals mode) {
  const std::vector<Rec709> colours = patch_colours();
  const RawFrame frame = frame_of(colours);
  PoolExecutor pool(2);
  test::ExecutorInMode executor(pool, mode);
  double worst = 0;
  for (const isp::AppearanceModel& model : isp::appearance_models()) {
    for (const double mean_cd_m2 : means_cd_m2) {
      const auto developed =
          in_mode(mode, [&] { return isp::develop(frame, options_for(model, mean_cd_m2), executor); });
      EXPECT_TRUE(developed) << developed.error().message;
      if (!developed) return NAN;
      keep_worst(worst, all_but_a_hundredth(
                            differences(model, mean_cd_m2, std::get<SceneLinear>(developed->picture), colours)));
    }
  }
  return worst;
}

}  // namespace lowlux::hard_cases
