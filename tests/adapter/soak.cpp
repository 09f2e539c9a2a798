// Small frames through the stage's C functions, loaded by name, for as long as one likes: sizes, formats, settings and
// parameters change at random, calls are wrong at random, and everything is done by two stages of different numbers of
// threads, whose planes were filled with different bytes: what is equal afterwards was written, all of it.
//   stage_soak LIBRARY FRAMES SEED
// Ends with 1 and a line that says why when something is not as predicted: a code, a byte, an allocation, a call of
// more than two seconds, a thread that is left, memory that grows.
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <utility>

#include "tests/adapter/soak_faults.h"
#include "tests/adapter/soak_parts.h"
#include "tests/adapter/stage_frames.h"
#include "tests/support/count_allocations.h"
#include "tests/support/this_process.h"

namespace lowlux {
namespace {

using namespace stage_testing;

constexpr int max_width = 128, max_height = 96, stages = 2;
constexpr std::size_t canary = 64;
constexpr double longest_call_s = 2;
// Resident memory may still grow after a fifth of the frames, while rare settings come for the first time. Sanitizers
// keep what was given back for a while.
#ifdef LOWLUX_SANITIZED
constexpr double max_growth_mib = 64;
#else
constexpr double max_growth_mib = 16;
#endif

class Soak {
 public:
  Soak(const Functions& functions, std::uint64_t seed) : f_(functions), chance_{seed} {}

  void run(int frames) {
    const int threads = test::threads_at_rest();
    open();
    double warm_mib = 0;
    for (frame_ = 0; frame_ < frames; ++frame_) {
      if (chance_.one_in(400)) {
        release();
        if (test::settled_threads(threads) != threads) fail("threads are left after release");
        open();
      }
      if (chance_.one_in(25)) configure();
      if (chance_.one_in(50))
        call(
            "reset", [&](int s) { return f_.reset(stage_[s]); }, LOWLUX_STAGE_OK);
      if (chance_.one_in(5)) fault();
      one_frame();
      const double now_mib = frame_ % 64 == 0 ? test::resident_bytes() / (1 << 20) : 0;
      (frame_ < frames / 5 ? warm_mib : max_mib_) = std::max(frame_ < frames / 5 ? warm_mib : max_mib_, now_mib);
    }
    release();
    if (test::settled_threads(threads) != threads) fail("threads are left at the end");
    if (max_mib_ > warm_mib + max_growth_mib) fail("memory grows");
    std::printf(
        "soak: %d frames, %d of them wrong on purpose, %d configurations, %.0f MiB after a fifth, %.0f at most, "
        "slowest call %.0f ms\n",
        frames, faults_, configurations_, warm_mib, max_mib_, 1000 * slowest_s_);
  }

 private:
  struct Planes {
    std::vector<std::uint8_t> bytes[LOWLUX_STAGE_MAX_PLANES];
    lowlux_stage_picture picture{};
  };

  [[noreturn]] void fail(const char* what) const {
    std::fprintf(stderr, "soak: frame %d, format %s, output %u of %d x %d: %s (%s)\n", frame_,
                 std::string(names_->libcamera).c_str(), out_.fourcc, in_.width, in_.height, what,
                 stage_[0] != nullptr ? f_.last_error(stage_[0]) : "");
    std::exit(1);
  }

  /// The same call on both stages.
  template <class Call>
  void call(const char* what, const Call& one, int expected) {
    for (int s = 0; s < stages; ++s) {
      const auto start = std::chrono::steady_clock::now();
      const int code = one(s);
      const std::chrono::duration<double> took = std::chrono::steady_clock::now() - start;
      slowest_s_ = std::max(slowest_s_, took.count());
      if (took.count() > longest_call_s) fail("a call took more than two seconds");
      if (code != expected) {
        std::fprintf(stderr, "soak: %s gave %d and not %d\n", what, code, expected);
        fail("another code");
      }
    }
  }

