#include <gtest/gtest.h>

#include <dlfcn.h>
#include <sys/mman.h>
#include <unistd.h>

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <memory>
#include <string>
#include <vector>

#include <libcamera/fake.h>
#include <libcamera/layer.h>

#include "isp/base/packed/raw_format.h"
#include "tests/adapter/stage_frames.h"

// The layer as libcamera would load it: by name, its two symbols, its functions called in the order of a camera's life.
namespace lowlux {
namespace {

using namespace stage_testing;

// Large enough for the noise to be measured.
constexpr int width = 642, height = 480, offset = 4096;

/// A file in memory, as a buffer of a camera is one.
class SharedMemory {
 public:
  explicit SharedMemory(std::size_t bytes) : fd_(memfd_create("frame", MFD_CLOEXEC)), bytes_(bytes) {
    EXPECT_EQ(ftruncate(fd_, static_cast<off_t>(bytes)), 0);
  }
  ~SharedMemory() { close(fd_); }
  SharedMemory(const SharedMemory&) = delete;
  SharedMemory& operator=(const SharedMemory&) = delete;

  int fd() const { return fd_; }
  void write(const std::vector<std::byte>& bytes) const {
    EXPECT_EQ(pwrite(fd_, bytes.data(), bytes.size(), offset), static_cast<ssize_t>(bytes.size()));
  }
  std::vector<std::byte> read() const {
    std::vector<std::byte> out(bytes_ - offset);
    EXPECT_EQ(pread(fd_, out.data(), out.size(), offset), static_cast<ssize_t>(out.size()));
    return out;
  }

 private:
  int fd_;
  std::size_t bytes_;
};

class Layer : public testing::Test {
 protected:
  void SetUp() override {
    unsetenv("LOWLUX_LAYER_PROFILE");
    unsetenv("LOWLUX_LAYER_LEVEL");
    module_ = dlopen(LOWLUX_LAYER_MODULE, RTLD_NOW | RTLD_LOCAL);
    ASSERT_NE(module_, nullptr) << dlerror();
    const auto* const info = static_cast<libcamera::LayerInfo*>(dlsym(module_, "layerInfo"));
    layer_ = static_cast<libcamera::LayerInterface*>(dlsym(module_, "layerInterface"));
    ASSERT_TRUE(info != nullptr && layer_ != nullptr && layer_->init != nullptr && layer_->terminate != nullptr);
    EXPECT_STREQ(info->name, "lowlux");
    EXPECT_EQ(info->layerAPIVersion, 1);
    closure_ = layer_->init("camera 0");
    ASSERT_NE(closure_, nullptr);
  }
  void TearDown() override {
    if (closure_ != nullptr) layer_->terminate(closure_);
    if (module_ != nullptr) dlclose(module_);
  }

  /// Configures the camera for one stream.
  void configure(const RawFormatNames& names, std::size_t stride) {
    configuration_.streams.resize(1);
    libcamera::StreamConfiguration& stream = configuration_.streams[0];
    stream.pixelFormat = {names.drm_fourcc, names.drm_modifier};
    stream.size = {width, height};
    stream.stride = static_cast<unsigned>(stride);
    stream.own = &stream_;
    layer_->configure(closure_, &configuration_);
  }

  /// Completes a buffer with these bytes. Returns what the application gets.
  std::vector<std::byte> completed(const std::vector<std::byte>& bytes,
                                   libcamera::FrameMetadata::Status status = libcamera::FrameMetadata::FrameSuccess) {
    const SharedMemory memory(offset + bytes.size());
    memory.write(bytes);
    libcamera::FrameBuffer buffer;
    buffer.own_planes = {{.fd = {memory.fd()}, .offset = offset, .length = static_cast<unsigned>(bytes.size())}};
    buffer.own_metadata = {.status = status, .sequence = sequence_, .timestamp = 33'000'000ULL * sequence_};
    ++sequence_;
    request_.own_buffers = {{&stream_, &buffer}};
    layer_->bufferCompleted(closure_, &request_, &buffer);
    layer_->stop(closure_);  // the buffer's memory goes
    return memory.read();
  }

