// How fast the stage of isp/adapter is, by the protocol of libcamera's software ISP: 30 frames to warm up, the mean of
// the next 30, lowlux_stage_process alone; and what its levels gain on a night scene that stands still.
//   measure stage [PICTURE] [--small] [--mode NAME] [--threads N] [--look camera|eye] [--target NAME]
// PICTURE: a name of testdata/pictures, kodim19.png by default; --small: 1920 x 1080 alone; the others: these alone;
// --target: kernels for this instruction set, as Highway names it (AVX3, AVX2, SSE4, SSSE3), instead of the best.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <optional>
#include <random>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "isp/adapter/lowlux_stage.h"
#include "isp/base/executor.h"
#include "isp/base/packed/raw_format.h"
#include "isp/base/plane.h"
#include "tests/bench/measure/measure.h"
#include "tests/sensor_bench/picture_raw.h"
#include "tests/support/only_target.h"

namespace {

using namespace lowlux;

constexpr double black_dn = 64, gain_dn = 0.24, read_e = 2, white_dn = 1023;
constexpr int warm_up = 30, measured = 30;            // frames
constexpr std::size_t max_frame_bytes = 300'000'000;  // of all frames

struct Mode {
  const char* name;
  int denoise;
  int level;
  int temporal;
};
constexpr Mode modes[] = {
    {"plain", LOWLUX_STAGE_DENOISE_OFF, LOWLUX_STAGE_LEVEL_NONE, 0},
    {"draft", LOWLUX_STAGE_DENOISE_FAST, LOWLUX_STAGE_LEVEL_DRAFT, 0},
    {"standard", LOWLUX_STAGE_DENOISE_HIGH_QUALITY, LOWLUX_STAGE_LEVEL_STANDARD, 0},
    {"temporal", LOWLUX_STAGE_DENOISE_MINIMAL, LOWLUX_STAGE_LEVEL_NONE, 1},
    {"temporal + draft", LOWLUX_STAGE_DENOISE_FAST, LOWLUX_STAGE_LEVEL_DRAFT, 1},
    {"temporal + standard", LOWLUX_STAGE_DENOISE_HIGH_QUALITY, LOWLUX_STAGE_LEVEL_STANDARD, 1},
};

using Codes = std::vector<std::uint16_t>;

/// A frame of `light`, mirrored to fill it; without noise, or with its own draw of photons and read noise.
Codes frame_of(const Plane<float>& light, double mean_e, int width, int height, unsigned seed) {
  Codes out(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
  std::mt19937 random(seed);
  std::normal_distribution<double> read(0, read_e);
  const auto mirrored = [](int x, int n) {
    const int even = n & ~1, period = x / even, within = x % even;
    // Whole 2x2 cells are mirrored, so that colours stay where they are.
    return period % 2 == 0 ? within : (even - 2 - (within & ~1)) + (within & 1);
  };
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const double e = mean_e * static_cast<double>(light.at(mirrored(x, light.width()), mirrored(y, light.height())));
      const double charge = seed == 0 ? e : std::poisson_distribution<int>(std::max(e, 1e-9))(random) + read(random);
      const double dn = black_dn + gain_dn * charge;
      out[static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x)] =
          static_cast<std::uint16_t>(std::clamp(std::round(dn), 0.0, white_dn));
    }
  }
  return out;
}

lowlux_stage_params params(int denoise, unsigned sequence) {
  lowlux_stage_params p{};
  p.size = sizeof p;
  p.valid = LOWLUX_STAGE_HAS_BLACK | LOWLUX_STAGE_HAS_COLOUR_GAINS | LOWLUX_STAGE_HAS_COLOUR_MATRIX |
            LOWLUX_STAGE_HAS_DENOISE | LOWLUX_STAGE_HAS_NOISE | LOWLUX_STAGE_HAS_EXPOSURE_VALUE |
            LOWLUX_STAGE_HAS_SCENE_LUMINANCE | LOWLUX_STAGE_HAS_SEQUENCE;
  for (float& level : p.black_level) level = static_cast<float>(black_dn);
  p.colour_gains[0] = 1.9F;
  p.colour_gains[1] = 1.5F;
  const float matrix[9] = {1.62F, -0.52F, -0.10F, -0.22F, 1.55F, -0.33F, 0.02F, -0.50F, 1.48F};
  std::copy(std::begin(matrix), std::end(matrix), p.colour_matrix);
  p.denoise = denoise;
  p.noise_gain = static_cast<float>(gain_dn);
  p.noise_read = static_cast<float>(gain_dn * read_e);
  p.exposure_ev = 5;
  p.scene_luminance_cd_m2 = 0.3;
  p.sequence = sequence;
  return p;
}

