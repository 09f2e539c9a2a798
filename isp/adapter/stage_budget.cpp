#include "isp/adapter/stage_budget.h"

#include <algorithm>

namespace lowlux::isp {
namespace {

// Milliseconds of an early run of README.md's table, 1920x1080, two threads. It has no value for high: it is
// extrapolated from standard and draft in proportion to denoise/README.md (33 - 21 and 50 - 33 ms/MP).
constexpr std::array<double, 5> camera_ms{77, 50, 31, 14, 9.2};
constexpr std::array<double, 5> eye_ms{92, 65, 46, 22, 19.2};
// Time that previous frames add to a level: temporal and draft minus draft.
constexpr double camera_temporal_ms = 11;
constexpr double eye_temporal_ms = 5;

constexpr double rise = 0.75, fall = 0.1;
constexpr double longest_ms = 1e9;
constexpr double climb_slack = 1.1;
constexpr double hope = 0.5;  // fraction of its prediction that the time of more expensive work moves to
constexpr int forget_frames = 100;
constexpr int max_patience = 8;

}  // namespace

StageBudget::StageBudget(bool eye, bool temporal) : fraction_(eye ? eye_ms : camera_ms), temporal_(temporal) {
  if (!temporal) return;
  for (std::size_t i = 0; i <= static_cast<std::size_t>(StageWork::draft); ++i) {
    fraction_[i] += eye ? eye_temporal_ms : camera_temporal_ms;
  }
}

StageWork StageBudget::choose(double budget_ms, StageWork asked) {
  const StageWork before = chosen_;
  const bool known = predicted_ms(StageWork::plain) > 0;
  chosen_ = StageWork::plain;
  for (auto i = static_cast<std::size_t>(asked); known && i < static_cast<std::size_t>(StageWork::plain); ++i) {
    const auto work = static_cast<StageWork>(i);
    if (work == StageWork::frames_before && !temporal_) continue;
    if (ms_[i] * (work < before ? climb_slack : 1) <= budget_ms) {
      chosen_ = work;
      break;
    }
  }
  learn_from(before, chosen_, asked);
  return chosen_;
}

/// Adapts the time to the next trial of more expensive work to the length of the last trial.
void StageBudget::learn_from(StageWork before, StageWork now, StageWork asked) {
  if (now < before) {
    trial_frames_ = 0;
  } else if (now > before) {
    const bool gave_up = trial_frames_ && now != asked;  // and less was not requested
    if (gave_up) patience_ = std::min(2 * patience_, max_patience);
    trial_frames_.reset();
  } else if (trial_frames_ && ++*trial_frames_ == forget_frames) {
    patience_ = 1;
    trial_frames_.reset();
  }
}

void StageBudget::took(StageWork work, double ms) {
  if (!(ms > 0 && ms <= longest_ms)) return;
  const auto own = static_cast<std::size_t>(work);
  ms_[own] = measured_[own] ? ms_[own] + (ms > ms_[own] ? rise : fall) * (ms - ms_[own]) : ms;
  measured_[own] = true;
  for (std::size_t i = 0; i < works; ++i) {
    if (i == own) continue;
    const double expected = ms_[own] * fraction_[i] / fraction_[own];
    if (!(ms_[i] > 0)) ms_[i] = expected;
    // A first frame is slow for reasons outside of the relative times.
    if (!measured_[i]) ms_[i] = std::min(ms_[i], expected);
    const bool dearer = i < own;
    const double frames = dearer ? forget_frames * patience_ : forget_frames;
    ms_[i] += ((dearer ? hope * expected : expected) - ms_[i]) / frames;
  }
}

}  // namespace lowlux::isp
