#include "tests/scenarios/planner_scene.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "isp/base/random/random.h"
#include "tests/support/reference_cost.h"

namespace lowlux::test {

using namespace isp;

double Draws::uniform() { return (words_at({stream_, 0, purpose_}, index_, next_++)[0] + 0.5) * 0x1p-32; }
double Draws::log_uniform(double low, double high) { return low * std::pow(high / low, uniform()); }
int Draws::below(int count) { return static_cast<int>(uniform() * count); }

BenchPicture drawn_part(const BenchPicture& picture, Draws& draws, int width, int height, int shift_px) {
  const int columns = picture.linear.width(), rows = picture.linear.height();
  const int x0 = draws.below(std::max(columns - width, 0) + 1), y0 = draws.below(std::max(rows - height, 0) + 1);
  // Mirrored beyond an end in the direction across too: otherwise the same rows and columns would go through all of the
  // frame, as row and column noise does.
  const auto place = [](int along, int size, bool across_is_mirrored) {
    const int in_picture = along % size;
    const bool mirrored = (along / size % 2 == 1) != across_is_mirrored;
    return mirrored ? size - 1 - in_picture : in_picture;
  };
  BenchPicture out{picture.name, SceneLinear(width, height)};
  for (int c = 0; c < 3; ++c) {
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x) {
        const int in_x = x0 + x + shift_px * ((y0 + y) / rows), in_y = y0 + y + shift_px * ((x0 + x) / columns);
        const bool right = in_x / columns % 2 == 1, below = in_y / rows % 2 == 1;
        out.linear.plane[c].at(x, y) =
            picture.linear.plane[c].at(place(in_x, columns, below), place(in_y, rows, right));
      }
    }
  }
  return out;
}

const BenchPicture& held_out_picture(int index, Executor& executor) {
  static const std::vector<BenchPicture> all = [&] {
    std::vector<BenchPicture> out;
    for (const std::string_view name : files_of(PictureSet::held_out)) {
      const auto path = (std::filesystem::path(LOWLUX_TESTDATA) / "pictures" / name).string();
      auto picture = read_bench_picture(path, 0, 0, executor);
      EXPECT_TRUE(picture) << name;
      if (picture) out.push_back(*std::move(picture));
    }
    return out;
  }();
  return all[static_cast<std::size_t>(index)];
}

DevelopOptions PlannerScene::ways(bool all) const {
  DevelopOptions out = options;
  out.effects.emplace().all = all;
  out.effects->tolerance_delta_e = tolerance;
  out.effects->cost = reference_cost();
  out.look.tolerance = tolerance;
  if (all && out.look.look == Look::eye) {
    out.look.which = LookChoice::Which::listed;
    out.look.listed = {true, true, true, true, false, false};
  }
  return out;
}

PlannerScene planner_scene(std::uint32_t index, int width, int height, Executor& executor) {
  Draws draws(20261122, 78, index);
  constexpr int shift_px = 173;
  const BenchPicture picture = drawn_part(held_out_picture(draws.below(4), executor), draws, width, height, shift_px);
  PlannerScene out;
  out.light = {draws.log_uniform(1, 1e4), draws.log_uniform(0.01, 200), draws.log_uniform(0.5, 8)};
  SensorFlaws flaws;
  flaws.row_noise_e = draws.log_uniform(0.01, 3);
  flaws.column_noise_e = draws.log_uniform(0.01, 3);
  flaws.hot_pixel_fraction = draws.log_uniform(1e-6, 1e-3);
  flaws.hot_pixel_e = draws.log_uniform(10, 1e4);
  out.raw = raw_of(take(picture, out.light, index), flaws, index);
  out.tolerance = draws.log_uniform(0.25, 4);
  if (draws.uniform() < 0.5) {
    out.options.look.look = Look::eye;
    out.options.look.scene_luminance_cd_m2 = draws.log_uniform(1e-3, 1e3);
  }
  if (draws.uniform() < 0.5) {  // a profile knows the dark charge
    out.options.black.choice = BlackChoice::measured;
    out.options.black.measured = out.raw.black;
    out.raw.frame.noise = out.raw.noise_over_pedestal;
  }
  out.options.denoise.mode = DenoiseChoice::Mode::automatic;
  return out;
}

}  // namespace lowlux::test
