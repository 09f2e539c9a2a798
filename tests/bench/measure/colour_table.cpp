// Times a map of colours through a table against memcpy and against the map itself, in one run, with the error of the
// table: see isp/render/README.md.
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <string>
#include <utility>
#include <vector>

#include "isp/base/random/random.h"
#include "isp/model/appearance/entropy_model.h"
#include "isp/render/colour_table.h"
#include "isp/render/colour_table_rows.h"
#include "tests/bench/measure/measure.h"

namespace lowlux::isp {
namespace {

constexpr int width = 2000, height = 1500;
constexpr std::size_t pixels = std::size_t{width} * height;

/// Colours at random, 0..1 or, `signed_noise`, around a dark grey with a tenth of them out of gamut.
SceneLinear colours(bool signed_noise) {
  SceneLinear out(width, height);
  for (std::size_t i = 0; i < pixels; ++i) {
    const auto words = philox4x32_10({static_cast<std::uint32_t>(i), 0, 0, 0}, {1, 2});
    for (int c = 0; c < 3; ++c) {
      const float u = static_cast<float>(words[c]) * 0x1p-32f;
      out.plane[c].data()[i] = signed_noise ? 0.02f + 0.05f * (u - 0.5f) : u;
    }
  }
  return out;
}

/// Not homogeneous: a power of luminance.
Xyz compressed(const Xyz& c) {
  const double gain = std::pow(std::max(c.y, 0.0) + 1e-4, -0.3);
  return {gain * c.x, gain * c.y, gain * c.z};
}

struct Row {
  std::string name;
  ColourTable table;
  double build_ms;
};

Row built(const std::string& name, const ColourMap& map, double bound) {
  const double start_ms = test::wall_ms();
  ColourTable table = *make_colour_table(map, {.error_bound = bound});
  return {name, std::move(table), test::wall_ms() - start_ms};
}

ColourMap entropy_at(double white_cd_m2, EntropyVariant variant = EntropyVariant::rendering) {
  return *entropy_colour_map({.white_cd_m2 = white_cd_m2}, {.variant = variant});
}

std::vector<Row> tables() {
  std::vector<Row> out;
  for (const double white : {100.0, 5.0, 0.5, 0.05}) {
    char name[64];
    std::snprintf(name, sizeof name, "entropy, white %g cd/m2", white);
    out.push_back(built(name, entropy_at(white), 0.5));
  }
  out.push_back(built("entropy, thesis, 0.5 cd/m2", entropy_at(0.5, EntropyVariant::thesis), 0.5));
  out.push_back(built("entropy, 0.5 cd/m2, bound 0.01", entropy_at(0.5), 0.01));
  out.push_back(built("a power of luminance", compressed, 0.5));
  return out;
}

/// Microseconds of one colour through the map itself.
double solver_us(const ColourMap& map, const SceneLinear& in) {
  constexpr int count = 5000;
  double kept = 0;
  const double start_ms = test::cpu_ms();
  for (int i = 0; i < count; ++i) kept += map({in.plane[0].data()[i], in.plane[1].data()[i], in.plane[2].data()[i]}).y;
  const double took_ms = test::cpu_ms() - start_ms;
  if (!(kept > 0)) std::abort();  // so that nothing can be left out
  return 1e3 * took_ms / count;
}

}  // namespace
}  // namespace lowlux::isp

int lowlux::test::measure_colour_table(Arguments& arguments) {
  using namespace isp;
  const int rounds = arguments.option("--rounds", 15, 15);
  arguments.end();
  const std::vector<Row> rows = tables();
  const SceneLinear plain = colours(false), noisy = colours(true);
  SceneLinear out(width, height);
  InlineExecutor one;
  std::vector<Task> tasks{{"memcpy", [&] {
                             for (int c = 0; c < 3; ++c) {
                               std::memcpy(out.plane[c].data(), plain.plane[c].data(), pixels * sizeof(float));
                             }
                           }}};
  for (const Row& row : rows) {
    tasks.push_back({row.name, [&] { apply_colour_table(row.table, plain.view(), out.view(), one); }});
    tasks.push_back({row.name, [&] { apply_colour_table(row.table, noisy.view(), out.view(), one); }});
  }
  time_in_turn(tasks, rounds);
  const auto ns = [](const Task& task) { return 1e6 * task.median_cpu_ms() / static_cast<double>(pixels); };
  const double copy = ns(tasks[0]);
  std::printf(
      "target %s, %d rounds, median CPU time of one core; memcpy of R, G, B %.2f ns/pixel; the solver %.1f us\n\n",
      table_rows::target_name(), rounds, copy, solver_us(entropy_at(0.5), plain));
  std::printf("%-32s %6s %6s %8s %8s %6s | %8s %8s %9s %9s\n", "table", "cells", "levels", "KiB", "built ms", "ok",
              "CIEDE2000", "99 %", "largest", "colours");
  for (const Row& row : rows) {
    const ColourTable& t = row.table;
    std::printf("%-32s %6d %6d %8.0f %8.0f %6s | %8.3f %8.3f %9.3f %9d\n", row.name.c_str(), t.cells, t.levels,
                static_cast<double>(t.node.size() * sizeof(float)) / 1024, row.build_ms, t.within_bound ? "yes" : "no",
                t.error.mean, t.error.p99, t.error.largest, t.error.colours);
  }
  std::printf("\n%-32s %10s %10s %14s\n", "12 bytes in, 12 out", "ns/pixel", "x memcpy", "noisy ns/pixel");
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const double plain_ns = ns(tasks[1 + 2 * i]);
    std::printf("%-32s %10.2f %10.1f %14.2f\n", rows[i].name.c_str(), plain_ns, plain_ns / copy, ns(tasks[2 + 2 * i]));
  }
  return 0;
}
