#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "isp/base/frame.h"
#include "isp/base/matrix3.h"
#include "isp/base/packed/raw_format.h"
#include "isp/base/result.h"
#include "isp/pipeline/plan.h"
#include "isp/raw/measure/frame_meter.h"
#include "isp/raw/measure/thumbnail.h"

namespace lowlux::isp {

/// Describes what holds for all frames of a stream.
struct LiveSetup {
  RawFormat format;
  int width = 0;  // size of whole frames
  int height = 0;
  Rect active;                 // region that becomes the image, its corner even or odd; at least 2 x 2
  std::vector<Rect> masked;    // light-shielded pixels of the frame, if any
  double white_dn = 0;         // saturation, 0.001 to 65535; 0: the format's largest code
  CameraColour colour;         // without calibrations the camera's colours count as those of the output
  std::vector<Pixel> defects;  // defects of the active area, ascending
  ToneCurve tone = ToneCurve::standard;
  SampleType samples = SampleType::u8;
  LookChoice look;                                 // look of the eye or of the camera
  bool levels = true;                              // frames may be denoised one by one, up to `most`
  denoise::Level most = denoise::Level::standard;  // highest level of frames denoised one by one
  bool temporal = false;                           // previous frames take part
  DemosaicMethod max_demosaic = DemosaicMethod::encoded_malvar;
};

/// Describes the noise reduction of one frame.
struct LiveDenoise {
  enum class Mode : std::uint8_t { off, automatic, level } mode = Mode::automatic;
  denoise::Level level = denoise::Level::draft;  // for Mode::level; no higher than LiveSetup::most
  bool temporal = true;                          // where the setup allows it
  /// States the highest level allowed, regardless of how it was chosen; none: no level at all.
  std::optional<denoise::Level> most = denoise::Level::best;
};

/// Holds temporal noise in codes: a code v DN above black has the variance gain_dn v + black_variance_dn2 of its site.
struct LiveNoise {
  double gain_dn = 0;  // the system gain [DN/e-]
  PerSite<double> black_variance_dn2{};
  /// Set where the code without dark charge is known: the dark charge of masked pixels, and with it the variance of
  /// black, then follows from their level (masked_variance_dn2).
  std::optional<PerSite<double>> pedestal_dn;
  double read_variance_dn2 = 0;  // variance of black without dark charge; only for `pedestal_dn`
};

/// Holds what is known of one frame. What is absent is measured on it or left out; so is an exposure time or ISO speed
/// that is not positive and finite.
struct LiveFacts {
  std::optional<PerSite<double>> black_dn;  // levels of the active area's sites, mean dark charge included
  std::optional<LiveNoise> noise;
  std::optional<double> exposure_s;
  std::optional<double> iso;
  std::optional<double> f_number;
  std::optional<double> scene_luminance_cd_m2;  // mean
  std::optional<Vector3> neutral;               // camera RGB of white; any scale
  std::optional<Matrix3> colour_matrix;         // white-balanced camera RGB to linear sRGB, in place of calibrations
  std::optional<double> exposure_ev;            // absent: automatic
  double saturation = 1;                        // saturation of the image's colours, 0..4
  DemosaicMethod max_demosaic = DemosaicMethod::residual_median;  // most expensive method that fits into the time
  bool follows = true;  // the previous frame; false forgets previous frames and their noise
  LiveDenoise denoise;
};

/// States where a value of a frame came from.
enum class LiveSource : std::uint8_t { none, given, masked_pixels, frame };

/// Holds what was decided beyond the plan.
struct LiveDecision {
  LiveSource black = LiveSource::none;
  LiveSource noise = LiveSource::none;
  LiveSource white = LiveSource::none;
  std::optional<NoiseLine> measured;    // the noise that the frame itself shows, where it was measured
  std::optional<denoise::Level> level;  // the level before LiveDenoise::most, which may lower it
  bool reducible = false;               // the frame is a mosaic whose noise is known
};

/// Decides about one frame after the other, and owns the plan of the last one. Allocates only to report an error after
/// the first frame.
class LivePlanner {
 public:
  explicit LivePlanner(const LiveSetup& setup);

  /// Decides about a frame.
  /// @param frame  gets the noise, colour and exposure that the facts state
  /// Errors: black not below white, colours that lead to no image (malformed), a look whose luminance is not known
  /// (insufficient).
  Result<void> plan(const LiveFacts& facts, FrameMeter& meter, RawFrame& frame);
  /// Returns what has to be measured of the next frame, if these are its facts.
  MeterWants wants(const LiveFacts& facts, bool statistics) const;
  const DevelopPlan& decided() const { return plan_; }
  const LiveDecision& decision() const { return decision_; }
  /// Sets whether the next plans use every effect of the look, so that all of its steps allocate their memory.
  void use_all_effects(bool all) { all_effects_ = all; }
  void reset();

 private:
  Result<void> set_black(const LiveFacts& facts, FrameMeter& meter, const RawFrame& frame);
  bool needs_light(const LiveFacts& facts) const;
  void set_noise(const LiveFacts& facts, const FrameMeter& meter, RawFrame& frame);
  WhiteBalance choose_white(const LiveFacts& facts, RawFrame& frame);
  Result<Matrix3> balanced_matrix(const LiveFacts& facts, const RawFrame& frame, const WhiteBalance& balance) const;
  Result<void> set_rendering(const LiveFacts& facts, RawFrame& frame);
  double smooth_exposure(double target_ev);
  void choose_level(const LiveDenoise& wanted, const RawFrame& frame);
  void set_temporal(const LiveFacts& facts, const RawFrame& frame);

  const LiveSetup& setup_;
  DevelopPlan plan_;
  bool all_effects_ = false;
  LiveDecision decision_;
  Thumbnail thumbnail_;
  std::vector<float> blocks_, memory_;
  std::vector<double> snr_;
  std::optional<double> exposure_ev_;  // exposure of the previous frame
  std::optional<Vector3> neutral_;     // neutral of the previous frame, where it was estimated
  std::optional<NoiseLine> line_;      // noise of the previous frames, where noise is not given
  std::optional<denoise::Level> level_;
  bool has_level_ = false;           // level_ was decided for a previous frame
  std::optional<double> noise_iso_;  // ISO speed that line_ was measured at
  /// Holds values of the last frame that took part in a mean over frames.
  struct Before {
    std::optional<double> exposure_s, iso, e_per_dn;
  } last_;
  std::vector<float> largest_;
  double tone_limit_ = 0;  // limit of the plan's tone table; 0: none yet
  bool first_ = true;
};

}  // namespace lowlux::isp
