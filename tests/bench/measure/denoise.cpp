// Times the denoiser against memcpy and against its reference, and measures what it leaves of the noise on simulated
// raws of the pictures in testdata: see denoise/README.md.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <iterator>
#include <numeric>
#include <optional>
#include <span>
#include <string>
#include <variant>
#include <vector>

#include "capture/file/picture_source.h"
#include "denoise/denoiser.h"
#include "isp/codec/exr.h"
#include "tests/bench/measure/measure.h"
#include "tests/denoise/frames.h"
#include "tests/reference/denoise_ref.h"

namespace {

using namespace lowlux;
using denoise::all_levels;
using denoise::DenoiseOptions;
using denoise::Level;
using denoise_testing::Camera;
using denoise_testing::exposed;

/// The reference, which leaves nothing out, takes the same time for every chroma start.
void print_table(const std::vector<test::Task>& tasks) {
  std::printf("%-26s %8s %10s %14s\n", "", "ms/MP", "x memcpy", "reference is x");
  double reference_ms = 0;
  for (const test::Task& task : tasks) {
    const double ms = task.median_cpu_ms();
    if (task.name == "reference") {
      reference_ms = ms;
    } else {
      std::printf("%-26s %8.2f %10.1f", task.name.c_str(), ms, ms / tasks[0].median_cpu_ms());
      std::printf(reference_ms > 0 ? " %14.0f\n" : "\n", reference_ms / ms);
    }
  }
}

void print_times(int rounds) {
  constexpr int width = 2000, height = 1500, small = 256;
  const Camera camera{.dark_e = {2, 2, 2, 2}};
  const auto raw = exposed(camera, denoise_testing::waves(50), width, height, 1);
  const auto part = exposed(camera, denoise_testing::waves(50), small, small, 1);
  Plane<float> out(width, height);
  denoise::Denoiser denoiser(width, height, 1, Level::best);
  InlineExecutor one;
  std::vector<test::Task> tasks;
  tasks.reserve(1 + 4 * all_levels.size());
  tasks.push_back({"memcpy", [&] { std::memcpy(out.data(), raw.data(), raw.size() * sizeof(float)); }, 3});
  for (const Level level : all_levels) {
    const DenoiseOptions options{.level = level, .chroma_start = 0};
    tasks.push_back({"reference",
                     [&, options] {
                       reference::denoise({part.view(), camera.phase}, camera.noise(), options);
                     },
                     small * small * 1e-6});
    for (const int start : {0, 1, 2}) {
      const DenoiseOptions with{.level = level, .chroma_start = start};
      tasks.push_back({std::string(denoise::name_of(level)) + ", chroma from " + std::to_string(start),
                       [&, with] {
                         denoiser.run({raw.view(), camera.phase}, camera.noise(), with, out.view(), {}, one);
                       },
                       3});
    }
  }
  test::time_in_turn(tasks, rounds);
  std::printf("target %s, one thread, %d rounds, median CPU time\n\n", denoise::denoiser_target(), rounds);
  print_table(tasks);
}

/// A camera whose white is not that of its sensor, in front of a picture.
struct Shot {
  Camera camera{.white_gain = {2, 1, 1.5}};
  Plane<float> rgb[3];  // linear Rec. 709, 1 is white
  double white_e = 0;   // electrons of green at 1