  void open() {
    settings_ = plain_settings();
    settings_.most_denoise = chance_.from(0, 3);
    settings_.temporal = chance_.below(2);
    settings_.look = chance_.below(2);
    settings_.tone = chance_.below(2);
    if (chance_.one_in(3)) settings_.profile_file = LOWLUX_TESTDATA "/../calib/profiles/RaspberryPi_HQ.json";
    call(
        "open",
        [&](int s) {
          settings_.threads = s == 0 ? chance_.from(1, 3) : chance_.from(1, 8);
          return f_.open(&settings_, &stage_[s], nullptr, 0);
        },
        LOWLUX_STAGE_OK);
    configure();
  }

  void release() {
    for (lowlux_stage*& stage : stage_) f_.release(std::exchange(stage, nullptr));
  }

  void choose_formats() {
    const auto formats = raw_formats();
    names_ = &formats[static_cast<std::size_t>(chance_.below(static_cast<int>(formats.size())))];
    in_ = input_of(*names_, chance_.from(2, max_width), chance_.from(2, max_height));
    if (chance_.one_in(3)) {
      in_.crop = {chance_.from(0, in_.width - 2), chance_.from(0, in_.height - 2), 0, 0};
      in_.crop.width = chance_.from(2, in_.width - in_.crop.x);
      in_.crop.height = chance_.from(2, in_.height - in_.crop.y);
    }
    if (chance_.one_in(4)) in_.masked = {0, 0, in_.width, chance_.from(2, in_.height)};
    if (chance_.one_in(4)) in_.white_level = chance_.from(1, largest_code(names_->format));
    constexpr std::uint32_t pictures[] = {LOWLUX_STAGE_XBGR8888, LOWLUX_STAGE_XRGB8888, LOWLUX_STAGE_BGR888,
                                          LOWLUX_STAGE_RGB888,   LOWLUX_STAGE_NV12,     LOWLUX_STAGE_RGB48,
                                          LOWLUX_STAGE_BAYER16};
    const bool bayer = names_->format.layout == SensorLayout::bayer;
    out_ = {.size = sizeof out_, .fourcc = pictures[chance_.below(bayer ? 7 : 6)]};
  }

  void configure() {
    choose_formats();
    ++configurations_;
    const auto asked = out_;
    call(
        "configure",
        [&](int s) {
          out_ = asked;
          return f_.configure(stage_[s], &in_, &out_);
        },
        LOWLUX_STAGE_OK);
    stride_ = in_.stride + static_cast<std::size_t>(chance_.one_in(2) ? chance_.below(70) : 0);
    frames_.clear();
    for (int i = 0; i < 2; ++i) {
      frames_.push_back(packed_frame(names_->format, scene(names_->format, in_.width, in_.height, chance_.below(4096)),
                                     in_.width, stride_));
    }
    frames_.push_back(frames_[0]);  // of any bytes
    for (std::byte& byte : frames_[2]) byte = static_cast<std::byte>(chance_.next());
    const std::size_t more = 2 * static_cast<std::size_t>(chance_.one_in(2) ? chance_.below(40) : 0);
    for (Planes& planes : planes_) {
      planes.picture = {.size = sizeof planes.picture, .planes = out_.planes};
      for (int p = 0; p < out_.planes; ++p) {
        const std::size_t stride = out_.stride[p] + more;
        const std::size_t rows = out_.fourcc == LOWLUX_STAGE_NV12 && p == 1 ? (out_.height + 1) / 2 : out_.height;
        const std::size_t length = stride * (rows - 1) + out_.stride[p];
        planes.bytes[p].resize(length + 2 * canary);
        planes.picture.plane[p] = {planes.bytes[p].data() + canary, length, stride};
      }
    }
  }

