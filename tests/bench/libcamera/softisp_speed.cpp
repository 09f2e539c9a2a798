// Times libcamera's software ISP on the CPU, with and without its colour matrix, and the plain stage of lowlux, frame
// by frame in turn: SRGGB10 to XBGR8888, statistics included, 30 frames to warm up and the median of the next 30.
//   softisp_speed [--small]     --small: 1920 x 1080 alone
// scripts/time-softisp builds it: libcamera's classes for this are internal, and no package has their headers.
#include <linux/dma-buf.h>
#include <sys/mman.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdarg>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <functional>
#include <memory>
#include <random>
#include <stdexcept>
#include <system_error>
#include <tuple>
#include <utility>
#include <vector>

#include <libcamera/camera_manager.h>
#include <libcamera/formats.h>
#include <libcamera/framebuffer.h>
#include <libcamera/stream.h>
#include "isp/adapter/lowlux_stage.h"
#include "libcamera/internal/software_isp/debayer_params.h"
#include "libcamera/internal/software_isp/swstats_cpu.h"
#include "src/libcamera/software_isp/debayer_cpu.h"

/// Accepts requests for access to a DMA buffer without effect: the buffers here are plain memory, whose descriptors
/// reject them, and libcamera prints each rejection. Other requests reach the kernel.
extern "C" int ioctl(int fd, unsigned long request, ...) noexcept {
  std::va_list arguments;
  va_start(arguments, request);
  void* const argument = va_arg(arguments, void*);
  va_end(arguments);
  if (request == DMA_BUF_IOCTL_SYNC) return 0;
  return static_cast<int>(syscall(SYS_ioctl, fd, request, argument));
}

namespace {

constexpr float black_dn = 64, white_dn = 1023, gain_dn = 0.24F, read_e = 2;
constexpr float red_gain = 1.9F, blue_gain = 1.5F;
constexpr std::array<float, 9> matrix{1.62F, -0.52F, -0.10F, -0.22F, 1.55F, -0.33F, 0.02F, -0.50F, 1.48F};
constexpr int warm_up = 30, measured = 30, distinct_frames = 4;
constexpr std::size_t page_bytes = 4096;
constexpr int margin = 4;  // libcamera's loop leaves columns and rows of the sensor out

struct Size {
  int width;
  int height;
};

/// Maps memory of a descriptor while it exists.
class Mapping {
 public:
  Mapping(int fd, std::size_t bytes)
      : bytes_(bytes), data_(mmap(nullptr, bytes, PROT_READ | PROT_WRITE, MAP_SHARED, fd, 0)) {
    if (data_ == MAP_FAILED) throw std::runtime_error("no memory for a frame");
  }
  ~Mapping() { munmap(data_, bytes_); }
  Mapping(const Mapping&) = delete;
  Mapping& operator=(const Mapping&) = delete;
  std::uint8_t* data() const { return static_cast<std::uint8_t*>(data_); }

 private:
  std::size_t bytes_;
  void* data_;
};

/// Makes a buffer of memory without a mapping, as cameras give them.
std::unique_ptr<libcamera::FrameBuffer> make_buffer(std::size_t bytes) {
  int fd = memfd_create("softisp_speed", 0);
  if (fd < 0 || ftruncate(fd, static_cast<off_t>(bytes)) != 0) throw std::runtime_error("no memory for a frame");
  libcamera::FrameBuffer::Plane plane;
  plane.fd = libcamera::SharedFD(std::move(fd));
  plane.offset = 0;
  plane.length = static_cast<unsigned>(bytes);
  return std::make_unique<libcamera::FrameBuffer>(std::vector{plane});
}

Mapping mapped(const libcamera::FrameBuffer& buffer) {
  return Mapping(buffer.planes()[0].fd.get(), buffer.planes()[0].length);
}

using Buffer = std::unique_ptr<libcamera::FrameBuffer>;

/// Fills a frame with codes of a smooth scene of `mean_e` electrons, with photon and read noise.
void draw_scene(Size sensor, float mean_e, unsigned seed, std::uint8_t* out) {
  std::mt19937 random(seed);
  std::normal_distribution<float> normal;
  for (int y = 0; y < sensor.height; ++y) {
    for (int x = 0; x < sensor.width; ++x) {
      const float column = static_cast<float>(x), row = static_cast<float>(y);
      const float light_e = mean_e * (1 + 0.9F * std::sin(0.011F * column)) * (1 + 0.9F * std::sin(0.013F * row));
      const float charge_e = light_e + std::sqrt(light_e + read_e * read_e) * normal(random);
      const auto code =
          static_cast<std::uint16_t>(std::clamp(std::round(black_dn + gain_dn * charge_e), 0.0F, white_dn));
      std::memcpy(out, &code, sizeof code);
      out += sizeof code;
    }
  }
}

/// Debayers with libcamera's loop.
class SoftwareIsp {
 public:
  SoftwareIsp(const libcamera::CameraManager& manager, Size size, bool has_matrix)
      : debayer_(std::make_unique<libcamera::SwStatsCpu>(manager), manager) {
    libcamera::StreamConfiguration in, out;
    in.pixelFormat = libcamera::formats::SRGGB10;
    in.size = {static_cast<unsigned>(size.width + margin), static_cast<unsigned>(size.height + margin)};
    in.stride = 2 * in.size.width;
    out.pixelFormat = libcamera::formats::XBGR8888;
    out.size = {static_cast<unsigned>(size.width), static_cast<unsigned>(size.height)};
    std::tie(out.stride, out.frameSize) = debayer_.strideAndFrameSize(out.pixelFormat, out.size);
    if (debayer_.configure(in, {std::cref(out)}, has_matrix) != 0)
      throw std::runtime_error("libcamera refuses the size");
    params_.combinedMatrix = libcamera::Matrix<float, 3, 3>(matrix);
    const auto black = black_dn / white_dn;
    params_.blackLevel = decltype(params_.blackLevel)({black, black, black});
    params_.gains = decltype(params_.gains)({red_gain, 1, blue_gain});
    params_.gamma = 0.5F;
    out_ = make_buffer(out.frameSize);
    debayer_.start();
  }
  ~SoftwareIsp() { debayer_.stop(); }
  SoftwareIsp(const SoftwareIsp&) = delete;
  SoftwareIsp& operator=(const SoftwareIsp&) = delete;

