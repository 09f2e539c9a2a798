// Processes raw frames of libcamera's first camera by lowlux's stage, with libcamera's public functions alone: an
// example for applications that develop a raw stream themselves.
//   g++ -std=c++20 libcamera_app.cpp -o libcamera_app $(pkg-config --cflags --libs libcamera lowlux_stage)
//   ./libcamera_app [FRAMES [PICTURE.ppm]]           30 frames; the last one is written
// The same source builds with libcamera 0.0.3 to 0.7. Not every camera offers a raw stream.
#include <libcamera/camera.h>
#include <libcamera/camera_manager.h>
#include <libcamera/control_ids.h>
#include <libcamera/framebuffer_allocator.h>
#include <libcamera/request.h>
#include <lowlux/lowlux_stage.h>
#include <sys/mman.h>

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <cstdio>
#include <cstdlib>
#include <deque>
#include <map>
#include <memory>
#include <mutex>
#include <vector>

namespace {

using StagePtr = std::unique_ptr<lowlux_stage, decltype(&lowlux_stage_release)>;

/// Queues the requests that libcamera's thread has completed, for the application's thread.
class Completed {
 public:
  void add(libcamera::Request* request) {
    const std::lock_guard lock(mutex_);
    requests_.push_back(request);
    added_.notify_one();
  }
  /// Returns the next request; null if none arrives for five seconds.
  libcamera::Request* next() {
    std::unique_lock lock(mutex_);
    if (!added_.wait_for(lock, std::chrono::seconds(5), [&] { return !requests_.empty(); })) return nullptr;
    libcamera::Request* const request = requests_.front();
    requests_.pop_front();
    return request;
  }

