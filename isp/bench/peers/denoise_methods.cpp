#include "isp/bench/peers/denoise_methods.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <ctime>
#include <utility>
#include <vector>

#include "isp/bench/peers/gat_denoise.h"
#include "isp/metrics/statistics.h"
#include "isp/render/output_space.h"

namespace lowlux::isp {
namespace {

using denoise::Level;

double cpu_s() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

template <class Work>
double time_of(const Work& work) {
  const double start = cpu_s();
  work();
  return cpu_s() - start;
}

/// Alternates rounds of work and of memcpy; with more than one, another runs first to warm up.
template <class Work>
void time_rounds(const MethodInput& input, MethodResult& result, const Work& work) {
  const Plane<float>& frame = input.shot.raw_e;
  Plane<float> copy(frame.width(), frame.height());
  std::vector<double> work_s, memcpy_s;
  for (int round = input.rounds > 1 ? -1 : 0; round < input.rounds; ++round) {
    const double copied = time_of([&] { std::memcpy(copy.data(), frame.data(), frame.size() * sizeof(float)); });
    const double worked = time_of(work);
    if (round < 0) continue;
    memcpy_s.push_back(copied);
    work_s.push_back(worked);
  }
  result.cpu_s = median(work_s);
  result.spread = spread_of(work_s);
  result.memcpy_s = median(memcpy_s);
}

Plane<float> same_size(const MethodInput& input) { return {input.shot.raw_e.width(), input.shot.raw_e.height()}; }

void subtract_dark(const DenoiseShot& shot, Plane<float>& out) {
  const auto dark_e = static_cast<float>(shot.light.dark_e);
  std::transform(shot.raw_e.data(), shot.raw_e.data() + shot.raw_e.size(), out.data(),
                 [dark_e](float e) { return e - dark_e; });
}

Result<MethodResult> run_noise_free(const MethodInput& input, Level /*level*/, MethodMemory& memory) {
  return MethodResult{.picture = memory.renderer.render(input.shot.signal_e.view(), input.shot, NoiseLeft::none)};
}

Result<MethodResult> run_none(const MethodInput& input, Level /*level*/, MethodMemory& memory) {
  MethodResult result;
  Plane<float> out = same_size(input);
  time_rounds(input, result, [&] { subtract_dark(input.shot, out); });
  result.picture = memory.renderer.render(out.view(), input.shot, NoiseLeft::all);
  return result;
}

RenderedPicture with_dark(const MethodInput& input, MethodMemory& memory) {
  return memory.renderer.render(input.shot.raw_e.view(), input.shot, NoiseLeft::all,
                                exposure_with_dark(input.picture, input.shot));
}

Result<MethodResult> run_dark_left_in(const MethodInput& input, Level /*level*/, MethodMemory& memory) {
  MethodResult result;
  Plane<float> out = same_size(input);
  // The mosaic is not processed, so that only the copy remains.
  time_rounds(input, result, [&] { std::copy_n(input.shot.raw_e.data(), out.size(), out.data()); });
  result.picture = with_dark(input, memory);
  return result;
}

Result<MethodResult> run_chromatic(const MethodInput& input, Level /*level*/, MethodMemory& memory) {
  MethodResult result;
  const SceneLinear light = with_dark(input, memory).light;
  time_rounds(input, result, [&] { result.picture.light = chromatic_filtered(light.view(), input.tuned.windows); });
  result.picture.display = memory.renderer.display_of(result.picture.light);
  return result;
}

Result<MethodResult> run_nl_means(const MethodInput& input, Level /*level*/, MethodMemory& memory) {
  MethodResult result;
  Plane<float> out = same_size(input);
  subtract_dark(input.shot, out);
  Encoded8 noisy = nl_means_input(memory.renderer.render(out.view(), input.shot, NoiseLeft::all));
  Encoded8 clean{Plane<std::uint8_t>(noisy.codes.width(), noisy.codes.height())};
  const NlMeansPicture from{noisy.codes.data(), noisy.width(), noisy.height()};
  const NlMeansPicture to{clean.codes.data(), clean.width(), clean.height()};
  bool works = true;
  MethodInput timed = input;
  timed.rounds = input.slow_rounds;
  time_rounds(timed, result,
              [&] { works = input.nl_means->denoise(from, to, input.strength.lightness, input.strength.colour); });
  if (!works) return fail(ErrorCode::unreadable, "OpenCV's fastNlMeansDenoisingColored failed: not enough memory?");
  result.picture.display = linear_of(clean);
  result.picture.light = linear_of(clean);
  return result;
}

Result<MethodResult> run_gat(const MethodInput& input, Level level, MethodMemory& memory) {
  MethodResult result;
  Plane<float> out = same_size(input);
  InlineExecutor one;
  time_rounds(input, result,
              [&] { gat_denoise(memory.denoiser, input.shot, level, input.tuned.stabilised_gain, out.view(), one); });
  result.picture = memory.renderer.render(out.view(), input.shot, NoiseLeft::reduced);
  return result;
}

Result<MethodResult> run_denoiser(const MethodInput& input, Level level, MethodMemory& memory) {
  MethodResult result;
  Plane<float> out = same_size(input);
  InlineExecutor one;
  MethodInput timed = input;
  if (level == Level::best) timed.rounds = input.slow_rounds;
  time_rounds(timed, result, [&] {
    memory.denoiser.run({input.shot.raw_e.view(), BayerPhase::rggb}, input.shot.noise(),
                        {.level = level, .white_gain = bench_white_gain}, out.view(), {}, one);
  });
  result.picture = memory.renderer.render(out.view(), input.shot, NoiseLeft::reduced);
  return result;
}

/// Returns means of 2 radius + 1 samples along each row, those inside the image, transposed: rows become columns.
Plane<float> row_means(const PlaneView<const float>& in, int radius) {
  Plane<float> out(in.height, in.width);
  std::vector<double> sum(static_cast<std::size_t>(in.width) + 1, 0.0);  // sums of all preceding samples
  for (int y = 0; y < in.height; ++y) {
    const float* const row = in.row(y);
    for (int x = 0; x < in.width; ++x) sum[x + 1] = sum[x] + static_cast<double>(row[x]);
    for (int x = 0; x < in.width; ++x) {
      const int first = std::max(x - radius, 0), last = std::min(x + radius + 1, in.width);
      out.at(y, x) = static_cast<float>((sum[last] - sum[first]) / (last - first));
    }
  }
  return out;
}

Plane<float> box_means(const PlaneView<const float>& in, int radius) {
  return row_means(row_means(in, radius).view(), radius);
}

constexpr std::array<int, 9> radii{0, 1, 2, 3, 4, 6, 8, 16, 32};
constexpr std::uint64_t tuning_seed = 0x7e57;

struct Sample {
  const BenchPicture* picture;
  DenoiseShot shot;
  PictureTruth truth;
  SceneLinear with_dark;
};

std::vector<Sample> samples_of(const std::vector<BenchPicture>& pictures, const DenoiseLight& light,
                               Executor& executor) {
  std::vector<Sample> out;
  out.reserve(pictures.size());
  for (const BenchPicture& picture : pictures) {
    DenoiseShot shot = take(picture, light, tuning_seed + out.size());
    BenchRenderer renderer(picture.linear.width(), executor);
    SceneLinear with_dark =
        renderer.render(shot.raw_e.view(), shot, NoiseLeft::all, exposure_with_dark(picture, shot)).light;
    out.push_back({&picture, std::move(shot), PictureTruth(picture.linear.view(), executor), std::move(with_dark)});
  }
  return out;
}

double chromatic_psnr_db(const std::vector<Sample>& samples, const ChromaticWindows& windows, Executor& executor) {
  double sum = 0;
  for (const Sample& sample : samples) {
    BenchRenderer renderer(sample.truth.width(), executor);
    const SceneLinear display = renderer.display_of(chromatic_filtered(sample.with_dark.view(), windows));
    sum += encoded_psnr_db(display.view(), sample.truth, executor);
  }
  return sum / static_cast<double>(samples.size());
}

/// Searches one radius after the other, each over all radii, twice.
ChromaticWindows best_windows(const std::vector<Sample>& samples, Executor& executor) {
  ChromaticWindows best{2, 2};
  double best_db = chromatic_psnr_db(samples, best, executor);
  for (int i = 0; i < 4; ++i) {
    int ChromaticWindows::*const radius =
        i % 2 == 0 ? &ChromaticWindows::luminance_radius : &ChromaticWindows::chroma_radius;
    for (const int r : radii) {
      ChromaticWindows next = best;
      next.*radius = r;
      const double db = chromatic_psnr_db(samples, next, executor);
      if (db > best_db) {
        best_db = db;
        best = next;
      }
    }
  }
  return best;
}

double gat_psnr_db(const std::vector<Sample>& samples, const std::array<double, 3>& gain, Executor& executor) {
  double sum = 0;
  InlineExecutor one;
  for (const Sample& sample : samples) {
    MethodMemory memory(sample.truth.width(), sample.truth.height(), executor);
    Plane<float> out(sample.truth.width(), sample.truth.height());
    gat_denoise(memory.denoiser, sample.shot, denoise::Level::standard, gain, out.view(), one);
    const SceneLinear display = memory.renderer.render(out.view(), sample.shot, NoiseLeft::reduced).display;
    sum += encoded_psnr_db(display.view(), sample.truth, executor);
  }
  return sum / static_cast<double>(samples.size());
}

/// Chooses between two sets of gains. Stabilised noise is white and equal in all colours, which favours equal gains;
/// neutral detail is equal under the square roots of the gains, where noise is photon noise alone.
std::array<double, 3> best_gain(const std::vector<Sample>& samples, Executor& executor) {
  constexpr std::array<double, 3> equal{1, 1, 1};
  std::array<double, 3> roots{};
  for (std::size_t c = 0; c < 3; ++c) roots[c] = std::sqrt(bench_white_gain[c]);
  return gat_psnr_db(samples, roots, executor) > gat_psnr_db(samples, equal, executor) ? roots : equal;
}

}  // namespace

MethodMemory::MethodMemory(int max_width, int max_height, Executor& for_rendering)
    : denoiser(max_width, max_height, 1, denoise::all_levels.back()), renderer(max_width, for_rendering) {}

std::vector<DenoiseMethod> denoise_methods(bool with_nl_means) {
  std::vector<DenoiseMethod> out{{"noise-free", MethodKind::ceiling, Level::standard, run_noise_free},
                                 {name_of_none, MethodKind::other, Level::standard, run_none},
                                 {"dark-left-in", MethodKind::other, Level::standard, run_dark_left_in},
                                 {"chromatic", MethodKind::other, Level::standard, run_chromatic}};
  if (with_nl_means) out.push_back({name_of_nl_means, MethodKind::other, Level::standard, run_nl_means});
  out.push_back({"gat-standard", MethodKind::other, Level::standard, run_gat});
  for (const Level level : denoise::all_levels) {
    out.push_back({std::string(denoise::name_of(level)), MethodKind::ours, level, run_denoiser});
  }
  return out;
}

SceneLinear chromatic_filtered(const RgbView<const float>& linear, const ChromaticWindows& windows) {
  assert(windows.chroma_radius >= 0 && windows.luminance_radius >= 0);
  const Vector3 weights = luminance_weights(OutputSpace::linear_srgb).value();  // has primaries
  const int width = linear[0].width, height = linear[0].height;
  SceneLinear out;
  Plane<float> luminance(width, height), window_luminance(width, height);
  for (std::size_t c = 0; c < 3; ++c) out.plane[c] = box_means(linear[c], windows.chroma_radius);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      double here = 0, window = 0;
      for (std::size_t c = 0; c < 3; ++c) {
        here += weights[c] * static_cast<double>(linear[c].at(x, y));
        window += weights[c] * static_cast<double>(out.plane[c].at(x, y));
      }
      luminance.at(x, y) = static_cast<float>(here);
      window_luminance.at(x, y) = static_cast<float>(window);
    }
  }
  luminance = box_means(luminance.view(), windows.luminance_radius);
  for (std::size_t c = 0; c < 3; ++c) {
    for (std::size_t i = 0; i < luminance.size(); ++i) {
      const float window = window_luminance.data()[i];
      float& value = out.plane[c].data()[i];
      value = window > 0 ? value / window * luminance.data()[i] : luminance.data()[i];
    }
  }
  return out;
}

TunedParameters tune(const std::vector<BenchPicture>& pictures, const DenoiseLight& light, Executor& executor) {
  const std::vector<Sample> samples = samples_of(pictures, light, executor);
  return {best_windows(samples, executor), best_gain(samples, executor)};
}

}  // namespace lowlux::isp
