#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

namespace lowlux::isp {

/// What noise reduction a frame gets, from the dearest on; by their numbers the steps of lowlux_stage.h, but that a
/// frame which gets what was asked for is at step 0.
enum class StageWork : std::uint8_t {
  high,
  standard,
  draft,
  frames_before,  // without a level
  plain,          // straight from codes
};

/// Keeps to a time for each frame by what frames before it took. Knows no clock: the same times give the same choices.
/// Allocates nothing.
///
/// The time of each kind of work is a mean that goes three quarters of the way up to a frame that took longer and a
/// tenth of the way down to one that took less. Work that was never done is taken for its share of the work that was
/// (README.md, "A time for each frame"). What is dearer than what runs is believed in ever less: its time goes to half
/// of that share, a hundredth of the way with each frame. So it is tried again after 25 frames where it takes 1.02
/// times the budget, after 79 at 1.25 times, 155 at 1.5 times, and never from 1.82 times on. A trial that does not last
/// 100 frames doubles these, up to eightfold.
class StageBudget {
 public:
  /// @param eye  the look of the eye is added to each work
  /// @param temporal  frames before take part in levels too, and may do so without one
  explicit StageBudget(bool eye = false, bool temporal = false);

  /// The dearest work, from `asked` on, that is expected to fit. Work dearer than that of the choice before has to
  /// leave a tenth of itself spare. Plain where nothing is known yet or nothing fits, not a number among budgets.
  /// @param asked  frames_before only where the constructor was told of them
  StageWork choose(double budget_ms, StageWork asked);

  /// One frame. Times that are none (not a number, 0 and below, beyond 1e9 ms) are left out.
  void took(StageWork work, double ms);

  /// 0: not known yet.
  double predicted_ms(StageWork work) const { return ms_[static_cast<std::size_t>(work)]; }

 private:
  static constexpr std::size_t works = 5;
  void learn_from(StageWork before, StageWork now, StageWork asked);

  std::array<double, works> share_;  // of time, at any scale
  std::array<double, works> ms_{};
  std::array<bool, works> measured_{};
  StageWork chosen_ = StageWork::plain;
  bool temporal_;
  std::optional<int> trial_frames_;  // since dearer work was chosen, while it is a trial
  int patience_ = 1;                 // what trials that failed made of the time to the next
};

}  // namespace lowlux::isp