  void* module_ = nullptr;
  libcamera::LayerInterface* layer_ = nullptr;
  void* closure_ = nullptr;
  libcamera::Stream stream_;
  libcamera::CameraConfiguration configuration_;
  libcamera::Request request_;
  unsigned sequence_ = 0;
};

/// Returns the mosaic of a frame without noise, by the stage directly: codes at the high end of 16 bits.
std::vector<std::uint16_t> clean_codes(const RawFormatNames& names, const std::vector<std::byte>& bytes,
                                       std::size_t stride, lowlux_stage_params params) {
  auto settings = plain_settings();
  settings.most_denoise = LOWLUX_STAGE_LEVEL_STANDARD;
  Rig rig(settings, names, width, height, LOWLUX_STAGE_BAYER16);
  params.denoise = LOWLUX_STAGE_DENOISE_HIGH_QUALITY;
  params.valid |= LOWLUX_STAGE_HAS_DENOISE;
  EXPECT_EQ(rig.process(bytes, stride, params), LOWLUX_STAGE_OK) << rig.error();
  std::vector<std::uint16_t> out(width * height);
  for (std::size_t i = 0; i < out.size(); ++i) out[i] = rig.wide(i);
  return out;
}

double noise_of(const RawFormat& format, const std::vector<std::byte>& bytes, std::size_t stride) {
  double sum = 0;
  std::vector<std::uint16_t> row(width);
  int count = 0;
  for (int y = 0; y < height; ++y) {
    unpack_row(format, bytes.data() + static_cast<std::size_t>(y) * stride, width, row.data());
    for (int x = 4; x + 2 < width / 4; ++x, ++count) {
      const double off = row[static_cast<std::size_t>(x) + 2] - row[static_cast<std::size_t>(x)];
      sum += off * off;
    }
  }
  return std::sqrt(sum / count);
}

TEST_F(Layer, RewritesFramesOfEveryPackingAsTheStageCleansThem) {
  for (const int bits : {8, 10, 12, 14, 16}) {
    for (const RawPacking packing : {RawPacking::little16, RawPacking::csi2}) {
      if (packing == RawPacking::csi2 && (bits == 8 || bits == 16)) continue;
      SCOPED_TRACE(testing::Message() << bits << ' ' << static_cast<int>(packing));
      const RawFormatNames& names = names_of_bayer(bits, BayerPhase::gbrg, packing);
      if (names.drm_fourcc == 0) continue;
      const std::size_t stride = row_bytes(names.format, width) + 12;
      configure(names, stride);
      const Codes codes = scene(names.format, width, height);
      const auto bytes = packed_frame(names.format, codes, width, stride);
      auto params = no_params();
      params.valid = LOWLUX_STAGE_HAS_BLACK;
      std::array<std::int32_t, 4> levels{};
      levels.fill(4096);  // a sixteenth of 65536
      for (float& level : params.black_level) level = static_cast<float>(1 << bits) / 16;
      request_.own_metadata.set(libcamera::controls::SensorBlackLevels, levels);
      const auto out = completed(bytes);

      const auto expected = clean_codes(names, bytes, stride, params);
      std::vector<std::uint16_t> row(width);
      const int shift = 16 - bits, most = (1 << bits) - 1;
      for (int y = 0; y < height; ++y) {
        const std::byte* const at = out.data() + static_cast<std::size_t>(y) * stride;
        unpack_row(names.format, at, width, row.data());
        for (int x = 0; x < width; ++x) {
          const int wide = expected[static_cast<std::size_t>(y) * width + static_cast<std::size_t>(x)];
          ASSERT_EQ(row[static_cast<std::size_t>(x)], std::min((wide + (1 << shift) / 2) >> shift, most))
              << x << ' ' << y;
        }
        for (std::size_t i = row_bytes(names.format, width); i < stride; ++i) {
          ASSERT_EQ(at[i], std::byte{0xA5}) << "between rows";
        }
      }
      EXPECT_LT(noise_of(names.format, out, stride), 0.5 * noise_of(names.format, bytes, stride));
    }
  }
}

TEST_F(Layer, LeavesFramesAsTheyAreThatAreDamagedOrOfOtherStreams) {
  const RawFormatNames& names = names_of_bayer(10);
  const std::size_t stride = row_bytes(names.format, width);
  const auto bytes = packed_frame(names.format, scene(names.format, width, height), width, stride);
  EXPECT_EQ(completed(bytes), bytes) << "not configured";
  configure(names, stride);
  EXPECT_EQ(completed(bytes, libcamera::FrameMetadata::FrameError), bytes);
  EXPECT_EQ(completed(bytes, libcamera::FrameMetadata::FrameCancelled), bytes);
  EXPECT_NE(completed(bytes), bytes);
  configuration_.streams[0].pixelFormat = {LOWLUX_STAGE_NV12, 0};  // a processed stream
  layer_->configure(closure_, &configuration_);
  EXPECT_EQ(completed(bytes), bytes);
  const RawFormatNames& ipu3 = names_of_bayer(10, BayerPhase::rggb, RawPacking::ipu3);
  configure(ipu3, row_bytes(ipu3.format, width));  // raw, but not written by the layer
  EXPECT_EQ(completed(bytes), bytes);
}

TEST_F(Layer, FollowsABufferWhoseMemoryIsAnotherOne) {
  const RawFormatNames& names = names_of_bayer(10);
  const std::size_t stride = row_bytes(names.format, width);
  configure(names, stride);
  const auto bytes = packed_frame(names.format, scene(names.format, width, height), width, stride);
  const auto expected = completed(bytes);
  libcamera::FrameBuffer buffer;  // at one address, as a program's next buffer may be
  request_.own_buffers = {{&stream_, &buffer}};
  for (int i = 0; i < 3; ++i) {
    const SharedMemory memory(offset + bytes.size());  // its descriptor has one number each time
    memory.write(bytes);
    buffer.own_planes = {{.fd = {memory.fd()}, .offset = offset, .length = static_cast<unsigned>(bytes.size())}};
    buffer.own_metadata = {.status = libcamera::FrameMetadata::FrameSuccess, .sequence = 0, .timestamp = 0};
    layer_->bufferCompleted(closure_, &request_, &buffer);
    EXPECT_EQ(memory.read(), expected) << i;
  }
}

TEST_F(Layer, LeavesAFrameAsItIsThatIsShorterThanItsFormat) {
  const RawFormatNames& names = names_of_bayer(10);
  const std::size_t stride = row_bytes(names.format, width);
  configure(names, stride);
  auto bytes = packed_frame(names.format, scene(names.format, width, height), width, stride);
  bytes.resize(bytes.size() - 1);
  testing::internal::CaptureStderr();
  EXPECT_EQ(completed(bytes), bytes);
  EXPECT_EQ(completed(bytes), bytes);
  const std::string said = testing::internal::GetCapturedStderr();
  EXPECT_EQ(std::count(said.begin(), said.end(), '\n'), 1) << said;  // once
  EXPECT_NE(said.find("ends before the frame does"), std::string::npos) << said;
}

TEST_F(Layer, TakesTheProfileOfItsVariableAndNamesOneThatCannotBeRead) {
  const RawFormatNames& names = names_of_bayer(14);
  const std::size_t stride = row_bytes(names.format, width);
  const auto bytes = packed_frame(names.format, scene(names.format, width, height), width, stride);
  setenv("LOWLUX_LAYER_PROFILE", LOWLUX_TESTDATA "/../calib/profiles/ELD_SonyA7S2.json", 1);
  configure(names, stride);
  request_.own_metadata.set(libcamera::controls::AnalogueGain, 16.0F);
  request_.own_metadata.set(libcamera::controls::ExposureTime, 20000);
  EXPECT_NE(completed(bytes), bytes);
  setenv("LOWLUX_LAYER_PROFILE", "/nonexistent/camera.json", 1);
  testing::internal::CaptureStderr();
  configure(names, stride);
  const std::string said = testing::internal::GetCapturedStderr();
  EXPECT_NE(said.find("/nonexistent/camera.json"), std::string::npos) << said;
  EXPECT_EQ(completed(bytes), bytes);
}

}  // namespace
}  // namespace lowlux
