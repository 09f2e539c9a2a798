#include <algorithm>
#include <array>
#include <chrono>
#include <cstddef>
#include <cstdio>
#include <memory>
#include <thread>
#include <utility>

#include <fmt/format.h>

#include "capture/camera/camera_frame.h"
#include "isp/adapter/lowlux_stage.h"
#include "isp/base/packed/raw_format.h"
#include "isp/cli/capture/capture_sink.h"
#include "isp/cli/shared/lines.h"
#include "isp/cli/shared/report.h"
#include "isp/output/picture/y4m.h"

namespace lowlux::cli {
namespace {

using std::chrono::steady_clock;

constexpr std::uint64_t memory_limit = std::uint64_t{4} << 30;
constexpr double usual_frame_rate_hz = 30;  // of a video whose camera does not state its rate

struct Release {
  void operator()(lowlux_stage* stage) const { lowlux_stage_release(stage); }
};
using StageHandle = std::unique_ptr<lowlux_stage, Release>;

double seconds_since(steady_clock::time_point start) {
  return std::chrono::duration<double>(steady_clock::now() - start).count();
}

lowlux_stage_settings settings_of(const CaptureArgs& args) {
  const isp::DevelopOptions& options = args.develop.options;
  lowlux_stage_settings out{};
  out.size = sizeof out;
  out.threads = static_cast<std::int32_t>(std::clamp(std::thread::hardware_concurrency(), 1U, 8U));
  out.memory_limit = memory_limit;
  out.profile_file = args.develop.profile.empty() ? nullptr : args.develop.profile.c_str();
  out.most_denoise = LOWLUX_STAGE_LEVEL_STANDARD;
  if (options.denoise.mode == isp::DenoiseChoice::Mode::off) out.most_denoise = LOWLUX_STAGE_LEVEL_NONE;
  if (options.demosaic) out.demosaic = static_cast<std::int32_t>(*options.demosaic) + LOWLUX_STAGE_DEMOSAIC_MALVAR;
  if (options.denoise.mode == isp::DenoiseChoice::Mode::level) {
    out.most_denoise = static_cast<std::int32_t>(options.denoise.level) + LOWLUX_STAGE_LEVEL_DRAFT;
  }
  out.temporal = args.temporal ? 1 : 0;
  out.look = options.look.look == isp::Look::eye ? LOWLUX_STAGE_LOOK_EYE : LOWLUX_STAGE_LOOK_CAMERA;
  out.tone = args.develop.tone.value_or(isp::ToneCurve::standard) == isp::ToneCurve::standard ? 1 : 0;
  out.field_of_view_deg = options.look.field_of_view_deg;
  return out;
}

std::int32_t denoise_of(const isp::DenoiseChoice& choice) {
  using Mode = isp::DenoiseChoice::Mode;
  if (choice.mode == Mode::automatic) return LOWLUX_STAGE_DENOISE_AUTO;
  if (choice.mode == Mode::off) return LOWLUX_STAGE_DENOISE_MINIMAL;  // temporal history alone, if enabled
  return choice.level == denoise::Level::draft ? LOWLUX_STAGE_DENOISE_FAST : LOWLUX_STAGE_DENOISE_HIGH_QUALITY;
}

/// Sets values within the stage's own bounds; values beyond them count as unknown.
template <class T>
void set_if(const std::optional<double>& value, double low, double high, std::uint32_t bit, T& member,
            lowlux_stage_params& out) {
  if (!value || !(*value >= low && *value <= high)) return;
  member = static_cast<T>(*value);
  out.valid |= bit;
}

template <std::size_t kCount>
void set_all_if(const std::optional<std::array<double, kCount>>& values, double low, double high, std::uint32_t bit,
                float (&members)[kCount], lowlux_stage_params& out) {
  const auto fits = [&](double value) { return value >= low && value <= high; };
  if (!values || !std::ranges::all_of(*values, fits)) return;
  std::ranges::transform(*values, members, [](double value) { return static_cast<float>(value); });
  out.valid |= bit;
}

/// Returns the rate the camera states, else the requested one: libcamera does not state it.
double rate_of(const CaptureArgs& args, const capture::CameraFormat& format) {
  if (format.frame_rate_hz) return *format.frame_rate_hz;
  return args.request.frame_rate_hz.value_or(usual_frame_rate_hz);
}

/// @param taken  number of previous frames
lowlux_stage_params params_of(const capture::CameraFrame& frame, const RawFormat& format, const CaptureArgs& args,
                              std::uint32_t taken) {
  const capture::FrameFacts& facts = frame.facts;
  const isp::DevelopOptions& options = args.develop.options;
  lowlux_stage_params out{};
  out.size = sizeof out;
  set_all_if(facts.black_level_dn, 0, largest_code(format), LOWLUX_STAGE_HAS_BLACK, out.black_level, out);
  if (options.black.choice == isp::BlackChoice::given) {
    for (int site = 0; site < 4; ++site) {
      out.black_level[black_channel_of(site, format.phase)] = static_cast<float>(options.black.given_dn[site]);
    }
    out.valid |= LOWLUX_STAGE_HAS_BLACK;
  }
  set_if(facts.exposure_s, 1e-7, 1e5, LOWLUX_STAGE_HAS_EXPOSURE, out.exposure_s, out);
  set_if(facts.analogue_gain, 0.1, 1e4, LOWLUX_STAGE_HAS_ANALOGUE_GAIN, out.analogue_gain, out);
  if (options.white_balance.mode == isp::WhiteBalanceChoice::Mode::as_shot) {
    set_all_if(facts.colour_gains, 1e-3, 1e3, LOWLUX_STAGE_HAS_COLOUR_GAINS, out.colour_gains, out);
  }
  if (args.develop.profile.empty()) {
    set_all_if(facts.colour_matrix, -1e3, 1e3, LOWLUX_STAGE_HAS_COLOUR_MATRIX, out.colour_matrix, out);
  }
  set_if(facts.lux, 1e-6, 1e9, LOWLUX_STAGE_HAS_LUX, out.lux, out);
  set_if(facts.temperature_c, -100, 200, LOWLUX_STAGE_HAS_TEMPERATURE, out.temperature_c, out);
  set_if(options.exposure_ev, -10, 20, LOWLUX_STAGE_HAS_EXPOSURE_VALUE, out.exposure_ev, out);
  set_if(options.look.scene_luminance_cd_m2, 1e-7, 1e9, LOWLUX_STAGE_HAS_SCENE_LUMINANCE, out.scene_luminance_cd_m2,
         out);
  set_if(args.budget_ms, 0.01, 1e6, LOWLUX_STAGE_HAS_BUDGET, out.budget_ms, out);
  out.denoise = denoise_of(options.denoise);
  out.sequence = taken;  // lost frames count as a pause of unchanged duration
  out.valid |= LOWLUX_STAGE_HAS_DENOISE | LOWLUX_STAGE_HAS_SEQUENCE;
  if (frame.timestamp.count() > 0) {
    out.timestamp_ns = static_cast<std::uint64_t>(frame.timestamp.count());
    out.valid |= LOWLUX_STAGE_HAS_TIMESTAMP;
  }
  return out;
}

class LiveSink final : public CaptureSink {
 public:
  LiveSink(const CaptureArgs& args, CaptureStream stream, StageHandle stage, const lowlux_stage_output& layout, int out,
           const std::atomic<bool>& stop)
      : args_(args),
        stream_(std::move(stream)),
        stage_(std::move(stage)),
        layout_(layout),
        luma_(static_cast<int>(layout.stride[0]), layout.height),
        chroma_(static_cast<int>(layout.stride[1]), (layout.height + 1) / 2),
        writer_(out, {layout.width, layout.height, rate_of(args, stream_.format)}),
        stop_(stop) {}