  void process(unsigned sequence, const Buffer& in) { debayer_.process(sequence, in.get(), out_.get(), params_); }

 private:
  libcamera::DebayerCpu debayer_;
  libcamera::DebayerParams params_;
  Buffer out_;
};

/// Develops with the stage of lowlux, without noise reduction. Buffers are mapped for each frame, as libcamera does.
class PlainStage {
 public:
  PlainStage(Size size, int threads) : row_bytes_(2 * static_cast<std::size_t>(size.width + margin)) {
    lowlux_stage_settings settings{};
    settings.size = sizeof settings;
    settings.threads = threads;
    settings.most_denoise = LOWLUX_STAGE_LEVEL_NONE;
    settings.tone = 1;
    char message[256];
    if (lowlux_stage_open(&settings, &stage_, message, sizeof message) < 0) throw std::runtime_error(message);
    lowlux_stage_input in{};
    in.size = sizeof in;
    in.api = LOWLUX_STAGE_V4L2;
    in.fourcc = LOWLUX_STAGE_FOURCC('R', 'G', '1', '0');
    in.width = size.width + margin;
    in.height = size.height + margin;
    in.crop = {margin / 2, margin / 2, size.width, size.height};
    lowlux_stage_output out{};
    out.size = sizeof out;
    out.fourcc = LOWLUX_STAGE_XBGR8888;
    check(lowlux_stage_configure(stage_, &in, &out));
    statistics_.size = sizeof statistics_;
    out_ = make_buffer(out.bytes[0]);
    stride_ = out.stride[0];
  }
  ~PlainStage() { lowlux_stage_release(stage_); }
  PlainStage(const PlainStage&) = delete;
  PlainStage& operator=(const PlainStage&) = delete;

  void process(unsigned sequence, const Buffer& in) {
    lowlux_stage_params params{};
    params.size = sizeof params;
    params.valid = LOWLUX_STAGE_HAS_BLACK | LOWLUX_STAGE_HAS_COLOUR_GAINS | LOWLUX_STAGE_HAS_COLOUR_MATRIX |
                   LOWLUX_STAGE_HAS_DENOISE | LOWLUX_STAGE_HAS_NOISE | LOWLUX_STAGE_HAS_EXPOSURE_VALUE |
                   LOWLUX_STAGE_HAS_SEQUENCE;
    std::fill(std::begin(params.black_level), std::end(params.black_level), black_dn);
    params.colour_gains[0] = red_gain;
    params.colour_gains[1] = blue_gain;
    std::copy(matrix.begin(), matrix.end(), params.colour_matrix);
    params.denoise = LOWLUX_STAGE_DENOISE_OFF;
    params.noise_gain = gain_dn;
    params.noise_read = gain_dn * read_e;
    params.exposure_ev = 3;
    params.sequence = sequence;
    const Mapping from = mapped(*in), to = mapped(*out_);
    const lowlux_stage_source source{from.data(), in->planes()[0].length, row_bytes_, -1};
    lowlux_stage_picture out{};
    out.size = sizeof out;
    out.planes = 1;
    out.plane[0] = {to.data(), out_->planes()[0].length, stride_};
    check(lowlux_stage_process(stage_, &source, &out, &params, nullptr, &statistics_));
  }