struct Size {
  int width;
  int height;
};

/// A stage for one mode, and memory for its pictures.
class Bench {
 public:
  Bench(const Mode& mode, bool eye, int threads, Size size) : mode_(mode), size_(size) {
    lowlux_stage_settings settings{};
    settings.size = sizeof settings;
    settings.threads = threads;
    settings.most_denoise = mode.level;
    settings.temporal = mode.temporal;
    settings.look = eye ? LOWLUX_STAGE_LOOK_EYE : LOWLUX_STAGE_LOOK_CAMERA;
    settings.tone = 1;
    char message[256];
    check(lowlux_stage_open(&settings, &stage_, message, sizeof message));
    lowlux_stage_input in{};
    in.size = sizeof in;
    in.api = LOWLUX_STAGE_V4L2;
    in.fourcc = LOWLUX_STAGE_FOURCC('R', 'G', '1', '0');
    in.width = size.width;
    in.height = size.height;
    lowlux_stage_output out{};
    out.size = sizeof out;
    out.fourcc = LOWLUX_STAGE_XBGR8888;
    check(lowlux_stage_configure(stage_, &in, &out));
    statistics_.size = sizeof statistics_;
    picture_.resize(out.bytes[0]);
    stride_ = out.stride[0];
  }
  ~Bench() { lowlux_stage_release(stage_); }
  Bench(const Bench&) = delete;
  Bench& operator=(const Bench&) = delete;

  double process_ms(const Codes& frame) {
    const lowlux_stage_source in{frame.data(), 2 * frame.size(), 2 * static_cast<std::size_t>(size_.width), -1};
    lowlux_stage_picture out{};
    out.size = sizeof out;
    out.planes = 1;
    out.plane[0] = {picture_.data(), picture_.size(), stride_};
    const lowlux_stage_params p = params(mode_.denoise, sequence_++);
    return test::ms_of(test::wall_ms,
                       [&] { check(lowlux_stage_process(stage_, &in, &out, &p, nullptr, &statistics_)); });
  }
  const std::vector<std::uint8_t>& picture() const { return picture_; }

 private:
  void check(int code) const {
    if (code >= 0) return;
    throw test::Failure(1, "error " + std::to_string(code) + ": " + lowlux_stage_last_error(stage_));
  }
  const Mode& mode_;
  Size size_;
  lowlux_stage* stage_ = nullptr;
  std::vector<std::uint8_t> picture_;
  lowlux_stage_statistics statistics_{};
  std::size_t stride_ = 0;
  unsigned sequence_ = 0;
};

double psnr(const std::vector<std::uint8_t>& a, const std::vector<std::uint8_t>& b) {
  double sum = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    const double d = static_cast<double>(a[i]) - b[i];
    sum += d * d;
  }
  const double channels = 0.75 * static_cast<double>(a.size());  // the fourth is 255
  return 10 * std::log10(255.0 * 255.0 * channels / std::max(sum, 1e-9));
}

double memcpy_ms(std::size_t bytes) {
  std::vector<std::uint8_t> from(bytes, 1), to(bytes);
  test::Task copy{"memcpy", [&] { std::memcpy(to.data(), from.data(), bytes); }};
  test::time_in_turn({&copy, 1}, 15);
  return copy.median_wall_ms();
}

/// What is asked for; empty or 0: all.
struct Choice {
  std::string mode, look;
  int threads = 0;
  bool small = false;
};

/// Returns the instruction set of a name. Throws a Failure that lists those of the processor.
std::int64_t target_named(const std::string& name) {
  std::string known;
  for (const std::int64_t target : test::kernel_targets()) {
    if (name == hwy::TargetName(target)) return target;
    known += std::string(" ") + hwy::TargetName(target);
  }
  throw test::Failure(2, "unknown instruction set " + name + "; this processor has" + known);
}

