#include "isp/adapter/stage.h"

#include <linux/dma-buf.h>
#include <sys/ioctl.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <cstring>
#include <utility>

#include <fmt/format.h>

#include "calib/noise/exposure_gains.h"

namespace lowlux::isp {
namespace {

static_assert(static_cast<int>(StageWork::standard) == LOWLUX_STAGE_STEP_STANDARD &&
              static_cast<int>(StageWork::draft) == LOWLUX_STAGE_STEP_DRAFT &&
              static_cast<int>(StageWork::frames_before) == LOWLUX_STAGE_STEP_FRAMES_BEFORE &&
              static_cast<int>(StageWork::plain) == LOWLUX_STAGE_STEP_PLAIN);

constexpr int default_threads = 2, max_threads = 8;
constexpr std::uint64_t default_memory_limit = std::uint64_t{1} << 30;
constexpr std::size_t longest_stride = std::size_t{1} << 24;

bool is_empty(const lowlux_stage_rect& r) { return r.x == 0 && r.y == 0 && r.width == 0 && r.height == 0; }

int code_of(const Error& error) {
  switch (error.code) {
    case ErrorCode::unsupported:
      return LOWLUX_STAGE_UNSUPPORTED;
    case ErrorCode::insufficient:
      return LOWLUX_STAGE_UNKNOWN_LIGHT;
    case ErrorCode::too_large:
      return LOWLUX_STAGE_TOO_LARGE;
    case ErrorCode::malformed:
      return LOWLUX_STAGE_BAD_PARAMETER;
    default:
      return LOWLUX_STAGE_BAD_ARGUMENT;
  }
}

/// Brackets the processor's access to a dma-buf; other descriptors reject this, which has no effect.
class DmaAccess {
 public:
  explicit DmaAccess(int fd) : fd_(fd) { sync(DMA_BUF_SYNC_START); }
  ~DmaAccess() { sync(DMA_BUF_SYNC_END); }
  DmaAccess(const DmaAccess&) = delete;
  DmaAccess& operator=(const DmaAccess&) = delete;

