// A layer for libcamera that reduces the noise of raw streams: completed raw buffers are rewritten in place, in their
// own format, before the application gets them. Every program that takes raw frames by libcamera then has clean ones.
//
// Layers are proposed for libcamera ("Add Layers support", version 6 of January 2026) and are in no release. A layer is
// a shared object with two symbols: layerInfo states its name and the version of the interface, layerInterface is a
// table of functions, each of which may be missing except for the first two. libcamera looks for layers in the folders
// of LIBCAMERA_LAYER_PATH, loads those named in LIBCAMERA_LAYERS_ENABLE, and calls them for each camera between its
// pipeline and the application.
//
//   flags=$(pkg-config --cflags --libs libcamera lowlux_stage)
//   g++ -std=c++20 -O2 -fPIC -shared libcamera_layer.cpp -o lowlux_layer.so $flags
//   LIBCAMERA_LAYER_PATH=$PWD LIBCAMERA_LAYERS_ENABLE=lowlux cam -c1 -C10 -srole=raw -Fframe#.raw
//
// LOWLUX_LAYER_PROFILE names a camera profile of `lowlux calibrate`; LOWLUX_LAYER_LEVEL is draft, standard (default) or
// high. Frames whose noise is neither in the profile nor measurable stay as they are, and so do streams that are not
// Bayer, and packed formats other than CSI-2.
#include <libcamera/camera.h>
#include <libcamera/control_ids.h>
#include <libcamera/framebuffer.h>
#include <libcamera/layer.h>
#include <libcamera/request.h>
#include <libcamera/stream.h>
#include <linux/dma-buf.h>
#include <lowlux/lowlux_stage.h>
#include <sys/ioctl.h>
#include <sys/mman.h>
#include <sys/stat.h>

#include <algorithm>
#include <cerrno>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <limits>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

namespace {

using StagePtr = std::unique_ptr<lowlux_stage, decltype(&lowlux_stage_release)>;

void report(const std::string& what) { std::fprintf(stderr, "lowlux layer: %s\n", what.c_str()); }

/// One buffer's memory, from the start of its file: not every exporter supports an offset.
class Mapping {
 public:
  explicit Mapping(const libcamera::FrameBuffer::Plane& plane)
      : fd_(plane.fd.get()),
        file_(file_of(fd_)),
        offset_(plane.offset),
        length_(std::size_t{plane.offset} + plane.length) {
    if (plane.offset == std::numeric_limits<unsigned int>::max()) return;
    start_ = mmap(nullptr, length_, PROT_READ | PROT_WRITE, MAP_SHARED, fd_, 0);
  }
  ~Mapping() {
    if (start_ != MAP_FAILED) munmap(start_, length_);
  }
  Mapping(const Mapping&) = delete;
  Mapping& operator=(const Mapping&) = delete;

  bool is_mapped() const { return start_ != MAP_FAILED; }
  /// Returns whether this is the memory of that plane. An application may free a buffer and make another one, which has
  /// the address and the descriptor of the first, while the camera runs.
  bool is_of(const libcamera::FrameBuffer::Plane& plane) const {
    return plane.fd.get() == fd_ && file_of(fd_) == file_ && plane.offset == offset_ &&
           std::size_t{plane.offset} + plane.length == length_;
  }
  std::uint8_t* data() const { return static_cast<std::uint8_t*>(start_) + offset_; }
  std::size_t length() const { return length_ - offset_; }

  /// Begins or ends the processor's access to a dma-buf; other files reject this, which has no effect.
  void sync(std::uint64_t step) const {
    dma_buf_sync request{};
    request.flags = step | DMA_BUF_SYNC_RW;
    while (ioctl(fd_, DMA_BUF_IOCTL_SYNC, &request) != 0 && (errno == EINTR || errno == EAGAIN)) {
    }
  }

 private:
  using File = std::pair<dev_t, ino_t>;
  static File file_of(int fd) {
    struct stat status {};
    return fstat(fd, &status) == 0 ? File{status.st_dev, status.st_ino} : File{};
  }

