#include "isp/pipeline/plan.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "isp/pipeline/plan_look.h"
#include "isp/pipeline/plan_noise.h"
#include "isp/pipeline/stage_clock.h"
#include "isp/raw/corrections.h"
#include "isp/raw/subtract_dark_frame.h"
#include "isp/raw/thumbnail.h"
#include "isp/raw/to_linear.h"
#include "isp/render/output_space.h"

namespace lowlux::isp {
namespace {

constexpr double daylight_k = 6504;  // D65

Result<void> check(const RawFrame& frame, const DevelopOptions& o) {
  if (Result<void> options = check_options(o); !options) return options;
  const bool coloured = frame.raw.layout != SensorLayout::monochrome;
  if (coloured && o.space != OutputSpace::camera && frame.colour.calibrations.empty()) {
    return fail(ErrorCode::insufficient,
                "the file has no colour matrix and the decoder does not know the camera; "
                "--space camera develops it without colour conversion");
  }
  const Rect& crop = frame.raw.default_crop;
  if (o.half && (crop.width < 2 || crop.height < 2)) {
    return fail(ErrorCode::invalid_argument, "the picture is too small to halve");
  }
  return {};
}

// Defects the source names, those whose dark is unknown and, if asked for, those that stand out of what is measured.
std::vector<Pixel> all_defects(const RawFrame& frame, const RawDn& measured, DevelopPlan& plan, double black_noise_dn,
                               Executor& executor) {
  const auto named = named_defects(frame.raw, frame.corrections.defects);
  if (!named)
    plan.warnings.emplace_back("the file names a large part of its pixels as defective: these are not repaired");
  std::vector<Pixel> defects = named.value_or(std::vector<Pixel>{});
  if (plan.options.dark_frame) {
    defects = merged(defects, *named_defects(frame.raw, plan.options.dark_frame->unknown));
  }
  if (!plan.options.find_defects) return defects;
  DefectNoise noise{black_noise_dn};
  // A variance of scale * x at the fraction x of white is scale * range for each DN.
  if (frame.noise) {
    noise.shot_dn = *std::ranges::max_element(frame.noise->scale) * mean_range_dn(frame.raw, plan.black);
  }
  const std::vector<Pixel> found = find_defects(measured, plan.black, noise, executor);
  return merged(defects, found);
}

Result<WhiteBalance> choose_white(const RawFrame& frame, const DevelopOptions& o, const Thumbnail& thumbnail) {
  using Mode = WhiteBalanceChoice::Mode;
  if (frame.raw.layout == SensorLayout::monochrome) return WhiteBalance{};
  if (o.white_balance.mode == Mode::temperature)
    return white_balance_of_temperature(frame.colour, o.white_balance.cct_k);
  if (o.white_balance.mode == Mode::as_shot) {
    Result<WhiteBalance> as_shot = as_shot_white_balance(frame.colour);
    if (as_shot || as_shot.error().code != ErrorCode::insufficient) return as_shot;
  }
  const Rect& active = frame.raw.active;
  const double block_pixels = std::max(
      1.0, static_cast<double>(active.width) * active.height / (thumbnail.mean.width() * thumbnail.mean.height()) / 4);
  WhiteBalance found =
      auto_white_balance(thumbnail.mean.view(), thumbnail.black_noise_std / std::sqrt(block_pixels), frame.colour);
  if (o.white_balance.mode == Mode::as_shot && found.reason.empty())
    found.reason = "the file states no white balance: estimated from the picture";
  return found;
}

// A neutral that is no colour of a light leads to no XYZ: an automatic one gives way to daylight, others are errors.
Result<WhiteBalance> with_white(Result<WhiteBalance> balance, const RawFrame& frame, const DevelopOptions& o) {
  if (!balance || balance->white || frame.raw.layout == SensorLayout::monochrome) return balance;
  if (o.white_balance.mode == WhiteBalanceChoice::Mode::automatic) {
    if (Result<WhiteBalance> daylight = white_balance_of_temperature(frame.colour, daylight_k)) {
      daylight->reason = "the picture's white is no colour of a light under the file's matrices: taken as daylight";
      return daylight;
    }
  }
  return fail(ErrorCode::malformed,
              "the white balance is no colour of a light under the file's matrices: try --wb 5500, or --space camera");
}

// Luminance of each block as it will be rendered, before exposure.
std::vector<float> rendered_luminance(const CameraRgb& blocks, const Vector3& weights,
                                      const std::array<float, 3>& gain) {
  std::vector<float> luminance(blocks.plane[0].size());
  for (std::size_t i = 0; i < luminance.size(); ++i) {
    double y = 0;
    for (int c = 0; c < 3; ++c) y += weights[c] * std::min(blocks.plane[c].data()[i] * gain[c], 1.0f);
    luminance[i] = static_cast<float>(y);
  }
  return luminance;
}

// Luminance weights of white-balanced camera RGB.
Vector3 luminance_of_balanced(const Vector3& luminance, const Matrix3& balanced) {
  Vector3 weights{};
  for (int c = 0; c < 3; ++c) {
    for (int i = 0; i < 3; ++i) weights[c] += luminance[i] * balanced[i][c];
  }
  return weights;
}

// White-balanced camera RGB -> linear values of the space, white at (1, 1, 1).
Result<Matrix3> balanced_to_output(const RawFrame& frame, const DevelopOptions& o, const WhiteBalance& balance) {
  if (o.space == OutputSpace::camera) return identity3();
  const Matrix3 to_output = *xyz_to_output(o.space);
  if (frame.raw.layout == SensorLayout::monochrome) {
    const Xyz white = *xyz_of(output_white);
    return to_output * diagonal3(vector_of(white)) * Matrix3{{{0, 1, 0}, {0, 1, 0}, {0, 1, 0}}};
  }
  Result<Matrix3> to_xyz = camera_to_xyz(frame.colour, balance.white->xy, output_white);
  if (!to_xyz) return to_xyz;
  return to_output * *to_xyz * diagonal3(balance.neutral);
}

// Camera RGB is written as it is; everything else is white balanced, smallest gain 1, and clipped where the first
// channel saturates: what is clipped is then neutral.
void set_transform(DevelopPlan& plan, const Matrix3& balanced, const Vector3& luminance) {
  const bool camera = plan.options.space == OutputSpace::camera;
  const double limit = tone_limit(plan.options.tone, plan.exposure_ev);
  const Matrix3 scaled = (std::exp2(plan.exposure_ev) / limit) * balanced;
  RgbTransform& t = plan.transform;
  for (int i = 0; i < 9; ++i) t.matrix[i] = static_cast<float>(scaled[i / 3][i % 3]);
  for (int c = 0; c < 3; ++c) t.luminance[c] = static_cast<float>(luminance[c]);
  t.clip = camera ? INFINITY : 1.0f;
  t.move_into_gamut = plan.options.samples != SampleType::f32;
  if (plan.options.samples != SampleType::f32)
    plan.tone = make_tone_table(plan.options.tone, plan.options.space, limit);
}

void decide_exposure(DevelopPlan& plan, std::span<const float> luminance, double black_noise_std) {
  if (plan.options.exposure_ev) {
    plan.exposure_ev = *plan.options.exposure_ev;
    plan.exposure_rule = "given";
    return;
  }
  const AutoExposure automatic = auto_exposure(luminance, black_noise_std);
  plan.exposure_ev = automatic.ev;
  plan.exposure_rule = name_of(automatic.rule);
}

void set_white(DevelopPlan& plan, const WhiteBalance& balance) {
  plan.neutral = balance.neutral;
  plan.white = balance.white;
  plan.white_balance_rule = name_of(balance.source);
  if (!balance.reason.empty()) plan.warnings.push_back(balance.reason);
  for (int c = 0; c < 3; ++c) plan.white_gain[c] = static_cast<float>(1 / plan.neutral[c]);
}

/// White balance, exposure, and what the kernels need of both.
Result<void> decide_rendering(const RawFrame& frame, const Thumbnail& thumbnail, DevelopPlan& plan) {
  const DevelopOptions& options = plan.options;
  Result<WhiteBalance> balance{};
  if (options.space != OutputSpace::camera)
    balance = with_white(choose_white(frame, options, thumbnail), frame, options);
  if (!balance) return tl::make_unexpected(std::move(balance.error()));
  set_white(plan, *balance);

  const Result<Matrix3> balanced = balanced_to_output(frame, options, *balance);
  if (!balanced) return tl::make_unexpected(balanced.error());
  const Vector3 luminance = luminance_weights(options.space).value_or(Vector3{0, 1, 0});
  const std::vector<float> blocks =
      rendered_luminance(thumbnail.mean, luminance_of_balanced(luminance, *balanced), plan.white_gain);
  const double gain = *std::max_element(plan.white_gain.begin(), plan.white_gain.end());
  decide_exposure(plan, blocks, thumbnail.black_noise_std * gain);
  if (auto look = plan_look(frame, {blocks, thumbnail.black_noise_std * gain}, plan); !look) return look;
  set_transform(plan, *balanced, luminance);
  return plan_model(plan);
}

// Nothing has to be repaired, multiplied, denoised, or taken off pixel by pixel.
bool goes_from_codes(const RawFrame& frame, const DevelopPlan& plan) {
  return frame.raw.layout == SensorLayout::bayer && plan.defects.empty() && !plan.noise_reduction.level &&
         !plan.black.pattern && !plan.options.dark_frame && plan.black.dark_mean_e == PerSite<double>{} &&
         frame.corrections.radial_gains.empty() &&
         std::none_of(frame.corrections.gain_maps.begin(), frame.corrections.gain_maps.end(), has_effect);
}

void set_size(DevelopPlan& plan, const Rect& crop) {
  plan.width = plan.options.half ? crop.width / 2 : crop.width;
  plan.height = plan.options.half ? crop.height / 2 : crop.height;
}

}  // namespace

Result<void> check_options(const DevelopOptions& o) {
  const bool needs_float = o.space == OutputSpace::camera || o.space == OutputSpace::xyz;
  if (needs_float && o.samples != SampleType::f32) {
    return fail(
        ErrorCode::invalid_argument,
        "camera RGB and XYZ are signed and reach above 1: they need float samples, TIFF with --bits 32 or OpenEXR");
  }
  if (o.samples == SampleType::f32 && (!is_linear(o.space) || o.tone != ToneCurve::none)) {
    return fail(ErrorCode::invalid_argument,
                "float samples are scene-linear: they go with a linear space and --tone none");
  }
  if (o.display && (o.space != OutputSpace::srgb || o.samples == SampleType::f32)) {
    return fail(ErrorCode::invalid_argument, "pictures for another display are sRGB of 8 or 16 bits");
  }
  return {};
}

Result<DevelopPlan> plan_develop(const RawFrame& frame, const DevelopOptions& options, Executor& executor) {
  if (const Result<void> checked = check(frame, options); !checked) return tl::make_unexpected(checked.error());
  DevelopPlan plan;
  plan.options = options;
  plan.warnings = frame.warnings;
  set_size(plan, frame.raw.default_crop);
  StageClock clock(plan.times);

  const DarkFrame* dark = options.dark_frame.get();
  Result<BlackPoint> black = dark != nullptr ? black_of(frame.raw, *dark) : choose_black(frame.raw, options.black);
  if (!black) return tl::make_unexpected(std::move(black.error()));
  plan.black = std::move(*black);
  if (frame.noise) plan.electrons_at_white = electrons_at_white(frame.raw, *frame.noise);
  clock.lap("black point");

  std::optional<RawFrame> without_dark;
  if (dark != nullptr) {
    plan.warnings.insert(plan.warnings.end(), dark->warnings.begin(), dark->warnings.end());
    without_dark = measurable_without_dark(frame, *dark, plan.black, executor);
    clock.lap("dark frame");
  }
  const RawFrame& measured = without_dark ? *without_dark : frame;
  const Thumbnail thumbnail = make_thumbnail(measured, plan.black, executor);
  clock.lap("thumbnail");
  plan.defects = all_defects(frame, measured.raw, plan,
                             thumbnail.black_noise_std * mean_range_dn(frame.raw, plan.black), executor);
  clock.lap("defects");

  if (const Result<void> decided = decide_rendering(frame, thumbnail, plan); !decided) {
    return tl::make_unexpected(decided.error());
  }
  clock.lap("white and exposure");

  Result<NoiseReduction> noise = plan_noise(frame, thumbnail, plan, executor);
  if (!noise) return tl::make_unexpected(std::move(noise.error()));
  plan.noise_reduction = *std::move(noise);
  if (plan.look && plan.look->noise_limit && !plan.look->noise && !plan.noise_reduction.level) {
    plan.warnings.emplace_back("the noise of the frame is not known, so it is not held to a limit");
  }
  plan.from_codes = goes_from_codes(frame, plan);
  if (plan.from_codes || frame.raw.layout != SensorLayout::bayer) plan.electrons_at_white.reset();
  clock.lap("noise model");
  return plan;
}

}  // namespace lowlux::isp