  Result<bool> take(const capture::CameraFrame& frame, CaptureWork& work) override {
    auto start = steady_clock::now();
    if (auto made = process(frame, work); !made) return tl::make_unexpected(made.error());
    work.process_s += seconds_since(start);
    start = steady_clock::now();
    const auto luma = luma_.view().crop(0, 0, layout_.width, layout_.height);
    const auto chroma = chroma_.view().crop(0, 0, 2 * ((layout_.width + 1) / 2), chroma_.height());
    const auto written = writer_.write(luma, chroma, stop_);
    work.write_s += seconds_since(start);
    if (!written) return tl::make_unexpected(written.error());
    return *written == isp::Y4mWriter::Written::whole;
  }

 private:
  Result<void> process(const capture::CameraFrame& frame, CaptureWork& work) {
    const lowlux_stage_source in{frame.bytes.data(), frame.bytes.size(), stream_.format.stride_bytes, -1};
    lowlux_stage_picture out{};
    out.size = sizeof out;
    out.planes = 2;
    out.plane[0] = {luma_.data(), luma_.size(), layout_.stride[0]};
    out.plane[1] = {chroma_.data(), chroma_.size(), layout_.stride[1]};
    const lowlux_stage_params params = params_of(frame, stream_.format.raw, args_, taken_);
    if (taken_++ == 0) warn_of_colours(params);
    lowlux_stage_result result{};
    result.size = sizeof result;
    if (lowlux_stage_process(stage_.get(), &in, &out, &params, &result, nullptr) < 0) {
      return fail(ErrorCode::insufficient, lowlux_stage_last_error(stage_.get()));
    }
    if (args_.budget_ms) {
      if (!work.steps) work.steps.emplace();
      ++work.steps->at(static_cast<std::size_t>(result.step));
    }
    return {};
  }