 private:
  std::mutex mutex_;
  std::condition_variable added_;
  std::deque<libcamera::Request*> requests_;
};

constexpr int most_failed_in_turn = 100;

struct Mapping {
  void* start = MAP_FAILED;
  std::size_t length = 0;
  std::size_t offset = 0;
};

bool is_raw(const libcamera::PixelFormat& format, lowlux_stage_format_info& info) {
  info = {};
  info.size = sizeof info;
  return lowlux_stage_query(LOWLUX_STAGE_DRM, format.fourcc(), format.modifier(), &info) == LOWLUX_STAGE_OK;
}

/// Selects a raw stream. A pipeline may offer processed formats for the role Raw, so its list is searched. Processed
/// formats are never used as raw.
bool choose_raw(libcamera::StreamConfiguration& stream) {
  lowlux_stage_format_info info{};
  if (is_raw(stream.pixelFormat, info)) return true;
  for (const auto& format : stream.formats().pixelformats()) {
    if (!is_raw(format, info)) continue;
    stream.pixelFormat = format;
    return true;
  }
  return false;
}

/// Returns the parameters of a frame. Every control may be missing, from any frame. libcamera's digital gain is not
/// applied to raw codes, so it is not used.
lowlux_stage_params params_of(libcamera::Request& request, const libcamera::FrameMetadata& frame, int bits) {
  namespace controls = libcamera::controls;
  const libcamera::ControlList& metadata = request.metadata();
  lowlux_stage_params out{};
  out.size = sizeof out;
  out.valid = LOWLUX_STAGE_HAS_SEQUENCE | LOWLUX_STAGE_HAS_TIMESTAMP;
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
  if (const auto gain = metadata.get(controls::AnalogueGain)) {
    out.valid |= LOWLUX_STAGE_HAS_ANALOGUE_GAIN;
    out.analogue_gain = *gain;
  }
  if (const auto gains = metadata.get(controls::ColourGains); gains && (*gains)[0] > 0 && (*gains)[1] > 0) {
    out.valid |= LOWLUX_STAGE_HAS_COLOUR_GAINS;
    std::copy(gains->begin(), gains->end(), out.colour_gains);
  }
  if (const auto matrix = metadata.get(controls::ColourCorrectionMatrix)) {
    out.valid |= LOWLUX_STAGE_HAS_COLOUR_MATRIX;
    std::copy(matrix->begin(), matrix->end(), out.colour_matrix);
  }
  if (const auto lux = metadata.get(controls::Lux)) {
    out.valid |= LOWLUX_STAGE_HAS_LUX;
    out.lux = *lux;
  }
  if (const auto celsius = metadata.get(controls::SensorTemperature)) {
    out.valid |= LOWLUX_STAGE_HAS_TEMPERATURE;
    out.temperature_c = *celsius;
  }
  return out;
}

int write_ppm(const char* name, const lowlux_stage_output& out, const std::vector<std::uint8_t>& rgb) {
  std::FILE* const file = std::fopen(name, "wb");
  if (file == nullptr) return std::perror(name), 1;
  std::fprintf(file, "P6\n%d %d\n255\n", out.width, out.height);
  const bool whole = std::fwrite(rgb.data(), 1, rgb.size(), file) == rgb.size();
  return std::fclose(file) == 0 && whole ? 0 : 1;
}

int failed(const char* what, const char* why = "") { return std::fprintf(stderr, "%s %s\n", what, why), 1; }

int stream_frames(libcamera::Camera& camera, libcamera::CameraConfiguration& configuration, int frames,
                  const char* picture_name) {
  const libcamera::StreamConfiguration& format = configuration.at(0);
  lowlux_stage_format_info info{};
  if (!is_raw(format.pixelFormat, info)) return failed("the format of the raw stream changed");

  lowlux_stage_settings settings{};
  settings.size = sizeof settings;
  settings.most_denoise = LOWLUX_STAGE_LEVEL_STANDARD;
  settings.temporal = 1;
  settings.tone = 1;
  lowlux_stage* opened = nullptr;
  if (lowlux_stage_open(&settings, &opened, nullptr, 0) < 0) return failed("no stage");
  const StagePtr stage(opened, lowlux_stage_release);
  lowlux_stage_input in{};
  in.size = sizeof in;
  in.api = LOWLUX_STAGE_DRM;
  in.fourcc = format.pixelFormat.fourcc();
  in.modifier = format.pixelFormat.modifier();
  in.width = static_cast<int>(format.size.width);
  in.height = static_cast<int>(format.size.height);
  in.stride = format.stride;
  lowlux_stage_output out{};
  out.size = sizeof out;
  out.fourcc = LOWLUX_STAGE_BGR888;
  if (lowlux_stage_configure(opened, &in, &out) < 0) return failed("configure:", lowlux_stage_last_error(opened));
  std::vector<std::uint8_t> rgb(out.bytes[0]);
  lowlux_stage_picture picture{};
  picture.size = sizeof picture;
  picture.planes = 1;
  picture.plane[0] = {rgb.data(), rgb.size(), out.stride[0]};

  // Buffers are mapped once, from their start: not every exporter supports an offset.
  libcamera::Stream* const stream = format.stream();
  libcamera::FrameBufferAllocator allocator(camera.shared_from_this());
  if (allocator.allocate(stream) < 0) return failed("no buffers");
  std::map<const libcamera::FrameBuffer*, Mapping> mappings;
  std::vector<std::unique_ptr<libcamera::Request>> requests;
  for (const auto& buffer : allocator.buffers(stream)) {
    const auto& plane = buffer->planes()[0];
    Mapping& mapping = mappings[buffer.get()];
    mapping.offset = plane.offset;
    mapping.length = plane.offset + plane.length;
    mapping.start = mmap(nullptr, mapping.length, PROT_READ, MAP_SHARED, plane.fd.get(), 0);
    if (mapping.start == MAP_FAILED) return failed("a buffer cannot be mapped");
    requests.push_back(camera.createRequest());
    if (!requests.back() || requests.back()->addBuffer(stream, buffer.get()) < 0) return failed("no request");
  }
  Completed completed;
  camera.requestCompleted.connect(&completed, [&](libcamera::Request* request) { completed.add(request); });
  int code = camera.start() < 0 ? failed("the camera cannot be started") : 0;
  for (const auto& request : requests) camera.queueRequest(request.get());
  for (int done = 0, failed_in_turn = 0; done < frames && code == 0;) {
    libcamera::Request* const request = completed.next();
    if (request == nullptr) code = failed("no frame arrived for five seconds");
    if (request == nullptr || request->status() == libcamera::Request::RequestCancelled) break;
    const libcamera::FrameBuffer* const buffer = request->buffers().begin()->second;
    if (buffer->metadata().status == libcamera::FrameMetadata::FrameSuccess) {
      const Mapping& mapping = mappings[buffer];
      const lowlux_stage_source source{static_cast<const std::uint8_t*>(mapping.start) + mapping.offset,
                                       mapping.length - mapping.offset, format.stride, buffer->planes()[0].fd.get()};
      const auto params = params_of(*request, buffer->metadata(), info.bits);
      if (lowlux_stage_process(opened, &source, &picture, &params, nullptr, nullptr) < 0) {
        failed("a frame:", lowlux_stage_last_error(opened));  // the stage continues with the next frame
      }
      ++done;
      failed_in_turn = 0;
    } else if (++failed_in_turn == most_failed_in_turn) {
      code = failed("the camera delivers only damaged frames");
    }
    request->reuse(libcamera::Request::ReuseBuffers);
    camera.queueRequest(request);
  }
  camera.stop();
  camera.requestCompleted.disconnect(&completed);
  for (const auto& [buffer, mapping] : mappings) munmap(mapping.start, mapping.length);
  requests.clear();
  return code == 0 && picture_name != nullptr ? write_ppm(picture_name, out, rgb) : code;
}

/// Runs with a camera that this application has acquired until the end.
int with_camera(libcamera::Camera& camera, int frames, const char* picture_name) {
  const auto configuration = camera.generateConfiguration({libcamera::StreamRole::Raw});
  if (!configuration || configuration->empty() || !choose_raw(configuration->at(0))) {
    return failed("this camera offers no raw stream");
  }
  if (configuration->validate() == libcamera::CameraConfiguration::Invalid) return failed("no valid configuration");
  if (camera.configure(configuration.get()) < 0) return failed("the camera rejects the configuration");
  return stream_frames(camera, *configuration, frames, picture_name);
}

}  // namespace

int main(int argc, char** argv) {
  const int frames = argc > 1 ? std::max(1, static_cast<int>(std::strtol(argv[1], nullptr, 10))) : 30;
  libcamera::CameraManager manager;
  if (manager.start() < 0) return failed("libcamera cannot be started");
  int code = 1;
  {
    const auto cameras = manager.cameras();
    if (cameras.empty()) {
      failed("there is no camera");
    } else if (cameras[0]->acquire() < 0) {
      failed("the camera is used by another program");
    } else {
      code = with_camera(*cameras[0], frames, argc > 2 ? argv[2] : nullptr);
      cameras[0]->release();
    }
  }
  manager.stop();
  return code;
}
