#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "isp/adapter/lowlux_stage.h"
#include "isp/adapter/stage_budget.h"
#include "isp/adapter/stage_exposure.h"
#include "isp/adapter/stage_formats.h"
#include "isp/adapter/stage_params.h"
#include "isp/adapter/stage_profile.h"
#include "isp/base/executor.h"
#include "isp/base/result.h"
#include "isp/pipeline/live/live_pipeline.h"

namespace lowlux::isp {

/// Implements lowlux_stage.h: the caller's formats and buffers around a LivePipeline. Structs have their full size
/// here.
class Stage {
 public:
  /// Opens a stage. Errors: settings out of range (invalid_argument), those of StageProfile::read.
  static Result<std::unique_ptr<Stage>> open(const lowlux_stage_settings& settings);

  /// Configures the stage for a stream. @return LOWLUX_STAGE_OK or LOWLUX_STAGE_ADJUSTED
  Result<int> configure(const lowlux_stage_input& in, lowlux_stage_output& out);

  struct Answers {
    lowlux_stage_result* result = nullptr;
    lowlux_stage_statistics* statistics = nullptr;
  };
  /// Processes one frame. Allocates nothing except a message if LivePipeline::plan fails. @return a code of
  /// lowlux_stage.h
  int process(const lowlux_stage_source& in, const lowlux_stage_picture& out, const lowlux_stage_params& params,
              const Answers& answers);

  void reset();
  const char* last_error() const { return message_; }
  /// Keeps as much of a message as fits; @return `code`
  int say(int code, const char* message);

 private:
  explicit Stage(const lowlux_stage_settings& settings, std::optional<StageProfile> profile);
  Result<LiveSetup> setup_for(const lowlux_stage_input& in, const RawFormat& format, StageOutput kind);
  int check_source(const lowlux_stage_source& in);
  int check_picture(const lowlux_stage_picture& out);
  void render(const lowlux_stage_picture& out);
  void report_facts(const StageFacts& facts, lowlux_stage_result& out) const;
  StageWork done() const;
  StageWork asked_for(const StageFacts& facts) const;
  void count(lowlux_stage_statistics& out) const;

  /// Holds everything that exists only between one configure and the next.
  struct Stream {
    StageStream stream;
    lowlux_stage_output layout{};
    StageOutput kind = StageOutput::rgb;
    int width = 0;
    int height = 0;  // width and height of full frames
    std::unique_ptr<LivePipeline> pipeline;
    std::unique_ptr<Nv12Writer> nv12;  // where that is the output
    StageBudget budget;
    std::unique_ptr<StageExposure> exposure;
  };

  lowlux_stage_settings settings_{};
  std::optional<StageProfile> profile_;
  PoolExecutor executor_;
  StageHistory history_;
  std::optional<Stream> stream_;
  char message_[256] = "";
};

/// Returns the bytes that a stage allocates for a stream, slightly more than it really does.
std::uint64_t stage_memory_bytes(const LiveSetup& setup, int threads);

}  // namespace lowlux::isp
