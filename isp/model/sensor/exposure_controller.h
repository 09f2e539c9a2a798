#pragma once

#include <array>
#include <optional>
#include <vector>

#include "isp/model/sensor/exposure_choice.h"

namespace lowlux::isp {

/// Holds the codes of one frame that decide on the exposure of the next ones, above black.
struct MeteredCodes {
  double midtone_dn = 0;  // median of the channel with most signal
  /// Code that ExposureLimits::clipped_fraction of the pixels of the fullest channel exceed, noise included.
  double highlight_dn = 0;
  double range_dn = 0;          // white less black
  double clipped_fraction = 0;  // fraction of the pixels with codes of white or above, in the channel with most
};

/// States how a frame was exposed.
struct StatedExposure {
  double exposure_s = 0;
  double gain_factor = 1;
};

/// Sets exposure time and gain of a stream by choose_exposure(), from the frames themselves. The light is the mean of
/// the last 12 frames, or fewer since the last setting. A frame whose highlight clips, or differs by more than a
/// fourth, is a change of light and is followed at once; otherwise a setting is left after four frames at the earliest,
/// and only where it loses 1 % of the power of the signal-to-noise ratio, after 12 frames 3 %, so that noise moves
/// nothing.
///
/// Exposures shorter than half a period of the mains show flicker. They are left after 12 frames at the earliest, and
/// where those differ by more than 4 % their largest highlight counts. Light flickers where the highlight of 12 frames
/// both rises and falls by more than 8 % of its mean, which slow changes do not, and may flicker after it clipped. Its
/// peak is then held, with 5 % more room, until 12 frames differ by at most 4 % or stay below 0.8 of it; a darker frame
/// is a trough, and a setting is left only where it loses 20 % of the power, a flicker-free one for a short one 50 %.
/// Frames between a setting and its effect are left out. Allocates nothing after construction.
class ExposureController {
 public:
  struct Setup {
    std::vector<GainStep> gains;  // at least one, by rising factor
    ExposureLimits limits;
    ExposureSetting at;      // setting of the camera
    int latency_frames = 8;  // frames after which a setting is in effect at the latest
  };
  explicit ExposureController(Setup setup);

  /// Takes one frame. Returns the setting to be made, if the camera should have another one.
  /// @param stated  setting of this frame if the camera states it, which shortens the wait for a change
  std::optional<ExposureSetting> take(const MeteredCodes& codes, const std::optional<StatedExposure>& stated);

  /// Takes what the camera made of the time that was asked for: where it is another one, that is a limit from now on.
  void was_set(double exposure_s);

  /// Replaces the limits; the next frame decides by the new ones.
  void set_limits(const ExposureLimits& limits) { limits_ = limits; }

  /// Forgets the light, for a camera that has the setting `at`: the next frame decides at once.
  void reset(const ExposureSetting& at);

  /// Whether the last frame left the setting as it is.
  bool settled() const { return settled_; }
  /// Whether frames to come may still have another setting.
  bool awaits() const { return await_frames_ > 0; }
  const ExposureSetting& setting() const { return setting_; }
  const ExposureChoice& choice() const { return choice_; }  // the last one
  /// Returns the index of the gain nearest to a factor.
  std::size_t gain_near(double factor) const;
  const std::vector<GainStep>& gains() const { return gains_; }
  int changes() const { return changes_; }  // settings made

 private:
  struct Metered {
    MeteredLight light;
    bool clips = false;
    double highlight_e = 0;    // in the frame, with noise
    double white_e_per_s = 0;  // rate that fills the range
    double exposure_s = 0;
  };
  bool is_awaited(const std::optional<StatedExposure>& stated);
  Metered metered(const MeteredCodes& codes, const StatedExposure& exposed) const;
  bool is_short(double exposure_s) const;
  void follow_flicker(Metered& frame, bool other);
  bool is_changed_light(const Metered& frame, const GainStep& gain) const;
  MeteredLight light_of_frames(bool may_flicker);
  bool may_keep_setting() const;
  ExposureChoice choice_of(double brightness) const;

  std::vector<GainStep> gains_;
  ExposureLimits limits_;
  ExposureSetting setting_;
  int latency_frames_;
  int await_frames_ = 0;
  std::array<MeteredLight, 12> frames_{};  // the last ones, in turn
  int count_ = 0;                          // frames since the last setting, or since the light changed
  std::optional<MeteredLight> light_;      // by which the last decision was made
  std::optional<double> peak_e_per_s_;     // largest highlight of a light that flickers, or may as it clipped
  bool is_flicker_seen_ = false;           // by a short exposure of this light
  bool settled_ = false;
  ExposureChoice choice_;
  int changes_ = 0;
};

}  // namespace lowlux::isp