  lowlux_stage_params params() {
    auto p = no_params();
    p.valid = static_cast<std::uint32_t>(chance_.next()) & LOWLUX_STAGE_HAS_ALL;
    if (!chance_.one_in(16)) p.valid &= ~static_cast<std::uint32_t>(LOWLUX_STAGE_HAS_BUDGET);
    p.budget_ms = static_cast<float>(std::exp2(14 * chance_.share() - 6));
    const double white = in_.white_level > 0 ? in_.white_level : largest_code(names_->format);
    for (float& black : p.black_level) black = static_cast<float>(white * chance_.share() / 2);
    p.exposure_s = std::exp2(-14 * chance_.share());
    p.analogue_gain = static_cast<float>(1 + 15 * chance_.share());
    p.digital_gain = static_cast<float>(1 + chance_.share());
    for (float& gain : p.colour_gains) gain = static_cast<float>(0.5 + 3 * chance_.share());
    for (int i = 0; i < 9; ++i) p.colour_matrix[i] = static_cast<float>((i % 4 == 0 ? 1.5 : 0) - chance_.share() / 2);
    p.lux = static_cast<float>(100 * chance_.share());
    p.temperature_c = static_cast<float>(60 * chance_.share());
    p.denoise = chance_.from(0, LOWLUX_STAGE_DENOISE_AUTO);
    sequence_ += chance_.one_in(10) ? chance_.next() : 1;
    p.sequence = sequence_;
    p.timestamp_ns = std::uint64_t{sequence_} * 33'000'000;
    p.gamma = p.contrast = p.sharpness = p.saturation = static_cast<float>(2 * chance_.share());
    p.exposure_ev = static_cast<float>(-2 + 8 * chance_.share());
    p.noise_gain = static_cast<float>(white / 2000 * (0.1 + chance_.share()));
    p.noise_read = static_cast<float>(3 * p.noise_gain * chance_.share());
    p.f_number = static_cast<float>(1 + 8 * chance_.share());
    p.max_exposure_s = static_cast<float>(std::exp2(-14 * chance_.share()));
    p.min_exposure_s = static_cast<float>(p.max_exposure_s * chance_.share());
    p.max_gain = static_cast<float>(1 + 63 * chance_.share());
    p.mains_hz = chance_.one_in(2) ? 50 : LOWLUX_STAGE_MAINS_EITHER;
    p.scene_luminance_cd_m2 = std::exp2(14 * chance_.share() - 10);
    if (settings_.look == LOWLUX_STAGE_LOOK_EYE) p.valid |= LOWLUX_STAGE_HAS_SCENE_LUMINANCE;
    // Black that is measured or of a profile may lie above a low white.
    if (in_.white_level > 0 || in_.masked.width > 0) p.valid |= LOWLUX_STAGE_HAS_BLACK;
    return p;
  }

  void one_frame() {
    const auto& bytes = frames_[static_cast<std::size_t>(chance_.below(3))];
    const auto wanted = params();
    // Descriptors that are no dma-buf, or are closed by now, do no harm.
    const int fd = chance_.one_in(4) ? chance_.from(0, 200) : -1;
    const lowlux_stage_source source{bytes.data(), stride_ * static_cast<std::size_t>(in_.height - 1) + in_.stride,
                                     stride_, fd};
    for (int s = 0; s < stages; ++s) {
      for (auto& plane : planes_[s].bytes) std::ranges::fill(plane, fill(s));
      result_[s] = {.size = sizeof result_[s]};
      statistics_[s] = {.size = sizeof statistics_[s]};
    }
    const long before = test::allocations;
    call(
        "process",
        [&](int s) {
          return f_.process(stage_[s], &source, &planes_[s].picture, &wanted, &result_[s], &statistics_[s]);
        },
        LOWLUX_STAGE_OK);
    if (test::allocations != before) fail("a frame allocated memory");
    compare();
    // Each has its own times, and from here on would have other frames before.
    if ((wanted.valid & LOWLUX_STAGE_HAS_BUDGET) != 0) {
      call(
          "reset after a budget", [&](int s) { return f_.reset(stage_[s]); }, LOWLUX_STAGE_OK);
    }
  }

  static std::uint8_t fill(int stage) { return stage == 0 ? 0x00 : 0xFF; }

