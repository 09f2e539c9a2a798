// What the look of the eye and retargeting cost beside the raw pass they are joined to, and how far their fast levels
// are from double arithmetic: accuracy against time.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <utility>
#include <vector>

#include "isp/base/executor.h"
#include "isp/model/vision/night_eye.h"
#include "isp/raw/kernel/raw_to_rgb.h"
#include "isp/render/night/night_look.h"
#include "isp/render/retarget/retarget.h"
#include "isp/render/retarget/retarget_rows.h"
#include "isp/render/retarget/retarget_table.h"
#include "tests/bench/measure/measure.h"
#include "tests/reference/night_look_ref.h"
#include "tests/reference/raw_to_rgb_ref.h"

namespace {

using namespace lowlux;

constexpr std::size_t memcpy_bytes = 60'000'000;

struct Settings {
  int width;
  int height;
  int rounds;
};

/// A street by night: a few lamps, falling off, over a dark ground; colours in between. Linear, 1 at the white level.
std::array<double, 3> scene(double x, double y) {
  double light = 2e-4;
  for (const double lamp : {0.2, 0.55, 0.9}) {
    const double d = std::hypot(x - lamp, y - 0.3);
    light += 0.004 / (0.004 + d * d);
  }
  light *= 0.4 * (1 + 0.5 * std::sin(97 * x) * std::sin(83 * y));
  const double hue = 6 * x + 4 * y;
  return {light * (1 + 0.6 * std::cos(hue)), light * (1 + 0.6 * std::cos(hue + 2.1)),
          light * (1 + 0.6 * std::cos(hue + 4.2))};
}

Plane<std::uint16_t> mosaic_of(int width, int height) {
  Plane<std::uint16_t> dn(width, height);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const auto colour = scene(static_cast<double>(x) / width, static_cast<double>(y) / width);
      const double v = colour[static_cast<std::size_t>(colour_at(BayerPhase::rggb, x, y))];
      dn.at(x, y) = static_cast<std::uint16_t>(std::clamp(512 + v * 15871 + (x * 7 + y * 3) % 5, 0.0, 16383.0));
    }
  }
  return dn;
}

constexpr isp::SiteLevels levels{{512, 512, 512, 512}, {1 / 15871.f, 1 / 15871.f, 1 / 15871.f, 1 / 15871.f}};

isp::RgbTransform transform() {
  return {
      {1.70f, -0.60f, -0.10f, -0.20f, 1.55f, -0.35f, 0.02f, -0.52f, 1.50f}, {0.2126f, 0.7152f, 0.0722f}, 1.0f, true};
}

isp::NightLook look_at(double mean_cd_m2, double width) {
  isp::NightLook look;
  look.cd_m2_per_unit = mean_cd_m2 / 0.15;  // about the mean of the scene
  look.pixels_per_degree = width / 50;
  look.luminance = transform().luminance;
  look.rods = {-0.0126f, 0.6204f, 0.3922f};
  for (int c = 0; c < 3; ++c) look.tint[c] = static_cast<float>(isp::rod_tint[c]);
  look.dark = 1e-4f;
  return look;
}

void print_look_times(const std::vector<test::Task>& tasks, const Settings& settings) {
  const double pixels = 1e6 * settings.width * settings.height / 1e6;
  std::printf("%d x %d, %s, one core, CPU time, medians of %d rounds in turn\n\n", settings.width, settings.height,
              isp::raw_to_rgb_target(), settings.rounds);
  std::printf("%-52s %8s %9s %9s %9s\n", "", "ms", "ns/pixel", "x memcpy", "x raw");
  for (const test::Task& t : tasks) {
    std::printf("%-52s %8.2f %9.2f %9.2f %9.2f\n", t.name.c_str(), t.median_cpu_ms(), 1e6 * t.median_cpu_ms() / pixels,
                t.median_cpu_ms() / tasks[0].median_cpu_ms(), t.median_cpu_ms() / tasks[1].median_cpu_ms());
  }
}

/// Everything the timed tasks work on.
struct Stage {
  explicit Stage(const Settings& s)
      : width(s.width),
        height(s.height),
        dn(mosaic_of(s.width, s.height)),
        codes(3 * s.width, s.height),
        quarter(cells_along(s.width), cells_along(s.height)),
        kernel(s.width, 1),
        maker(s.width, s.height) {}

  isp::DnMosaic in() const { return {dn.view(), BayerPhase::rggb, levels}; }
  LookGrid grid(const isp::NightLook& look) {
    kernel.quarter(in(), quarter.view(), one);
    return maker.make(std::as_const(quarter).view(), transform().matrix, 1, look, std::nullopt, one);
  }
  void render(const LookGrid* look, const isp::CodeChange* change = nullptr) {
    isp::RgbTransform t = transform();
    t.look = look;
    kernel.rgb8(in(), t, tone, codes.view(), one, change);
  }

  int width, height;
  Plane<std::uint16_t> dn;
  Plane<std::uint8_t> codes;
  CameraRgb quarter;
  isp::RawToRgb kernel;
  isp::NightLookGrid maker;
  ToneTable tone = reference::srgb_tone_table();
  InlineExecutor one;
};