 private:
  void sync(std::uint64_t step) const {
    if (fd_ < 0) return;
    dma_buf_sync request{};
    request.flags = step | DMA_BUF_SYNC_READ;
    for (int tries = 0; tries < 8; ++tries) {
      if (ioctl(fd_, DMA_BUF_IOCTL_SYNC, &request) == 0 || (errno != EINTR && errno != EAGAIN)) return;
    }
  }
  int fd_;
};

Result<void> check(const lowlux_stage_settings& s) {
  const auto wrong = [](const char* message) { return fail(ErrorCode::invalid_argument, message); };
  if (s.threads < 0 || s.threads > max_threads) return wrong("the number of threads must be 1 to 8, or 0 for 2");
  if (s.most_denoise < 0 || s.most_denoise > LOWLUX_STAGE_LEVEL_HIGH) return wrong("no such level of noise reduction");
  if (s.look != LOWLUX_STAGE_LOOK_CAMERA && s.look != LOWLUX_STAGE_LOOK_EYE) return wrong("no such look");
  if (s.demosaic < 0 || s.demosaic > LOWLUX_STAGE_DEMOSAIC_RESIDUAL_MEDIAN)
    return wrong("no such method of demosaicing");
  if (s.tone != 0 && s.tone != 1) return wrong("no such tone curve");
  if (s.temporal != 0 && s.temporal != 1) return wrong("temporal must be 0 or 1");
  if (!(s.field_of_view_deg == 0 || (s.field_of_view_deg >= 0.1 && s.field_of_view_deg <= 180))) {
    return wrong("the field of view must be 0.1 to 180 degrees");
  }
  return {};
}

denoise::Level level_of(std::int32_t level) {
  return level <= LOWLUX_STAGE_LEVEL_DRAFT ? denoise::Level::draft : static_cast<denoise::Level>(level - 1);
}

struct InverseRange {
  double mean = 0;
  double mean_square = 0;
};

/// Returns 1 / (white - black) [1/DN], for the sites that the green of a noise profile applies to.
InverseRange green_range(const RawDn& raw, const BlackPoint& black) {
  InverseRange out;
  int sites = 0;
  for (int site = 0; site < 4; ++site) {
    if (raw.layout == SensorLayout::bayer && colour_at(raw.phase, site & 1, site >> 1) != CfaColour::green) continue;
    const double inverse = 1 / (raw.white_dn[1] - black.pedestal_dn[site]);
    out.mean += inverse;
    out.mean_square += inverse * inverse;
    ++sites;
  }
  out.mean /= sites;
  out.mean_square /= sites;
  return out;
}

Rect rect_of(const lowlux_stage_rect& r) { return {r.x, r.y, r.width, r.height}; }

std::vector<Pixel> defects_of(const StageProfile& profile, const Rect& active) {
  std::vector<Pixel> out;
  for (const HotPixelFigure& hot : profile.hot_pixels()) {
    const std::int64_t x = std::int64_t{hot.x} - active.x, y = std::int64_t{hot.y} - active.y;
    if (x < 0 || y < 0 || x >= active.width || y >= active.height) continue;
    out.push_back({static_cast<int>(x), static_cast<int>(y)});
  }
  return out;
}

}  // namespace

std::uint64_t stage_memory_bytes(const LiveSetup& setup, int threads) {
  const auto area = [](int width, int height) {
    return static_cast<std::uint64_t>(std::max(width, 0)) * static_cast<std::uint64_t>(std::max(height, 0));
  };
  // A crop beyond the frame is rejected later.
  const std::uint64_t rounded =
      area(std::min(setup.active.width, setup.width) + 128, std::min(setup.active.height, setup.height) + 16);
  std::uint64_t for_each = 0;  // bytes per pixel; none if codes are converted directly to the image
  if (setup.levels || setup.temporal) {
    for_each = 12;  // mosaics in electrons
  } else if (!setup.defects.empty() || setup.format.layout == SensorLayout::monochrome) {
    for_each = 4;  // the repaired mosaic, or its plane
  }
  if (setup.levels) for_each += 24;    // Denoiser
  if (setup.temporal) for_each += 22;  // TemporalMean, its mean, maps
  if (setup.look.look == Look::eye) for_each += 8;
  if (setup.samples == SampleType::u16) for_each += 6;  // the warm-up frame's image
  const auto row = static_cast<std::uint64_t>(setup.width) + 4096;
  // A warm-up frame of the stream's own size is processed once.
  return 2 * area(setup.width, setup.height) +
         row_bytes(setup.format, setup.width) * static_cast<std::uint64_t>(setup.height) + for_each * rounded +
         static_cast<std::uint64_t>(threads) * row * 1400 + (std::uint64_t{4} << 20);
}

Stage::Stage(const lowlux_stage_settings& settings, std::optional<StageProfile> profile)
    : settings_(settings),
      profile_(std::move(profile)),
      executor_(settings.threads == 0 ? default_threads : settings.threads) {
  settings_.profile_file = nullptr;  // owned by the caller
}

Result<std::unique_ptr<Stage>> Stage::open(const lowlux_stage_settings& settings) {
  if (Result<void> checked = check(settings); !checked) return tl::make_unexpected(checked.error());
  std::optional<StageProfile> profile;
  if (settings.profile_file != nullptr) {
    Result<StageProfile> read = StageProfile::read(settings.profile_file);
    if (!read) return tl::make_unexpected(read.error());
    profile = *std::move(read);
  }
  return std::unique_ptr<Stage>(new Stage(settings, std::move(profile)));
}

int Stage::say(int code, const char* message) {
  std::strncpy(message_, message, sizeof message_ - 1);
  return code;
}

Result<LiveSetup> Stage::setup_for(const lowlux_stage_input& in, const RawFormat& format, StageOutput kind) {
  LiveSetup setup{.format = format, .width = in.width, .height = in.height};
  setup.active = is_empty(in.crop) ? Rect{0, 0, in.width, in.height} : rect_of(in.crop);
  if (!is_empty(in.masked)) setup.masked = {rect_of(in.masked)};
  setup.white_dn = in.white_level;
  setup.tone = settings_.tone == 1 ? ToneCurve::standard : ToneCurve::none;
  setup.samples = kind == StageOutput::rgb48 ? SampleType::u16 : SampleType::u8;
  if (settings_.look == LOWLUX_STAGE_LOOK_EYE) setup.look.look = Look::eye;
  if (settings_.field_of_view_deg > 0) setup.look.field_of_view_deg = settings_.field_of_view_deg;
  const bool is_reducible = format.layout == SensorLayout::bayer;
  setup.levels = is_reducible && settings_.most_denoise != LOWLUX_STAGE_LEVEL_NONE;
  setup.most = level_of(settings_.most_denoise);
  setup.temporal = is_reducible && settings_.temporal == 1;
  if (settings_.demosaic != LOWLUX_STAGE_DEMOSAIC_DEFAULT) {
    setup.max_demosaic = static_cast<DemosaicMethod>(settings_.demosaic - LOWLUX_STAGE_DEMOSAIC_MALVAR);
  }
  if (!profile_) return setup;
  const BayerPhase phase = phase_of_crop(format.phase, setup.active.x & 1, setup.active.y & 1);
  if (Result<void> fits = profile_->prepare(format, phase); !fits) return tl::make_unexpected(fits.error());
  setup.colour.calibrations = profile_->calibrations();
  setup.defects = defects_of(*profile_, setup.active);
  return setup;
}

Result<int> Stage::configure(const lowlux_stage_input& in, lowlux_stage_output& out) {
  stream_.reset();
  history_.reset();
  const auto format = stage_input(in.api, in.fourcc, in.modifier);
  if (!format) return fail(ErrorCode::unsupported, "the input is not in a raw format that lowlux reads");
  const auto kind = stage_output(out.fourcc);
  if (!kind) return fail(ErrorCode::unsupported, "the output is not a format that lowlux writes");
  if (*kind == StageOutput::mosaic && format->layout != SensorLayout::bayer) {
    return fail(ErrorCode::unsupported, "a monochrome input has no mosaic to output");
  }
  if (out.yuv_matrix != 0 && out.yuv_matrix != 601 && out.yuv_matrix != 709) {
    return fail(ErrorCode::invalid_argument, "the matrix of NV12 must be 601 or 709, or 0 for the default");
  }
  Result<LiveSetup> setup = setup_for(in, *format, *kind);
  if (!setup) return tl::make_unexpected(setup.error());
  if (in.width < 2 || in.height < 2 || in.width > 65536 || in.height > 65536) {
    return fail(ErrorCode::invalid_argument, "width and height of frames must be 2 to 65536 pixels");
  }
  const std::uint64_t limit = settings_.memory_limit == 0 ? default_memory_limit : settings_.memory_limit;
  if (const std::uint64_t wanted = stage_memory_bytes(*setup, executor_.width()); wanted > limit) {
    return fail(ErrorCode::too_large, fmt::format("frames of {} x {} take {} MiB, more than the limit of {}", in.width,
                                                  in.height, wanted >> 20U, limit >> 20U));
  }
  if (in.stride != 0 && (in.stride < row_bytes(*format, in.width) || in.stride > longest_stride)) {
    return fail(ErrorCode::invalid_argument, "the stride of the input is shorter than a row, or implausibly long");
  }
  Stream made;
  made.kind = *kind;
  made.width = in.width;
  made.height = in.height;
  const Rect active = setup->active;
  made.stream = {.format = *format,
                 .phase = phase_of_crop(format->phase, active.x & 1, active.y & 1),
                 .most = setup->most,
                 .has_level = setup->levels,
                 .has_masked = !setup->masked.empty(),
                 .temporal = setup->temporal};
  Result<std::unique_ptr<LivePipeline>> pipeline = LivePipeline::make(*std::move(setup), executor_);
  if (!pipeline) return tl::make_unexpected(pipeline.error());
  made.pipeline = *std::move(pipeline);
  const bool hd = out.yuv_matrix == 709 || (out.yuv_matrix == 0 && active.height >= 720);
  if (*kind == StageOutput::nv12) {
    made.nv12 = std::make_unique<Nv12Writer>(hd ? YuvStandard::bt709 : YuvStandard::bt601, active.width, active.height,
                                             executor_.width());
  }
  auto gains = calib::exposure_gains(StageExposure::factors(), *format, made.pipeline->frame().raw.white_dn[1],
                                     profile_ ? &profile_->profile() : nullptr);
  if (!gains) return tl::make_unexpected(gains.error());
  made.exposure = std::make_unique<StageExposure>(*format, *std::move(gains));
  made.budget = StageBudget(settings_.look == LOWLUX_STAGE_LOOK_EYE, made.stream.temporal);
  const bool adjusted = lay_out(*kind, active.width, active.height, out);
  made.layout = out;
  stream_ = std::move(made);
  return adjusted ? LOWLUX_STAGE_ADJUSTED : LOWLUX_STAGE_OK;
}

int Stage::check_source(const lowlux_stage_source& in) {
  if (in.data == nullptr) return say(LOWLUX_STAGE_MISSING_PLANE, "the input is missing");
  const std::size_t row = row_bytes(stream_->stream.format, stream_->width);
  if (in.stride < row || in.stride > longest_stride) {
    return say(LOWLUX_STAGE_BAD_STRIDE, "the stride of the input is shorter than a row, or implausibly long");
  }
  if (in.length < in.stride * static_cast<std::size_t>(stream_->height - 1) + row) {
    return say(LOWLUX_STAGE_SHORT_BUFFER, "the input ends before the frame does");
  }
  return LOWLUX_STAGE_OK;
}

int Stage::check_picture(const lowlux_stage_picture& out) {
  const lowlux_stage_output& layout = stream_->layout;
  if (out.planes < layout.planes) return say(LOWLUX_STAGE_MISSING_PLANE, "the output has too few planes");
  for (int i = 0; i < layout.planes; ++i) {
    const lowlux_stage_plane& plane = out.plane[i];
    if (plane.data == nullptr) return say(LOWLUX_STAGE_MISSING_PLANE, "a plane of the output is missing");
    const std::size_t row = plane_row_bytes(stream_->kind, layout.width, i);
    const bool wide = stream_->kind == StageOutput::rgb48 || stream_->kind == StageOutput::mosaic;
    const bool even = !wide || (plane.stride % 2 == 0 && reinterpret_cast<std::uintptr_t>(plane.data) % 2 == 0);
    if (plane.stride < row || plane.stride > longest_stride || !even) {
      return say(LOWLUX_STAGE_BAD_STRIDE,
                 "a stride of the output is shorter than a row, odd for 16 bits, or implausibly long");
    }
    const auto rows = static_cast<std::size_t>(plane_rows(stream_->kind, layout.height, i));
    if (plane.length < plane.stride * (rows - 1) + row) {
      return say(LOWLUX_STAGE_SHORT_BUFFER, "a plane of the output ends before the image does");
    }
  }
  return LOWLUX_STAGE_OK;
}

void Stage::render(const lowlux_stage_picture& out) {
  const lowlux_stage_plane& first = out.plane[0];
  const PlaneView<std::uint16_t> wide{static_cast<std::uint16_t*>(first.data), stream_->layout.width,
                                      stream_->layout.height, static_cast<std::ptrdiff_t>(first.stride / 2)};
  switch (stream_->kind) {
    case StageOutput::rgb48:
      stream_->pipeline->render({wide.data, 3 * wide.width, wide.height, wide.stride});
      return;
    case StageOutput::mosaic:
      stream_->pipeline->render_mosaic(wide);
      return;
    case StageOutput::nv12:
      stream_->pipeline->render(stream_->nv12->sink(out.plane));
      return;
    default:
      stream_->pipeline->render(pixels_in(first, stream_->kind, stream_->layout.width, stream_->layout.height));
  }
}

int Stage::process(const lowlux_stage_source& in, const lowlux_stage_picture& out, const lowlux_stage_params& params,
                   const Answers& answers) {
  if (!stream_) return say(LOWLUX_STAGE_NOT_CONFIGURED, "the stage is not configured");
  if (const int wrong = check_source(in); wrong != LOWLUX_STAGE_OK) return wrong;
  if (const int wrong = check_picture(out); wrong != LOWLUX_STAGE_OK) return wrong;
  if (const char* fault = fault_of(params); fault != nullptr) return say(LOWLUX_STAGE_BAD_PARAMETER, fault);
  const auto start = std::chrono::steady_clock::now();
  LivePipeline& pipeline = *stream_->pipeline;
  const StageWork asked = asked_of(params, stream_->stream);
  const bool has_budget = (params.valid & LOWLUX_STAGE_HAS_BUDGET) != 0;
  const StageWork most = has_budget ? stream_->budget.choose(params.budget_ms, asked) : asked;
  StageFacts facts = facts_of(params, stream_->stream, profile_ ? &*profile_ : nullptr, most);
  facts.live.follows = history_.follows(params);
  if (most >= StageWork::draft && most > asked) facts.live.max_demosaic = DemosaicMethod::encoded_malvar;
  {
    const DmaAccess access(in.fd);
    pipeline.read({static_cast<const std::byte*>(in.data), in.length}, in.stride, facts.live,
                  answers.statistics != nullptr);
  }
  if (const Result<void> planned = pipeline.plan(facts.live); !planned) {
    return say(code_of(planned.error()), planned.error().message.c_str());
  }
  history_.take(params);
  render(out);
  const std::chrono::duration<double, std::milli> took = std::chrono::steady_clock::now() - start;
  if (answers.result != nullptr) {
    report_facts(facts, *answers.result);
    const MeteredBlack black{pipeline.decided().levels.black.pedestal_dn,
                             pipeline.decision().black == LiveSource::frame};
    if (stream_->exposure->advise(pipeline.frame().raw, black, params, *answers.result)) {
      answers.result->applied |= LOWLUX_STAGE_HAS_EXPOSURE_LIMITS;
    }
    answers.result->took_ms = static_cast<float>(took.count());
  }
  stream_->budget.took(done(), took.count());
  if (answers.statistics != nullptr) count(*answers.statistics);
  return LOWLUX_STAGE_OK;
}

void Stage::reset() {
  history_.reset();
  if (!stream_) return;
  stream_->pipeline->reset();
  stream_->exposure->reset();
}

/// Returns the work done on the frame.
StageWork Stage::done() const {
  const NoiseReduction& reduction = stream_->pipeline->decided().noise_reduction;
  if (reduction.level) return work_of(*reduction.level);
  return reduction.temporal ? StageWork::frames_before : StageWork::plain;
}

/// Returns the work that the frame would have got without a budget.
StageWork Stage::asked_for(const StageFacts& facts) const {
  const LiveDecision& decision = stream_->pipeline->decision();
  if (decision.level) return work_of(*decision.level);
  const bool averages = stream_->stream.temporal && facts.temporal_asked && decision.reducible;
  return averages ? StageWork::frames_before : StageWork::plain;
}

void Stage::report_facts(const StageFacts& facts, lowlux_stage_result& out) const {
  const LivePipeline& pipeline = *stream_->pipeline;
  const DevelopPlan& plan = pipeline.decided();
  const LiveDecision& decision = pipeline.decision();
  const auto source = [](LiveSource from, std::int32_t given) {
    if (from == LiveSource::given) return given;
    if (from == LiveSource::masked_pixels) return static_cast<std::int32_t>(LOWLUX_STAGE_FROM_MASKED);
    return static_cast<std::int32_t>(from == LiveSource::frame ? LOWLUX_STAGE_FROM_FRAME : LOWLUX_STAGE_FROM_NOTHING);
  };
  out.applied = facts.applied;
  out.black_from = source(decision.black, facts.black_from);
  out.noise_from = source(decision.noise, facts.noise_from);
  out.white_from = source(decision.white, LOWLUX_STAGE_FROM_PARAMS);
  to_channels(plan.levels.black.pedestal_dn, stream_->stream.phase, out.black_level);
  out.noise_gain = out.noise_read = 0;
  if (const auto& noise = pipeline.frame().noise; noise) {
    const auto [inverse, square] = green_range(pipeline.frame().raw, plan.levels.black);
    out.noise_gain = static_cast<float>(noise->scale[1] / inverse);
    out.noise_read = static_cast<float>(std::sqrt(noise->offset[1] / square));
  }
  out.colour_gains[0] = plan.rendering.white_gain[0] / plan.rendering.white_gain[1];
  out.colour_gains[1] = plan.rendering.white_gain[2] / plan.rendering.white_gain[1];
  out.exposure_ev = static_cast<float>(plan.rendering.exposure_ev);
  const auto& level = plan.noise_reduction.level;
  out.level = level ? static_cast<std::int32_t>(*level) + 1 : LOWLUX_STAGE_LEVEL_NONE;
  out.step = done() == asked_for(facts) ? LOWLUX_STAGE_STEP_ALL : static_cast<std::int32_t>(done());
  out.predicted_ms = static_cast<float>(stream_->budget.predicted_ms(done()));
  const auto& temporal = plan.noise_reduction.temporal;
  out.temporal = temporal && !temporal->restart ? 1 : 0;
  out.moved = out.temporal == 1 ? static_cast<float>(pipeline.moved()) : 0;
  out.scene_luminance_cd_m2 = plan.rendering.look ? static_cast<float>(plan.rendering.look->mean_cd_m2) : 0;
  out.adaptation = plan.rendering.look ? static_cast<float>(plan.rendering.look->state.m) : 1;
}

void Stage::count(lowlux_stage_statistics& out) const {
  LivePipeline& pipeline = *stream_->pipeline;
  const FrameStatistics& statistics = pipeline.meter().statistics();
  std::ranges::copy(statistics.sum, out.sum);
  std::ranges::copy(statistics.count, out.count);
  const auto pixels = static_cast<double>(statistics.pixels);
  out.clipped = static_cast<float>(static_cast<double>(statistics.clipped) / pixels);
  out.zero = static_cast<float>(static_cast<double>(statistics.zero) / pixels);
  std::ranges::copy(statistics.luma, out.luma);
  std::ranges::fill(out.luma64, 0U);
  for (std::size_t i = 0; i < statistics.luma.size(); ++i) out.luma64[i / 16] += statistics.luma[i];
  const auto masked = pipeline.meter().masked_dn();
  to_channels(masked ? *masked : pipeline.meter().tiles().darkest_dn(), stream_->stream.phase, out.measured_black);
  out.measured_black_masked = masked ? 1 : 0;
  const auto& noise = pipeline.decision().measured;
  out.measured_noise_gain = noise ? static_cast<float>(noise->gain_dn) : 0;
  out.measured_noise_read = noise ? static_cast<float>(std::sqrt(noise->offset_dn2)) : 0;
}

}  // namespace lowlux::isp
