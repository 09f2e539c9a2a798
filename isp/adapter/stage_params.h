#pragma once

#include <cstdint>
#include <optional>

#include "isp/adapter/lowlux_stage.h"
#include "isp/adapter/stage_budget.h"
#include "isp/adapter/stage_profile.h"
#include "isp/base/cfa.h"
#include "isp/pipeline/live/live_plan.h"

namespace lowlux::isp {

/// Returns the fault in the parameters of a frame; null if there is none. Only valid members are checked.
const char* fault_of(const lowlux_stage_params& params);

/// Holds the statements of parameters and profile on one frame.
struct StageFacts {
  LiveFacts live;
  std::uint32_t applied = 0;  // LOWLUX_STAGE_HAS_... that took effect
  std::int32_t black_from = LOWLUX_STAGE_FROM_NOTHING;
  std::int32_t noise_from = LOWLUX_STAGE_FROM_NOTHING;
  bool temporal_asked = false;  // true if requested, even without effect
};

/// Describes the stream for which the facts are made.
struct StageStream {
  RawFormat format;
  BayerPhase phase = BayerPhase::rggb;  // phase of the active area
  denoise::Level most = denoise::Level::draft;
  bool has_level = true;  // memory for a level is allocated
  bool has_masked = false;
  bool temporal = false;
};

/// Returns the most expensive work that the parameters request; frames whose level is chosen by their noise may need
/// less.
StageWork asked_of(const lowlux_stage_params& params, const StageStream& stream);

/// Returns the facts for parameters without a fault. Figures they do not state are taken from the profile, if there is
/// one.
/// @param most  upper limit of noise reduction
StageFacts facts_of(const lowlux_stage_params& params, const StageStream& stream, const StageProfile* profile,
                    StageWork most = StageWork::high);

/// Returns high, standard or draft for a level up to high.
StageWork work_of(denoise::Level level);

/// Tracks frames by sequence and time.
class StageHistory {
 public:
  /// Returns whether this frame directly follows the one that was taken last.
  bool follows(const lowlux_stage_params& params) const;
  void take(const lowlux_stage_params& params);
  void reset();

 private:
  std::optional<std::uint32_t> sequence_;
  std::optional<std::uint64_t> timestamp_ns_;
};

/// Both functions convert four figures in the order R, Gr, Gb, B: to sites and from sites.
PerSite<double> sites_of(const float (&channels)[4], BayerPhase phase);
void to_channels(const PerSite<double>& sites, BayerPhase phase, float (&channels)[4]);

}  // namespace lowlux::isp