  void warn_of_colours(const lowlux_stage_params& params) const {
    const bool known = !args_.develop.profile.empty() || (params.valid & LOWLUX_STAGE_HAS_COLOUR_MATRIX) != 0;
    if (known || args_.develop.quiet || stream_.format.raw.layout != SensorLayout::bayer) return;
    print_err(fmt::format("{}\n",
                          one_line(fmt::format("lowlux: {}: warning: {}", stream_.camera, capture::colours_unknown))));
  }

  const CaptureArgs& args_;
  CaptureStream stream_;
  StageHandle stage_;
  std::uint32_t taken_ = 0;
  lowlux_stage_output layout_;
  Plane<std::uint8_t> luma_, chroma_;
  isp::Y4mWriter writer_;
  const std::atomic<bool>& stop_;
};

lowlux_stage_input input_of(const capture::CameraFormat& format, const RawFormatNames& names) {
  lowlux_stage_input in{};
  in.size = sizeof in;
  in.api = names.v4l2_fourcc != 0 ? LOWLUX_STAGE_V4L2 : LOWLUX_STAGE_DRM;
  in.fourcc = names.v4l2_fourcc != 0 ? names.v4l2_fourcc : names.drm_fourcc;
  in.modifier = names.v4l2_fourcc != 0 ? 0 : names.drm_modifier;
  in.width = format.width;
  in.height = format.height;
  in.stride = format.stride_bytes;
  return in;
}

}  // namespace

Result<std::unique_ptr<CaptureSink>> make_live_sink(const CaptureArgs& args, const CaptureStream& stream, int out,
                                                    const std::atomic<bool>& stop) {
  const RawFormatNames* names = names_of(stream.format.raw);
  if (names == nullptr) return fail(ErrorCode::unsupported, "the camera's raw format has no name", stream.camera);
  const lowlux_stage_settings settings = settings_of(args);
  std::array<char, 512> message{};
  lowlux_stage* opened = nullptr;
  if (lowlux_stage_open(&settings, &opened, message.data(), message.size()) < 0) {
    return fail(ErrorCode::invalid_argument, message.data(), "--live");
  }
  StageHandle stage(opened);
  const lowlux_stage_input in = input_of(stream.format, *names);
  lowlux_stage_output layout{};
  layout.size = sizeof layout;
  layout.fourcc = LOWLUX_STAGE_NV12;
  if (lowlux_stage_configure(stage.get(), &in, &layout) < 0) {
    return fail(ErrorCode::unsupported, lowlux_stage_last_error(stage.get()), "--live");
  }
  return std::make_unique<LiveSink>(args, stream, std::move(stage), layout, out, stop);
}

}  // namespace lowlux::cli
