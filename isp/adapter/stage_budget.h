#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

namespace lowlux::isp {

/// Lists the noise reduction of a frame, from the most expensive on; the numbers are those of the steps in
/// lowlux_stage.h, except that a frame with all requested work is at step 0.
enum class StageWork : std::uint8_t {
  high,
  standard,
  draft,
  frames_before,  // previous frames without a level
  plain,          // straight from codes
};

/// Keeps a time limit for each frame by the times of previous frames. It uses no clock: the same times give the same
/// choices. It allocates nothing.
///
/// The time of each kind of work is a mean that moves three quarters of the way up to a frame that took longer and a
/// tenth of the way down to one that took less. The time of work that was never done is predicted in proportion to work
/// that was (README.md, "Time limit of a frame"). The estimate for work more expensive than the current work decays:
/// its time moves to half of that prediction, a hundredth of the way with each frame. So it is tried again after 25
/// frames where it takes 1.02 times the budget, after 79 at 1.25 times, 155 at 1.5 times, and never from 1.82 times on.
/// A trial that does not last 100 frames doubles these, up to eightfold.
class StageBudget {
 public:
  /// Starts without measured times.
  /// @param eye  the look of the eye is added to each work
  /// @param temporal  previous frames contribute to levels too, and may do so without one
  explicit StageBudget(bool eye = false, bool temporal = false);

  /// Returns the most expensive work, from `asked` on, that is expected to fit. Work more expensive than that of the
  /// previous choice has to leave a tenth of its time spare. Plain if no time is known yet, nothing fits, or the budget
  /// is not a number.
  /// @param asked  frames_before only if the constructor was given `temporal`
  StageWork choose(double budget_ms, StageWork asked);

  /// Adds the time of one frame. Invalid times (not a number, 0 and below, beyond 1e9 ms) are ignored.
  void took(StageWork work, double ms);

  /// Returns the predicted time of one kind of work; 0: not known yet.
  double predicted_ms(StageWork work) const { return ms_[static_cast<std::size_t>(work)]; }

 private:
  static constexpr std::size_t works = 5;
  void learn_from(StageWork before, StageWork now, StageWork asked);

  std::array<double, works> fraction_;  // relative times, at any scale
  std::array<double, works> ms_{};
  std::array<bool, works> measured_{};
  StageWork chosen_ = StageWork::plain;
  bool temporal_;
  std::optional<int> trial_frames_;  // frames since more expensive work was chosen, while it is a trial
  int patience_ = 1;                 // factor of failed trials on the time to the next trial
};

}  // namespace lowlux::isp