 private:
  void check(int code) const {
    if (code < 0) throw std::runtime_error(lowlux_stage_last_error(stage_));
  }
  std::size_t row_bytes_;
  lowlux_stage* stage_ = nullptr;
  Buffer out_;
  lowlux_stage_statistics statistics_{};
  std::size_t stride_ = 0;
};

double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

/// Returns the median times [ms] of the ways, which process each frame in turn.
template <class Process, std::size_t count>
std::array<double, count> median_ms(const std::vector<Buffer>& frames, const std::array<Process, count>& ways) {
  std::array<std::vector<double>, count> times;
  for (unsigned i = 0; i < warm_up + measured; ++i) {
    for (std::size_t way = 0; way < count; ++way) {
      const auto start = std::chrono::steady_clock::now();
      ways[way](i, frames[i % frames.size()]);
      const std::chrono::duration<double, std::milli> took = std::chrono::steady_clock::now() - start;
      if (i >= warm_up) times[way].push_back(took.count());
    }
  }
  std::array<double, count> out;
  for (std::size_t way = 0; way < count; ++way) out[way] = median(std::move(times[way]));
  return out;
}

/// Holds a folder of settings for libcamera while it exists.
class Settings {
 public:
  Settings() {
    char folder[] = "/tmp/softisp_speed.XXXXXX";
    if (mkdtemp(folder) == nullptr) throw std::runtime_error("no temporary folder");
    folder_ = folder;
    setenv("XDG_CONFIG_HOME", folder, 1);
    std::filesystem::create_directory(folder_ / "libcamera");
  }
  ~Settings() {
    std::error_code ignored;
    std::filesystem::remove_all(folder_, ignored);
  }
  Settings(const Settings&) = delete;
  Settings& operator=(const Settings&) = delete;

  /// Sets the number of threads of the software ISPs that are made with the next CameraManager.
  void set_threads(int threads) const {
    std::ofstream file(folder_ / "libcamera" / "configuration.yaml");
    file << "version: 1\nconfiguration:\n  software_isp:\n    threads: " << threads << "\n";
    if (!file.flush()) throw std::runtime_error("no temporary file");
  }

 private:
  std::filesystem::path folder_;
};

void measure(Size size, float mean_e, int threads, const Settings& settings) {
  settings.set_threads(threads);
  const libcamera::CameraManager manager;
  const Size sensor{size.width + margin, size.height + margin};
  std::vector<Buffer> frames;
  for (unsigned i = 0; i < distinct_frames; ++i) {
    frames.push_back(make_buffer(2 * static_cast<std::size_t>(sensor.width) * static_cast<std::size_t>(sensor.height)));
    draw_scene(sensor, mean_e, i + 1, mapped(*frames.back()).data());
  }
  SoftwareIsp with_matrix(manager, size, true), without_matrix(manager, size, false);
  PlainStage stage(size, threads);
  // Mapping the buffers of a frame and touching each page, which every way does.
  const Buffer spare = make_buffer(frames[0]->planes()[0].length);
  const Buffer out = make_buffer(4 * static_cast<std::size_t>(size.width) * static_cast<std::size_t>(size.height));
  const auto touch = [](const Buffer& buffer) {
    const Mapping memory = mapped(*buffer);
    for (std::size_t i = 0; i < buffer->planes()[0].length; i += page_bytes) {
      *static_cast<volatile std::uint8_t*>(memory.data() + i) = 0;
    }
  };
  const std::array<std::function<void(unsigned, const Buffer&)>, 4> ways{
      [&](unsigned i, const Buffer& frame) { with_matrix.process(i, frame); },
      [&](unsigned i, const Buffer& frame) { without_matrix.process(i, frame); },
      [&](unsigned i, const Buffer& frame) { stage.process(i, frame); },
      [&](unsigned, const Buffer&) { touch(spare), touch(out); }};
  const auto [matrix_ms, plain_ms, lowlux_ms, mapping_ms] = median_ms(frames, ways);
  std::printf("%4d x %-6d%6.0f%9d%9.2f%15.2f%15.2f%9.2f%16.2f\n", size.width, size.height, static_cast<double>(mean_e),
              threads, mapping_ms, matrix_ms, plain_ms, lowlux_ms, matrix_ms / lowlux_ms);
  std::fflush(stdout);
}

}  // namespace

int main(int count, char** arguments) {
  const bool small = count == 2 && std::strcmp(arguments[1], "--small") == 0;
  if (count > 2 || (count == 2 && !small)) {
    std::fputs("usage: softisp_speed [--small]\n", stderr);
    return 2;
  }
  setenv("LIBCAMERA_LOG_LEVELS", "*:ERROR", 1);
  try {
    const Settings settings;
    std::printf("libcamera %s and lowlux, SRGGB10 to XBGR8888, median of %d frames [ms]\n",
                libcamera::CameraManager::version().c_str(), measured);
    std::printf("%-13s%6s%9s%9s%15s%15s%9s%16s\n", "size", "e-", "threads", "mapping", "with matrix", "without",
                "lowlux", "matrix / lowlux");
    for (const Size size : {Size{1920, 1080}, Size{3280, 2464}}) {
      if (small && size.width > 1920) continue;
      for (const float mean_e : {20.0F, 200.0F}) {
        for (const int threads : {1, 2}) measure(size, mean_e, threads, settings);
      }
    }
  } catch (const std::exception& fault) {
    std::fprintf(stderr, "softisp_speed: %s\n", fault.what());
    return 1;
  }
  return 0;
}
