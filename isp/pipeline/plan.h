#pragma once

#include <memory>
#include <optional>
#include <string_view>
#include <vector>

#include "isp/base/dark_frame.h"
#include "isp/base/executor.h"
#include "isp/base/frame.h"
#include "isp/base/image.h"
#include "isp/base/result.h"
#include "isp/base/tone_table.h"
#include "isp/model/colour/camera_colour.h"
#include "isp/pipeline/budget/cost_model.h"
#include "isp/pipeline/finished/display_target.h"
#include "isp/pipeline/noise_reduction.h"
#include "isp/pipeline/plan/look.h"
#include "isp/raw/black_point.h"
#include "isp/raw/kernel/raw_to_rgb.h"
#include "isp/raw/repair.h"
#include "isp/render/exposure.h"
#include "isp/render/tone.h"
#include "isp/render/white_balance.h"

namespace lowlux::isp {

struct WhiteBalanceChoice {
  enum class Mode : std::uint8_t { as_shot, automatic, temperature } mode = Mode::as_shot;
  double cct_k = 0;  // for Mode::temperature, white_min_k..white_max_k
};

/// How much is done of what options leave open: the search for defects, row and column noise, the level of noise
/// reduction, dark charge, the change for a display. See plan_effects.h.
struct EffectsChoice {
  bool all = false;  // everything, with Level::high
  /// CIEDE2000 that what is left out may change, as visible_noise.h measures it. With a budget it may be absent: then
  /// the most accurate plan that fits is wanted, Level::best among them.
  std::optional<double> tolerance_delta_e = 0.5;
  std::optional<double> budget_s;         // for planning and rendering the frame; needs the cost
  std::shared_ptr<const CostModel> cost;  // of this machine; absent: nothing is said of time
};

/// How a frame is to be developed.
struct DevelopOptions {
  WhiteBalanceChoice white_balance;
  std::optional<double> exposure_ev;  // absent: automatic
  ToneCurve tone = ToneCurve::standard;
  OutputSpace space = OutputSpace::srgb;
  SampleType samples = SampleType::u8;  // f32 is scene-linear: signed, unbounded, without tone
  bool half = false;                    // exact 2x2 binning in place of demosaicing
  BlackRequest black;
  bool find_defects = true;                     // hot and dead pixels beyond those the source names
  std::shared_ptr<const DarkFrame> dark_frame;  // set: taken off pixel by pixel in place of `black`
  DenoiseChoice denoise;
  LookChoice look;
  std::shared_ptr<const DisplayTarget> display;  // set: sRGB codes are changed for it
  std::optional<EffectsChoice> effects;          // absent: each option above decides for itself
};

/// Time one step took.
struct StageTime {
  std::string_view stage;
  double seconds;
};

/// One thing that may be left out of developing, or done with less work.
struct PlannedEffect {
  std::string_view name;
  double size = 0;  // CIEDE2000 that leaving it out would change; not a number where that is not known
  double left = 0;  // that the decision leaves of it, against everything that can be done
  bool used = true;
  std::string decision;           // in words
  std::optional<double> seconds;  // it is predicted to take, or would; what every plan begins with is none of them
};

/// What was decided of them together.
struct EffectsPlan {
  std::vector<PlannedEffect> effects;
  std::optional<double> predicted_s;  // of planning and rendering
  bool find_defects = true;
  bool lines = true;
  bool dark = true;
  bool display = true;
  std::optional<denoise::Level> level;
  bool level_decided = false;           // false: noise is left as options have it
  std::optional<NoiseRegions> regions;  // with levels of their own
};

/// Everything decided about one frame before a pixel is touched: what was measured, and what the kernels need.
struct DevelopPlan {
  // measured and decided
  BlackPoint black;
  std::optional<PerSite<double>> electrons_at_white;  // set where the mosaic is counted in electrons on its way
  std::vector<Pixel> defects;                         // ascending
  Vector3 neutral{1, 1, 1};                           // camera RGB of white, largest 1
  std::optional<WhitePoint> white;                    // absent without a colour calibration
  std::string_view white_balance_rule;
  double exposure_ev = 0;
  std::string_view exposure_rule;
  NoiseReduction noise_reduction;
  std::optional<LookPlan> look;  // absent: as the camera has it
  std::vector<std::string> warnings;

  // for the kernels
  DevelopOptions options;
  int width = 0;  // of the picture, before orientation
  int height = 0;
  bool from_codes = false;  // straight from 16-bit codes: nothing has to be repaired, multiplied or denoised on the way
  RgbTransform transform;
  std::array<float, 3> white_gain{1, 1, 1};
  ToneTable tone;

  std::vector<StageTime> times;
  std::optional<EffectsPlan> effects;  // where DevelopOptions::effects asked for it
};

/// Whether the options fit together: float samples go with linear spaces and no tone curve, and XYZ and camera RGB
/// with float samples. Error: invalid_argument.
Result<void> check_options(const DevelopOptions& options);

/// Measures black, noise, exposure and white of a frame, and decides how to develop it. With a dark frame, all is
/// measured on what is left when it is off. Errors: no black point (insufficient), those of black_of, no colour
/// calibration for a space other than `camera` (insufficient), white not above black, matrices that cannot be
/// (malformed), options that do not fit together or the frame (invalid_argument), those of plan_look and plan_noise.
Result<DevelopPlan> plan_develop(const RawFrame& frame, const DevelopOptions& options, Executor& executor);

}  // namespace lowlux::isp