isp::CodeChange change_by(const isp::RetargetTable& table) {
  return {[](const void* context, const std::uint16_t* rgb, int width, std::uint8_t* out) {
            apply(*static_cast<const isp::RetargetTable*>(context), rgb, width, out);
          },
          nullptr, &table};
}

void time_all(const Settings& settings) {
  Stage stage(settings);
  const auto map = isp::retargeting({});
  const isp::CodeMap code_map = [&map](const Vector3& code) { return (*map)(code).code; };
  const isp::RetargetTable table = isp::tabulated(code_map, 33, stage.one);
  const isp::CodeChange change = change_by(table);
  std::vector<unsigned char> from(memcpy_bytes, 1), to(memcpy_bytes, 2);
  std::vector<test::Task> tasks;
  tasks.push_back({"memcpy 60 MB", [&] { std::memcpy(to.data(), from.data(), memcpy_bytes); }});
  tasks.push_back({"raw to rgb8", [&] { stage.render(nullptr); }});
  for (const double cd_m2 : {100.0, 1.0, 0.1, 0.01}) {
    char name[80];
    std::snprintf(name, sizeof name, "raw to rgb8 with the look of the eye, %g cd/m2", cd_m2);
    tasks.push_back({name, [&stage, cd_m2] {
                       const LookGrid grid = stage.grid(look_at(cd_m2, stage.width));
                       stage.render(&grid);
                     }});
  }
  const LookGrid ready = stage.grid(look_at(0.1, settings.width));
  tasks.push_back(
      {"  of it: means of 4 x 4", [&] { stage.kernel.quarter(stage.in(), stage.quarter.view(), stage.one); }});
  tasks.push_back({"  of it: adaptation, states, blur (0.1 cd/m2)", [&] {
                     stage.maker.make(std::as_const(stage.quarter).view(), transform().matrix, 1,
                                      look_at(0.1, stage.width), std::nullopt, stage.one);
                   }});
  tasks.push_back({"raw to rgb8 with the grid ready", [&] { stage.render(&ready); }});
  tasks.push_back({"raw to rgb8 for a display of 2 cd/m2 (table of 33)", [&] { stage.render(nullptr, &change); }});
  test::time_in_turn(tasks, settings.rounds);
  print_look_times(tasks, settings);
  double worst = 0;
  for (std::size_t k = 2; k < 6; ++k) worst = std::max(worst, tasks[k].median_cpu_ms() / tasks[1].median_cpu_ms() - 1);
  std::printf("\nthe look adds %.2f of the raw pass at most\n", worst);
}

/// Codes of double arithmetic, not rounded.
std::vector<double> exact_codes(const Stage& stage, const LookGrid& grid) {
  const reference::LinearisedMosaic mosaic = reference::linearised(stage.in());
  isp::RgbTransform t = transform();
  t.move_into_gamut = false;
  std::vector<double> out;
  for (int y = 0; y < stage.height; ++y) {
    for (int x = 0; x < stage.width; ++x) {
      const reference::Rgb seen =
          reference::seen(reference::transformed(reference::malvar(mosaic, x, y), t), grid, x, y);
      for (const double v : reference::moved_into_gamut(seen, t.luminance)) {
        out.push_back(255 * reference::srgb_encoded(v));
      }
    }
  }
  return out;
}

/// Steps of 8-bit codes between the fast look and the exact one, and what the exact states cost.
void print_errors() {
  Settings settings{1000, 750, 1};
  Stage stage(settings);
  std::printf(
      "\nlook by table against CIE 191 solved in double for each cell, and all arithmetic in double: 8-bit steps "
      "(0.5 of it is rounding)\n\n%-10s %8s %8s %8s %14s %14s\n",
      "cd/m2", "mean", "99 %", "largest", "table ns/px", "exact ns/px");
  for (const double cd_m2 : {30.0, 3.0, 1.0, 0.3, 0.1, 0.03, 0.01, 0.001}) {
    const isp::NightLook look = look_at(cd_m2, settings.width);
    double start = test::cpu_ms();
    const LookGrid fast = stage.grid(look);
    const double table_ms = test::cpu_ms() - start;
    start = test::cpu_ms();
    const auto parts = reference::night_look(std::as_const(stage.quarter).view(), transform().matrix, 1, look);
    const double exact_ms = test::cpu_ms() - start;
    std::vector<Plane<float>> memory;
    const LookGrid exact = reference::look_grid(parts, look, memory);
    stage.render(&fast);
    const std::vector<double> wanted = exact_codes(stage, exact);
    std::vector<double> error;
    for (std::size_t i = 0; i < wanted.size(); ++i) error.push_back(std::fabs(stage.codes.data()[i] - wanted[i]));
    std::ranges::sort(error);
    double sum = 0;
    for (const double e : error) sum += e;
    const double pixels = 1e-6 * settings.width * settings.height;
    std::printf("%-10g %8.3f %8.3f %8.3f %14.2f %14.2f\n", cd_m2, sum / static_cast<double>(error.size()),
                error[error.size() * 99 / 100], error.back(), table_ms / pixels, exact_ms / pixels);
  }
}

}  // namespace

int lowlux::test::measure_look(Arguments& arguments) {
  const Settings settings{arguments.option("--width", 4000, 1), arguments.option("--height", 3000, 1),
                          arguments.option("--rounds", 15, 1)};
  arguments.end();
  time_all(settings);
  print_errors();
  return 0;
}