  double signal_e(int x, int y) const {
    const auto c = static_cast<std::size_t>(colour_at(camera.phase, x, y));
    return static_cast<double>(rgb[c].at(x, y)) * white_e / camera.white_gain[c];
  }
};

constexpr double psf_sites = 0.9;  // standard deviation of the lens's Gaussian spread

/// Blurred along rows (dx = 1, dy = 0) or columns, ends repeated.
Plane<float> blurred(const Plane<float>& in, int dx, int dy) {
  constexpr int reach = 4;
  std::array<double, 2 * reach + 1> weight{};
  for (int i = -reach; i <= reach; ++i) weight[i + reach] = std::exp(-0.5 * i * i / (psf_sites * psf_sites));
  const double sum = std::accumulate(weight.begin(), weight.end(), 0.0);
  Plane<float> out(in.width(), in.height());
  for (int y = 0; y < in.height(); ++y) {
    for (int x = 0; x < in.width(); ++x) {
      double value = 0;
      for (int i = -reach; i <= reach; ++i) {
        const int at_x = std::clamp(x + i * dx, 0, in.width() - 1), at_y = std::clamp(y + i * dy, 0, in.height() - 1);
        value += weight[i + reach] / sum * static_cast<double>(in.at(at_x, at_y));
      }
      out.at(x, y) = static_cast<float>(value);
    }
  }
  return out;
}

/// The channels as they are, what lies below black set to it: capture::read_picture takes so much of it for no
/// radiance.
Shot clipped_shot_of(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  const std::string bytes(std::istreambuf_iterator<char>(file), {});
  const auto picture = test::value_of(isp::decode_exr(std::as_bytes(std::span(bytes))));
  Shot shot;
  for (std::size_t c = 0; c < 3; ++c) {
    shot.rgb[c] = std::get<SceneLinear>(picture.picture).plane[c].clone();
    for (float& e : std::span(shot.rgb[c].data(), shot.rgb[c].size())) e = std::max(0.0f, e);
    shot.rgb[c] = blurred(blurred(shot.rgb[c], 1, 0), 0, 1);
  }
  return shot;
}

Shot shot_of(const std::string& name) {
  if (name.ends_with(".exr")) return clipped_shot_of(std::string(LOWLUX_TESTDATA) + "/pictures/" + name);
  InlineExecutor one;
  const auto picture = test::value_of(capture::read_picture(std::string(LOWLUX_TESTDATA) + "/pictures/" + name, one));
  // IEC 61966-2-1
  constexpr Matrix3 from_xyz{{{3.2406, -1.5372, -0.4986}, {-0.9689, 1.8758, 0.0415}, {0.0557, -0.2040, 1.0570}}};
  const auto& xyz = picture.xyz.plane;
  Shot shot;
  for (auto& plane : shot.rgb) plane = Plane<float>(xyz[0].width(), xyz[0].height());
  for (int y = 0; y < xyz[0].height(); ++y) {
    for (int x = 0; x < xyz[0].width(); ++x) {
      const Vector3 in{static_cast<double>(xyz[0].at(x, y)), static_cast<double>(xyz[1].at(x, y)),
                       static_cast<double>(xyz[2].at(x, y))};
      const Vector3 rgb = from_xyz * in;
      for (int c = 0; c < 3; ++c) shot.rgb[c].at(x, y) = static_cast<float>(std::max(0.0, rgb[c]));
    }
  }
  for (auto& plane : shot.rgb) plane = blurred(blurred(plane, 1, 0), 0, 1);
  return shot;
}

/// Sets the exposure so that a site holds mean_e on average.
void expose(Shot& shot, double mean_e, double dark_e) {
  shot.white_e = 1;
  double sum = 0;
  for (int y = 0; y < shot.rgb[0].height(); ++y) {
    for (int x = 0; x < shot.rgb[0].width(); ++x) sum += shot.signal_e(x, y);
  }
  shot.white_e = mean_e * static_cast<double>(shot.rgb[0].size()) / sum;
  shot.camera.dark_e = {dark_e, dark_e, dark_e, dark_e};
  shot.camera.read_noise_e = dark_e > 100 ? 4 : 1.5;
}

double encoded(double linear) {
  const double v = std::clamp(linear, 0.0, 1.0);
  return v <= 0.0031308 ? 12.92 * v : 1.055 * std::pow(v, 1 / 2.4) - 0.055;
}

struct Quality {
  double linear_db = 0;   // of white-balanced sites, peak white
  double encoded_db = 0;  // the same, each site clipped and encoded as sRGB
};

Quality quality_of(const Shot& shot, const Plane<float>& signal_e) {
  double linear = 0, display = 0;
  for (int y = 0; y < signal_e.height(); ++y) {
    for (int x = 0; x < signal_e.width(); ++x) {
      const double gain = shot.camera.white_gain[static_cast<std::size_t>(colour_at(shot.camera.phase, x, y))];
      const double truth = shot.signal_e(x, y) * gain / shot.white_e;
      const double got = static_cast<double>(signal_e.at(x, y)) * gain / shot.white_e;
      linear += std::pow(got - truth, 2);
      display += std::pow(encoded(got) - encoded(truth), 2);
    }
  }
  const auto sites = static_cast<double>(signal_e.size());
  return {-10 * std::log10(linear / sites), -10 * std::log10(display / sites)};
}

struct Light {
  double mean_e, dark_e;
};
constexpr std::array lights{Light{200, 2}, Light{20, 2}, Light{20, 200}, Light{4, 2}, Light{4, 200}};

Quality quality_at(Shot& shot, const Light& light, std::optional<Level> level) {
  expose(shot, light.mean_e, light.dark_e);
  const int width = shot.rgb[0].width(), height = shot.rgb[0].height();
  const auto scene = [&](int x, int y) {
    const double e = shot.signal_e(x, y);
    return std::array{e, e, e};
  };
  auto raw = exposed(shot.camera, scene, width, height, 5);
  if (!level) {
    for (std::size_t i = 0; i < raw.size(); ++i) raw.data()[i] -= static_cast<float>(light.dark_e);
    return quality_of(shot, raw);
  }
  Plane<float> out(width, height);
  InlineExecutor one;
  denoise::Denoiser denoiser(width, height, 1, *level);
  denoiser.run({raw.view(), shot.camera.phase}, shot.camera.noise(),
               {.level = *level, .white_gain = shot.camera.white_gain}, out.view(), {}, one);
  return quality_of(shot, out);
}

void print_quality() {
  const std::array pictures{"kodim05.png", "kodim08.png", "Carrots.exr", "StillLife.exr"};
  std::printf("PSNR [dB] of white-balanced sites, linear / sRGB-encoded; mean of");
  std::vector<Shot> shots;
  shots.reserve(pictures.size());
  for (const char* const name : pictures) {
    std::printf(" %s", name);
    shots.push_back(shot_of(name));
  }
  std::printf("; mean e- / dark e-, read noise 1.5 e-, above 100 e- dark 4 e-, PSF %g sites\n\n%-10s", psf_sites, "");
  for (const Light& light : lights) std::printf(" %6g/%-6g", light.mean_e, light.dark_e);
  std::printf("\n");
  std::vector<std::optional<Level>> levels{std::nullopt};
  levels.insert(levels.end(), all_levels.begin(), all_levels.end());
  for (const auto& level : levels) {
    std::printf("%-10s", level ? std::string(denoise::name_of(*level)).c_str() : "none");
    for (const Light& light : lights) {
      Quality mean;
      for (Shot& shot : shots) {
        const Quality q = quality_at(shot, light, level);
        mean.linear_db += q.linear_db / static_cast<double>(shots.size());
        mean.encoded_db += q.encoded_db / static_cast<double>(shots.size());
      }
      std::printf("  %5.1f/%-5.1f", mean.linear_db, mean.encoded_db);
    }
    std::printf("\n");
  }
}

}  // namespace

int lowlux::test::measure_denoise(Arguments& arguments) {
  const int rounds = arguments.option("--rounds", 5, 5);
  const bool times = !arguments.flag("--quality-only"), quality = !arguments.flag("--time-only");
  arguments.end();
  if (times) print_times(rounds);
  if (times && quality) std::printf("\n");
  if (quality) print_quality();
  return 0;
}
