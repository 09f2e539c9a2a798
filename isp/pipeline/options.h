#pragma once

#include <cstdint>
#include <memory>
#include <optional>

#include "isp/base/dark_frame.h"
#include "isp/base/frame.h"
#include "isp/base/image.h"
#include "isp/base/result.h"
#include "isp/pipeline/budget/cost_model.h"
#include "isp/pipeline/finished/display_target.h"
#include "isp/pipeline/noise_reduction.h"
#include "isp/pipeline/plan/look.h"
#include "isp/raw/black_point.h"
#include "isp/render/output_space.h"
#include "isp/render/tone.h"

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

/// Width and height of the developed picture, before orientation.
struct PictureSize {
  int width = 0;
  int height = 0;
};
PictureSize picture_size(const RawDn& raw, const DevelopOptions& options);

/// Whether the options fit together: float samples go with linear spaces and no tone curve, and XYZ and camera RGB
/// with float samples. Error: invalid_argument.
Result<void> check_options(const DevelopOptions& options);

}  // namespace lowlux::isp