  int fd_;
  File file_;
  std::size_t offset_;
  std::size_t length_;
  void* start_ = MAP_FAILED;
};

/// Writes a row of codes as libcamera's format has them: bytes, 16-bit words, or groups of CSI-2 (the high bytes of the
/// samples, then their low bits, the first sample's lowest).
void pack_row(const std::uint16_t* codes, int width, const lowlux_stage_format_info& format, std::uint8_t* out) {
  const int low_bits = format.bits - 8;
  if (low_bits == 0) {
    std::copy_n(codes, width, out);
  } else if (format.packed == 0) {
    for (int x = 0; x < width; ++x) {
      out[2 * x] = static_cast<std::uint8_t>(codes[x] & 255);
      out[2 * x + 1] = static_cast<std::uint8_t>(codes[x] >> 8);
    }
  } else {
    for (int x = 0; x < width; x += format.group_pixels, out += format.group_bytes) {
      std::uint64_t low = 0;
      for (int i = 0; i < format.group_pixels; ++i) {
        const std::uint16_t code = x + i < width ? codes[x + i] : 0;
        out[i] = static_cast<std::uint8_t>(code >> low_bits);
        low |= std::uint64_t{code & ((1U << low_bits) - 1)} << (i * low_bits);
      }
      for (int i = format.group_pixels; i < format.group_bytes; ++i, low >>= 8) {
        out[i] = static_cast<std::uint8_t>(low & 255);
      }
    }
  }
}

/// Returns whether pack_row() writes a format that the stage cleans.
bool is_rewritable(const lowlux_stage_format_info& format) {
  const auto* const end = format.output + format.outputs;
  if (std::find(format.output, end, LOWLUX_STAGE_BAYER16) == end) return false;
  if (format.packed == 0 || format.bits == 8) return true;
  const bool is_csi2 = format.group_pixels * format.bits == format.group_bytes * 8 && format.group_pixels <= 4;
  return is_csi2 && format.bits < 16;
}

/// Returns what libcamera knows of a frame when its buffer completes; pipelines add more until the request does.
lowlux_stage_params params_of(libcamera::Request& request, const libcamera::FrameMetadata& frame, int bits) {
  namespace controls = libcamera::controls;
  const libcamera::ControlList& metadata = request.metadata();
  lowlux_stage_params out{};
  out.size = sizeof out;
  out.valid = LOWLUX_STAGE_HAS_SEQUENCE | LOWLUX_STAGE_HAS_TIMESTAMP | LOWLUX_STAGE_HAS_DENOISE;
  out.denoise = LOWLUX_STAGE_DENOISE_HIGH_QUALITY;
  out.sequence = frame.sequence;
  out.timestamp_ns = frame.timestamp;
  if (const auto levels = metadata.get(controls::SensorBlackLevels)) {
    out.valid |= LOWLUX_STAGE_HAS_BLACK;
    for (std::size_t i = 0; i < 4; ++i) {  // in 65536ths of the range, R Gr Gb B
      out.black_level[i] = static_cast<float>((*levels)[i]) * static_cast<float>(1 << bits) / 65536;
    }
  }
  if (const auto exposure_us = metadata.get(controls::ExposureTime); exposure_us && *exposure_us > 0) {
    out.valid |= LOWLUX_STAGE_HAS_EXPOSURE;
    out.exposure_s = 1e-6 * *exposure_us;
  }
  if (const auto gain = metadata.get(controls::AnalogueGain); gain && *gain >= 0.1F) {
    out.valid |= LOWLUX_STAGE_HAS_ANALOGUE_GAIN;
    out.analogue_gain = *gain;
  }
  if (const auto celsius = metadata.get(controls::SensorTemperature)) {
    out.valid |= LOWLUX_STAGE_HAS_TEMPERATURE;
    out.temperature_c = *celsius;
  }
  return out;
}

// NOLINTBEGIN(concurrency-mt-unsafe): nothing here sets variables
int level_of_environment() {
  const char* const level = std::getenv("LOWLUX_LAYER_LEVEL");
  if (level != nullptr && std::strcmp(level, "draft") == 0) return LOWLUX_STAGE_LEVEL_DRAFT;
  if (level != nullptr && std::strcmp(level, "high") == 0) return LOWLUX_STAGE_LEVEL_HIGH;
  if (level != nullptr && std::strcmp(level, "standard") != 0) report(std::string("no such level: ") + level);
  return LOWLUX_STAGE_LEVEL_STANDARD;
}

const char* profile_of_environment() { return std::getenv("LOWLUX_LAYER_PROFILE"); }
// NOLINTEND(concurrency-mt-unsafe)

/// One raw stream of a camera: a stage, and the codes it gives.
class CleanStream {
 public:
  /// Returns null for a stream that is left as it is; a raw one with the reason on stderr.
  static std::unique_ptr<CleanStream> make(const libcamera::StreamConfiguration& stream) {
    std::unique_ptr<CleanStream> out(new CleanStream);
    out->info_.size = sizeof out->info_;
    const std::uint32_t fourcc = stream.pixelFormat.fourcc();
    const std::uint64_t modifier = stream.pixelFormat.modifier();
    if (lowlux_stage_query(LOWLUX_STAGE_DRM, fourcc, modifier, &out->info_) != LOWLUX_STAGE_OK) return nullptr;
    if (!is_rewritable(out->info_)) return report("a raw stream's format is left as it is"), nullptr;
    lowlux_stage_settings settings{};
    settings.size = sizeof settings;
    settings.most_denoise = level_of_environment();
    settings.profile_file = profile_of_environment();
    char message[256] = "";
    lowlux_stage* opened = nullptr;
    if (lowlux_stage_open(&settings, &opened, message, sizeof message) < 0) return report(message), nullptr;
    out->stage_.reset(opened);
    lowlux_stage_input in{};
    in.size = sizeof in;
    in.api = LOWLUX_STAGE_DRM;
    in.fourcc = fourcc;
    in.modifier = modifier;
    in.width = static_cast<std::int32_t>(stream.size.width);
    in.height = static_cast<std::int32_t>(stream.size.height);
    in.stride = stream.stride;
    out->layout_.size = sizeof out->layout_;
    out->layout_.fourcc = LOWLUX_STAGE_BAYER16;
    if (lowlux_stage_configure(opened, &in, &out->layout_) < 0) return report(lowlux_stage_last_error(opened)), nullptr;
    out->stride_ = stream.stride;
    out->codes_.resize(out->layout_.bytes[0] / 2);
    return out;
  }

