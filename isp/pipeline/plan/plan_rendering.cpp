#include "isp/pipeline/plan/plan_rendering.h"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "isp/pipeline/plan/plan_look.h"
#include "isp/render/output_space.h"

namespace lowlux::isp {
namespace {

constexpr double daylight_k = 6504;  // D65

Vector3 luminance_of(OutputSpace space) { return luminance_weights(space).value_or(Vector3{0, 1, 0}); }

Result<WhiteBalance> choose_white(const RawFrame& frame, const DevelopOptions& o, const Thumbnail& thumbnail) {
  using Mode = WhiteBalanceChoice::Mode;
  if (frame.raw.layout == SensorLayout::monochrome) return WhiteBalance{};
  if (o.white_balance.mode == Mode::temperature)
    return white_balance_of_temperature(frame.colour, o.white_balance.cct_k);
  if (o.white_balance.mode == Mode::as_shot) {
    Result<WhiteBalance> as_shot = as_shot_white_balance(frame.colour);
    if (as_shot || as_shot.error().code != ErrorCode::insufficient) return as_shot;
  }
  WhiteBalance found = auto_white_balance(thumbnail.mean.view(), block_noise_std(frame.raw, thumbnail), frame.colour);
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

}  // namespace

void set_white(DevelopPlan& plan, const WhiteBalance& balance) {
  plan.neutral = balance.neutral;
  plan.white = balance.white;
  plan.white_balance_rule = name_of(balance.source);
  if (!balance.reason.empty()) plan.warnings.push_back(balance.reason);
  for (int c = 0; c < 3; ++c) plan.white_gain[c] = static_cast<float>(1 / plan.neutral[c]);
}

double block_noise_std(const RawDn& raw, const Thumbnail& thumbnail) {
  const Rect& active = raw.active;
  const double block_pixels = std::max(
      1.0, static_cast<double>(active.width) * active.height / (thumbnail.mean.width() * thumbnail.mean.height()) / 4);
  return thumbnail.black_noise_std / std::sqrt(block_pixels);
}

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

void rendered_luminance(const CameraRgb& blocks, const DevelopPlan& plan, const Matrix3& balanced,
                        std::span<float> out) {
  const Vector3 luminance = luminance_of(plan.options.space);
  Vector3 weights{};  // of white-balanced camera RGB
  for (int c = 0; c < 3; ++c) {
    for (int i = 0; i < 3; ++i) weights[c] += luminance[i] * balanced[i][c];
  }
  for (std::size_t i = 0; i < out.size(); ++i) {
    double y = 0;
    for (int c = 0; c < 3; ++c) y += weights[c] * std::min(blocks.plane[c].data()[i] * plan.white_gain[c], 1.0f);
    out[i] = static_cast<float>(y);
  }
}

void set_transform(DevelopPlan& plan, const Matrix3& balanced) {
  const bool camera = plan.options.space == OutputSpace::camera;
  const double limit = tone_limit(plan.options.tone, plan.exposure_ev);
  const Matrix3 scaled = (std::exp2(plan.exposure_ev) / limit) * balanced;
  const Vector3 luminance = luminance_of(plan.options.space);
  RgbTransform& t = plan.transform;
  for (int i = 0; i < 9; ++i) t.matrix[i] = static_cast<float>(scaled[i / 3][i % 3]);
  for (int c = 0; c < 3; ++c) t.luminance[c] = static_cast<float>(luminance[c]);
  t.clip = camera ? INFINITY : 1.0f;
  t.move_into_gamut = plan.options.samples != SampleType::f32;
}

void set_tone(DevelopPlan& plan) {
  if (plan.options.samples == SampleType::f32) return;
  plan.tone = make_tone_table(plan.options.tone, plan.options.space, tone_limit(plan.options.tone, plan.exposure_ev));
}

Result<void> decide_rendering(const RawFrame& frame, const Thumbnail& thumbnail, DevelopPlan& plan) {
  const DevelopOptions& options = plan.options;
  Result<WhiteBalance> balance{};
  if (options.space != OutputSpace::camera)
    balance = with_white(choose_white(frame, options, thumbnail), frame, options);
  if (!balance) return tl::make_unexpected(std::move(balance.error()));
  set_white(plan, *balance);

  const Result<Matrix3> balanced = balanced_to_output(frame, options, *balance);
  if (!balanced) return tl::make_unexpected(balanced.error());
  std::vector<float> blocks(thumbnail.mean.plane[0].size());
  rendered_luminance(thumbnail.mean, plan, *balanced, blocks);
  const double gain = *std::max_element(plan.white_gain.begin(), plan.white_gain.end());
  decide_exposure(plan, blocks, thumbnail.black_noise_std * gain);
  if (auto look = plan_look(frame, {blocks, thumbnail.black_noise_std * gain}, plan); !look) return look;
  set_transform(plan, *balanced);
  set_tone(plan);
  return plan_model(plan);
}

}  // namespace lowlux::isp