bool wanted(const Choice& choice, const Mode& mode, bool eye, int threads) {
  return (choice.mode.empty() || choice.mode == mode.name) && (choice.threads == 0 || choice.threads == threads) &&
         (choice.look.empty() || choice.look == (eye ? "eye" : "camera"));
}

void bench_size(const Plane<float>& light, double mean_e, Size size, const Choice& choice) {
  std::vector<Codes> frames;
  const Codes clean = frame_of(light, mean_e, size.width, size.height, 0);
  // Repeated frames would be averaged as if they were new: no PSNR is printed for them.
  const std::size_t fitting = max_frame_bytes / sizeof(Codes::value_type) / clean.size();
  const auto distinct = static_cast<unsigned>(std::min<std::size_t>(fitting, warm_up + measured));
  for (unsigned i = 1; i <= distinct; ++i) frames.push_back(frame_of(light, mean_e, size.width, size.height, i));
  const double megapixels = 1e-6 * size.width * size.height;
  const double copy = memcpy_ms(static_cast<std::size_t>(6e6 * megapixels));
  std::printf(
      "\n%d x %d, RG10 to XBGR8888, %.3g e- in a mean green pixel, 2 e- of read noise, memcpy of as many bytes %.2f "
      "ms\n",
      size.width, size.height, mean_e, copy);
  std::printf("%-20s%-8s%-8s%10s%10s%10s%10s%10s%10s\n", "mode", "look", "threads", "ms mean", "ms least", "Mpx/s",
              "frames/s", "x memcpy", "PSNR dB");
  for (const bool eye : {false, true}) {
    Bench truth(modes[0], eye, 2, size);
    truth.process_ms(clean);
    for (const Mode& mode : modes) {
      for (const int threads : {1, 2}) {
        if (!wanted(choice, mode, eye, threads)) continue;
        Bench bench(mode, eye, threads, size);
        for (int i = 0; i < warm_up; ++i) bench.process_ms(frames[static_cast<std::size_t>(i) % distinct]);
        double sum = 0, least = 1e9;
        for (int i = warm_up; i < warm_up + measured; ++i) {
          const double ms = bench.process_ms(frames[static_cast<std::size_t>(i) % distinct]);
          sum += ms;
          least = std::min(least, ms);
        }
        const double mean = sum / measured;
        std::printf("%-20s%-8s%-8d%10.2f%10.2f%10.1f%10.1f%10.1f%10s\n", mode.name, eye ? "eye" : "camera", threads,
                    mean, least, megapixels * 1000 / mean, 1000 / mean, mean / copy,
                    distinct < warm_up + measured
                        ? "-"
                        : fmt::format("{:.2f}", psnr(bench.picture(), truth.picture())).c_str());
        std::fflush(stdout);
      }
    }
  }
}

}  // namespace

int lowlux::test::measure_stage(Arguments& arguments) {
  const Choice choice{arguments.option("--mode").value_or(""), arguments.option("--look").value_or(""),
                      arguments.option("--threads", 0, 1), arguments.flag("--small")};
  const std::optional<std::string> target = arguments.option("--target");
  const std::string picture = arguments.next().value_or("kodim19.png");
  arguments.end();
  const bool eye = choice.look == "eye";
  const int threads = choice.threads == 2 ? 2 : 1;
  if (std::ranges::none_of(modes, [&](const Mode& mode) { return wanted(choice, mode, eye, threads); })) {
    throw Failure(2, "unknown mode or look, or threads other than 1 and 2");
  }
  std::optional<OnlyTarget> only;
  if (target) only.emplace(target_named(*target));
  PoolExecutor executor(2);
  const PictureLight light = value_of(picture_light(picture, executor, 0.6));
  std::printf("lowlux stage, vectors: %s\n", unpack_target());
  bench_size(light.rate_e, 20, {1920, 1080}, choice);
  if (!choice.small) bench_size(light.rate_e, 20, {3280, 2464}, choice);
  return 0;
}