  /// Rewrites a frame. Returns false, with the frame as it was, if the stage does not process it.
  bool clean(libcamera::Request& request, const libcamera::FrameMetadata& frame, const Mapping& memory) {
    const lowlux_stage_source in{memory.data(), memory.length(), stride_, -1};
    lowlux_stage_picture out{};
    out.size = sizeof out;
    out.planes = 1;
    out.plane[0] = {codes_.data(), 2 * codes_.size(), layout_.stride[0]};
    const lowlux_stage_params params = params_of(request, frame, info_.bits);
    memory.sync(DMA_BUF_SYNC_START);
    const bool done = lowlux_stage_process(stage_.get(), &in, &out, &params, nullptr, nullptr) == LOWLUX_STAGE_OK;
    if (done) write(memory.data());
    memory.sync(DMA_BUF_SYNC_END);
    return done;
  }

  const char* error() const { return lowlux_stage_last_error(stage_.get()); }
  void reset() { lowlux_stage_reset(stage_.get()); }

 private:
  CleanStream() = default;

  /// Converts codes at the high end of 16 bits to those of the format, rounded, and packs them.
  void write(std::uint8_t* out) {
    const int shift = 16 - info_.bits;
    const unsigned most = (1U << info_.bits) - 1, half = (1U << shift) / 2;
    for (int y = 0; y < layout_.height; ++y, out += stride_) {
      std::uint16_t* const row = codes_.data() + static_cast<std::size_t>(y) * (layout_.stride[0] / 2);
      std::transform(row, row + layout_.width, row, [&](std::uint16_t code) {
        return static_cast<std::uint16_t>(std::min((code + half) >> shift, most));
      });
      pack_row(row, layout_.width, info_, out);
    }
  }

