#pragma once

#include <cstdint>
#include <optional>

#include "isp/adapter/lowlux_stage.h"
#include "isp/adapter/stage_budget.h"
#include "isp/adapter/stage_profile.h"
#include "isp/base/cfa.h"
#include "isp/pipeline/live/live_plan.h"

namespace lowlux::isp {

/// What is wrong with the parameters of a frame; null if nothing is. Only valid members are looked at.
const char* fault_of(const lowlux_stage_params& params);

/// What parameters and profile say of one frame.
struct StageFacts {
  LiveFacts live;
  std::uint32_t applied = 0;  // LOWLUX_STAGE_HAS_... that took effect
  std::int32_t black_from = LOWLUX_STAGE_FROM_NOTHING;
  std::int32_t noise_from = LOWLUX_STAGE_FROM_NOTHING;
  bool temporal_asked = false;  // whatever came of it
};

/// What the facts are made for.
struct StageStream {
  RawFormat format;
  BayerPhase phase = BayerPhase::rggb;  // of the active area
  denoise::Level most = denoise::Level::draft;
  bool has_level = true;  // there is memory for one
  bool has_masked = false;
  bool temporal = false;
};

/// The dearest work that the parameters ask for; frames by whose noise a level is chosen may come to less.
StageWork asked_of(const lowlux_stage_params& params, const StageStream& stream);

/// Parameters of which fault_of finds none. What they do not tell the profile does, if there is one.
/// @param most  noise reduction stays within this
StageFacts facts_of(const lowlux_stage_params& params, const StageStream& stream, const StageProfile* profile,
                    StageWork most = StageWork::high);

/// high, standard or draft, as a level up to high is.
StageWork work_of(denoise::Level level);

/// Follows frames by sequence and time.
class StageHistory {
 public:
  /// Whether this frame comes right after the one that was taken last.
  bool follows(const lowlux_stage_params& params) const;
  void take(const lowlux_stage_params& params);
  void reset();

 private:
  std::optional<std::uint32_t> sequence_;
  std::optional<std::uint64_t> timestamp_ns_;
};

/// Four figures in the order R, Gr, Gb, B, to and from sites.
PerSite<double> sites_of(const float (&channels)[4], BayerPhase phase);
void to_channels(const PerSite<double>& sites, BayerPhase phase, float (&channels)[4]);

}  // namespace lowlux::isp
