// A stage of lowlux in libcamera's software ISP: what libcamera-softisp.patch adds to DebayerCpu. It is copied next to
// debayer_cpu.cpp, which includes it last, after <dlfcn.h> and <lowlux/lowlux_stage.h>, and serves releases from 0.4.0
// to the tree after 0.7.2: where they differ, the first overload that compiles is taken.
//
// LOWLUX_STAGE names liblowlux_stage.so.0. LOWLUX_PROFILE may name a profile of `lowlux calibrate`. What the stage does
// not support, such as formats without a mosaic, is left to libcamera's own loop, with a warning.
#pragma once

#include <cstdlib>
#include <iomanip>
#include <memory>

namespace libcamera {

struct DebayerCpu::Lowlux {
  // Order of overloads: those of a higher rank are preferred.
  struct Rank0 {};
  struct Rank1 : Rank0 {};
  struct Rank2 : Rank1 {};
  struct Rank3 : Rank2 {};

  decltype(&lowlux_stage_open) open = nullptr;
  decltype(&lowlux_stage_configure) configure = nullptr;
  decltype(&lowlux_stage_process) process = nullptr;
  decltype(&lowlux_stage_release) release = nullptr;
  decltype(&lowlux_stage_last_error) last_error = nullptr;
  decltype(&lowlux_stage_query) query = nullptr;
  lowlux_stage* stage = nullptr;
  lowlux_stage_input input = {};
  lowlux_stage_output output = {};
  int bits = 0;

  ~Lowlux() {
    if (stage != nullptr) release(stage);
  }

  template <typename F>
  static bool find(void* library, const char* name, F& function) {
    function = reinterpret_cast<F>(dlsym(library, name));
    return function != nullptr;
  }

  // The library stays loaded.
  bool load(const char* file) {
    void* const library = dlopen(file, RTLD_NOW | RTLD_LOCAL);
    return library != nullptr && find(library, "lowlux_stage_open", open) &&
           find(library, "lowlux_stage_configure", configure) && find(library, "lowlux_stage_process", process) &&
           find(library, "lowlux_stage_release", release) && find(library, "lowlux_stage_last_error", last_error) &&
           find(library, "lowlux_stage_query", query);
  }

  // @return null, after a warning, where frames are left to the loop
  static std::unique_ptr<Lowlux> create(const StreamConfiguration& in, const StreamConfiguration& out,
                                        const Rectangle& window) {
    const char* const file = std::getenv("LOWLUX_STAGE");
    if (file == nullptr) return nullptr;
    auto self = std::make_unique<Lowlux>();
    if (!self->load(file)) {
      LOG(Debayer, Warning) << "LOWLUX_STAGE: " << dlerror();
      return nullptr;
    }
    lowlux_stage_settings settings = {};
    settings.size = sizeof(settings);
    settings.profile_file = std::getenv("LOWLUX_PROFILE");
    settings.most_denoise = LOWLUX_STAGE_LEVEL_STANDARD;
    settings.temporal = 1;
    settings.tone = 1;
    char message[256];
    if (self->open(&settings, &self->stage, message, sizeof(message)) < 0) {
      LOG(Debayer, Warning) << "LOWLUX_STAGE: " << message;
      return nullptr;
    }
    self->describe(in, out, window);
    if (self->configure(self->stage, &self->input, &self->output) != LOWLUX_STAGE_OK) {
      LOG(Debayer, Warning) << "LOWLUX_STAGE: " << self->last_error(self->stage);
      return nullptr;
    }
    return self;
  }

  void describe(const StreamConfiguration& in, const StreamConfiguration& out, const Rectangle& window) {
    lowlux_stage_format_info info = {};
    info.size = sizeof(info);
    query(LOWLUX_STAGE_DRM, in.pixelFormat.fourcc(), in.pixelFormat.modifier(), &info);
    bits = info.bits;
    input.size = sizeof(input);
    input.api = LOWLUX_STAGE_DRM;
    input.fourcc = in.pixelFormat.fourcc();
    input.modifier = in.pixelFormat.modifier();
    input.width = static_cast<int>(in.size.width);
    input.height = static_cast<int>(in.size.height);
    input.stride = in.stride;
    input.crop = {window.x, window.y, static_cast<int>(window.width), static_cast<int>(window.height)};
    output.size = sizeof(output);
    output.fourcc = out.pixelFormat.fourcc();
    if (out.pixelFormat == formats::ARGB8888) output.fourcc = LOWLUX_STAGE_XRGB8888;  // alpha is 255
    if (out.pixelFormat == formats::ABGR8888) output.fourcc = LOWLUX_STAGE_XBGR8888;
    output.stride[0] = out.stride;
  }