  /// Bytes of pixels are equal, those around them are as they were filled.
  void compare() {
    for (auto& result : result_) {
      if (!(result.took_ms >= 0 && result.predicted_ms >= 0)) fail("a time below 0");
      result.took_ms = result.predicted_ms = 0;
      // Of a frame with nothing to reduce all steps are the same, but that the last does not ask for frames before.
      if ((result.applied & LOWLUX_STAGE_HAS_BUDGET) == 0) continue;
      result.applied &= ~static_cast<std::uint32_t>(LOWLUX_STAGE_HAS_SEQUENCE | LOWLUX_STAGE_HAS_TIMESTAMP |
                                                    LOWLUX_STAGE_HAS_EXPOSURE);
    }
    const bool same = result_[0].step == result_[1].step;  // else a budget asked for different pictures
    // NOLINTBEGIN(bugprone-suspicious-memory-comparison): the same bits, not only the same values
    if (same && std::memcmp(&result_[0], &result_[1], sizeof result_[0]) != 0) fail("results differ");
    if (std::memcmp(&statistics_[0], &statistics_[1], sizeof statistics_[0]) != 0) fail("statistics differ");
    // NOLINTEND(bugprone-suspicious-memory-comparison)
    for (int p = 0; p < out_.planes; ++p) {
      const auto &a = planes_[0].bytes[p], &b = planes_[1].bytes[p];
      const lowlux_stage_plane& plane = planes_[0].picture.plane[p];
      for (std::size_t i = 0; i < a.size(); ++i) {
        const bool inside = i >= canary && i < canary + plane.length && (i - canary) % plane.stride < out_.stride[p];
        if (inside && same && a[i] != b[i]) fail("pictures differ, or a pixel was not written");
        if (!inside && (a[i] != fill(0) || b[i] != fill(1))) fail("a byte that is no pixel was written");
      }
    }
  }

  void fault() {
    ++faults_;
    if (chance_.one_in(4)) {
      wrong_configuration();
    } else {
      wrong_frame();
    }
  }

  void wrong_configuration() {
    auto in = in_;
    auto out = out_;
    const int expected = make_wrong(chance_, in, out);
    const bool looked_at = out.size == sizeof out;
    const auto asked = out;
    call(
        "wrong configure",
        [&](int s) {
          out = asked;
          return f_.configure(stage_[s], &in, &out);
        },
        expected);
    const lowlux_stage_source source{frames_[0].data(), frames_[0].size(), stride_, -1};
    const auto wanted = params();
    call(
        "process after it",
        [&](int s) { return f_.process(stage_[s], &source, &planes_[s].picture, &wanted, nullptr, nullptr); },
        looked_at ? LOWLUX_STAGE_NOT_CONFIGURED : LOWLUX_STAGE_OK);
    configure();
  }

  void wrong_frame() {
    lowlux_stage_source source{frames_[0].data(), stride_ * static_cast<std::size_t>(in_.height - 1) + in_.stride,
                               stride_, -1};
    auto wanted = params();
    auto picture = planes_[0].picture;
    const int expected = make_wrong(chance_, in_, source, picture, wanted);
    call(
        "wrong process", [&](int s) { return f_.process(stage_[s], &source, &picture, &wanted, nullptr, nullptr); },
        expected);
  }

  const Functions f_;
  Chance chance_;
  lowlux_stage* stage_[stages]{};
  lowlux_stage_settings settings_{};
  const RawFormatNames* names_ = nullptr;
  lowlux_stage_input in_{};
  lowlux_stage_output out_{};
  std::size_t stride_ = 0;
  std::vector<std::vector<std::byte>> frames_;
  Planes planes_[stages];
  lowlux_stage_result result_[stages]{};
  lowlux_stage_statistics statistics_[stages]{};
  std::uint32_t sequence_ = 0;
  int frame_ = 0, faults_ = 0, configurations_ = 0;
  double slowest_s_ = 0, max_mib_ = 0;
};

}  // namespace
}  // namespace lowlux

int main(int argc, char** argv) {
  const long frames = argc == 4 ? std::strtol(argv[2], nullptr, 10) : 0;
  if (frames < 1 || frames > 100'000'000) {
    std::fprintf(stderr, "usage: stage_soak LIBRARY FRAMES SEED\n");
    return 2;
  }
  lowlux::Soak soak(lowlux::load(argv[1]), std::strtoull(argv[3], nullptr, 10));
  soak.run(static_cast<int>(frames));
  return 0;
}