  StagePtr stage_{nullptr, lowlux_stage_release};
  lowlux_stage_format_info info_{};
  lowlux_stage_output layout_{};
  std::size_t stride_ = 0;
  std::vector<std::uint16_t> codes_;
};

/// The layer of one camera. libcamera calls it from one thread at a time.
class CleanRaw {
 public:
  void configure(const libcamera::CameraConfiguration& configuration) {
    stop();
    streams_.clear();
    for (const libcamera::StreamConfiguration& stream : configuration) {
      if (auto made = CleanStream::make(stream)) streams_[stream.stream()] = std::move(made);
    }
  }

  void complete(libcamera::Request& request, libcamera::FrameBuffer& buffer) {
    const libcamera::FrameMetadata& frame = buffer.metadata();
    CleanStream* const stream = stream_of(request, buffer);
    if (stream == nullptr || frame.status != libcamera::FrameMetadata::FrameSuccess) return;
    if (buffer.planes().empty()) return;
    const libcamera::FrameBuffer::Plane& plane = buffer.planes()[0];
    auto& memory = memory_[&buffer];
    if (!memory || !memory->is_of(plane)) memory = std::make_unique<Mapping>(plane);
    if (!memory->is_mapped()) return report_once("a buffer cannot be mapped: frames stay as they are");
    if (!stream->clean(request, frame, *memory)) report_once(stream->error());
  }

  /// Forgets buffers, which the application may free now, and previous frames.
  void stop() {
    memory_.clear();
    for (const auto& [stream, clean] : streams_) clean->reset();
  }

 private:
  CleanStream* stream_of(const libcamera::Request& request, const libcamera::FrameBuffer& buffer) const {
    for (const auto& [stream, own] : request.buffers()) {
      const auto found = own == &buffer ? streams_.find(stream) : streams_.end();
      if (found != streams_.end()) return found->second.get();
    }
    return nullptr;
  }

  void report_once(const std::string& what) {
    if (!std::exchange(reported_, true)) report(what);
  }

  std::map<const libcamera::Stream*, std::unique_ptr<CleanStream>> streams_;
  std::map<const libcamera::FrameBuffer*, std::unique_ptr<Mapping>> memory_;
  bool reported_ = false;
};

CleanRaw& layer_of(void* closure) { return *static_cast<CleanRaw*>(closure); }

/// Lets no exception out into libcamera: those of memory leave frames as they are.
template <class Work>
void without_exceptions(const Work& work) noexcept {
  try {
    work();
  } catch (...) {
    report("not enough memory: frames stay as they are");
  }
}

void* init(const std::string& /*id*/) { return new CleanRaw; }
void terminate(void* closure) { delete static_cast<CleanRaw*>(closure); }
void configure(void* closure, const libcamera::CameraConfiguration* configuration) {
  without_exceptions([&] { layer_of(closure).configure(*configuration); });
}
void buffer_completed(void* closure, libcamera::Request* request, libcamera::FrameBuffer* buffer) {
  without_exceptions([&] { layer_of(closure).complete(*request, *buffer); });
}
void stop(void* closure) {
  without_exceptions([&] { layer_of(closure).stop(); });
}

}  // namespace

extern "C" {

[[gnu::visibility("default")]] libcamera::LayerInfo layerInfo{.name = "lowlux", .layerAPIVersion = 1};

[[gnu::visibility("default")]] libcamera::LayerInterface layerInterface{.init = init,
                                                                        .terminate = terminate,
                                                                        .bufferCompleted = buffer_completed,
                                                                        .requestCompleted = nullptr,
                                                                        .disconnected = nullptr,
                                                                        .acquire = nullptr,
                                                                        .release = stop,
                                                                        .controls = nullptr,
                                                                        .properties = nullptr,
                                                                        .configure = configure,
                                                                        .createRequest = nullptr,
                                                                        .queueRequest = nullptr,
                                                                        .start = nullptr,
                                                                        .stop = stop};

}  // extern "C"