  // Parameters of 0.7.0 and later. Black is stated as a code of 8 bits over 255; 0 is taken for not known.
  template <typename Parameters>
  auto add_known(lowlux_stage_params& params, const Parameters& of, Rank1) const
      -> decltype(of.blackLevel.g(), of.gains.g(), void()) {
    const float range = 255.0F * static_cast<float>(1 << bits) / 256.0F;
    if (of.blackLevel.g() > 0) {
      params.valid |= LOWLUX_STAGE_HAS_BLACK;
      params.black_level[0] = static_cast<float>(range * of.blackLevel.r());
      params.black_level[1] = static_cast<float>(range * of.blackLevel.g());
      params.black_level[2] = params.black_level[1];
      params.black_level[3] = static_cast<float>(range * of.blackLevel.b());
    }
    if (of.gains.r() > 0 && of.gains.g() > 0 && of.gains.b() > 0) {
      params.valid |= LOWLUX_STAGE_HAS_COLOUR_GAINS;
      params.colour_gains[0] = static_cast<float>(of.gains.r() / of.gains.g());
      params.colour_gains[1] = static_cast<float>(of.gains.b() / of.gains.g());
    }
  }
  // Before, parameters are tables of 8 bits: the stage measures black and white.
  template <typename Parameters>
  void add_known(lowlux_stage_params& /*params*/, const Parameters& /*of*/, Rank0 /*rank*/) const {}

  // Processes a frame; access of both buffers is bracketed by the caller. @return false, after an error, if it failed
  bool run(const MappedFrameBuffer& in, const MappedFrameBuffer& out, const FrameMetadata& metadata,
           const DebayerParams& debayer) {
    lowlux_stage_params params = {};
    params.size = sizeof(params);
    params.valid = LOWLUX_STAGE_HAS_SEQUENCE | LOWLUX_STAGE_HAS_TIMESTAMP;
    params.sequence = metadata.sequence;
    params.timestamp_ns = metadata.timestamp;
    add_known(params, debayer, Rank1{});
    const lowlux_stage_source source = {in.planes()[0].data(), in.planes()[0].size(), input.stride, -1};
    lowlux_stage_picture picture = {};
    picture.size = sizeof(picture);
    picture.planes = 1;
    picture.plane[0] = {out.planes()[0].data(), out.planes()[0].size(), output.stride[0]};
    lowlux_stage_result result = {};
    result.size = sizeof(result);
    if (process(stage, &source, &picture, &params, &result, nullptr) != LOWLUX_STAGE_OK) {
      LOG(Debayer, Error) << "lowlux: " << last_error(stage);
      return false;
    }
    LOG(Debayer, Debug) << "lowlux: frame " << params.sequence << " " << params.timestamp_ns << std::setprecision(9)
                        << " black " << params.black_level[0] << " " << params.black_level[1] << " "
                        << params.black_level[3] << " gains " << params.colour_gains[0] << " " << params.colour_gains[1]
                        << " exposure " << result.exposure_ev;
    return true;
  }

  // Statistics for exposure and white balance stay libcamera's own: of a whole frame since 0.7.0, which takes the
  // mapped frame since 0.7.2; of pairs of lines before.
  struct Frame {
    uint32_t number;
    FrameBuffer* buffer;
    MappedFrameBuffer* mapped;
  };
  template <typename S>
  static auto measure(S& statistics, const Frame& of, const DebayerCpu& /*debayer*/, Rank3 /*rank*/)
      -> decltype(statistics.processFrame(of.number, 0, *of.mapped)) {
    statistics.processFrame(of.number, 0, *of.mapped);
  }
  template <typename S>
  static auto measure(S& statistics, const Frame& of, const DebayerCpu& /*debayer*/, Rank2 /*rank*/)
      -> decltype(statistics.processFrame(of.number, 0, of.buffer)) {
    statistics.processFrame(of.number, 0, of.buffer);
  }
  template <typename S>
  static auto measure(S& statistics, const Frame& of, const DebayerCpu& debayer, Rank1 /*rank*/)
      -> decltype(statistics.startFrame(of.number)) {
    statistics.startFrame(of.number);
    for_pairs_of_lines(of, debayer,
                       [&](unsigned int y, const uint8_t** lines) { statistics.processLine0(of.number, y, lines); });
    statistics.finishFrame(of.number, 0);
  }
  template <typename S>
  static auto measure(S& statistics, const Frame& of, const DebayerCpu& debayer, Rank0 /*rank*/)
      -> decltype(statistics.startFrame()) {
    statistics.startFrame();
    for_pairs_of_lines(of, debayer, [&](unsigned int y, const uint8_t** lines) { statistics.processLine0(y, lines); });
    statistics.finishFrame(of.number, 0);
  }
  template <typename F>
  static void for_pairs_of_lines(const Frame& of, const DebayerCpu& debayer, const F& function) {
    const std::size_t stride = debayer.inputConfig_.stride;
    const uint8_t* line = of.mapped->planes()[0].data() + static_cast<std::size_t>(debayer.window_.y) * stride +
                          static_cast<std::size_t>(debayer.window_.x) * debayer.inputConfig_.bpp / 8;
    for (unsigned int y = 0; y + 1 < debayer.window_.height; y += 2, line += 2 * stride) {
      const uint8_t* lines[] = {nullptr, line, line + stride};
      function(y, lines);
    }
  }

  // The time of frames, which 0.7.0 and later report.
  template <typename D>
  static auto finish_timing(D& debayer, Rank1 /*rank*/) -> decltype(debayer.bench_.finishFrame()) {
    debayer.bench_.finishFrame();
  }
  template <typename D>
  static void finish_timing(D& /*debayer*/, Rank0 /*rank*/) {}
};

}  // namespace libcamera
