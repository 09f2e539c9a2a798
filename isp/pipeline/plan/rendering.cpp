#include "isp/pipeline/plan/rendering.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <string>
#include <utility>
#include <vector>

#include "isp/model/sensor/scene_luminance.h"
#include "isp/pipeline/plan/plan_look.h"
#include "isp/render/output_space.h"

namespace lowlux::isp {
namespace {

constexpr double daylight_k = 6504;  // D65
constexpr double mid_grey = 0.18;    // what automatic exposure brings the image to: a curve may show it brighter

Vector3 luminance_of(OutputSpace space) { return luminance_weights(space).value_or(Vector3{0, 1, 0}); }

/// Returns the balance of a choice that does not depend on the image as a whole; nullopt for others.
std::optional<Result<WhiteBalance>> requested_white(const CameraColour& colour, const WhiteBalanceChoice& choice,
                                                    const Vector3& picked) {
  using Mode = WhiteBalanceChoice::Mode;
  const Vector3& gains = choice.gains;
  switch (choice.mode) {
    case Mode::temperature:
      return white_balance_of_temperature(colour, choice.cct_k, choice.tint);
    case Mode::preset:
      return white_balance_of_preset(colour, choice.preset);
    case Mode::gains:
      return white_balance_of_neutral(colour, {1 / gains[0], 1 / gains[1], 1 / gains[2]}, WhiteSource::gains);
    case Mode::picked:
      return white_balance_of_neutral(colour, picked, WhiteSource::picked);
    case Mode::as_shot:
    case Mode::automatic:
      break;
  }
  return std::nullopt;
}

Result<WhiteBalance> choose_white(const RawFrame& frame, const DevelopOptions& o, const Thumbnail& thumbnail,
                                  const Vector3& picked) {
  using Mode = WhiteBalanceChoice::Mode;
  if (frame.raw.layout == SensorLayout::monochrome) return WhiteBalance{};
  if (auto requested = requested_white(frame.colour, o.white_balance, picked)) return *std::move(requested);
  if (o.white_balance.mode == Mode::as_shot) {
    Result<WhiteBalance> as_shot = as_shot_white_balance(frame.colour);
    if (as_shot || as_shot.error().code != ErrorCode::insufficient) return as_shot;
  }
  WhiteBalance found = auto_white_balance(thumbnail.mean.view(), block_noise_std(frame.raw, thumbnail), frame.colour);
  if (o.white_balance.mode == Mode::as_shot && found.reason.empty())
    found.reason = "the file states no white balance: estimated from the image";
  return found;
}

/// Returns whether the tone curve of the profile replaces the standard one.
bool has_profile_curve(const DevelopOptions& options, const std::optional<WhitePoint>& white) {
  return options.profile_tables && options.profile_tables->curve && options.tone == ToneCurve::standard && white &&
         options.look.look == Look::camera && !is_linear(options.space);
}

/// Returns the tables of the profile, placed before and after exposure; nullopt where they are not applied.
/// @param colours  applied after the tables
std::optional<ProfileRendering> decide_profile(const RawFrame& frame, const DevelopOptions& options,
                                               const Rendering& rendering, const Matrix3& colours, bool has_curve) {
  const bool has_look = rendering.look && rendering.look->kind != Look::camera;
  if (!options.profile_tables || !rendering.white || has_look || is_linear(options.space)) return std::nullopt;
  const Matrix3 to_prophoto = xyz_to_prophoto() * *inverse(*xyz_to_output(options.space));
  return ProfileRendering{.map = map_at(*options.profile_tables, calibration_weight(frame.colour, rendering.white->xy)),
                          .look = options.profile_tables->look,
                          .curve = has_curve ? options.profile_tables->curve : std::nullopt,
                          .to_prophoto = to_prophoto,
                          .from_prophoto = colours * *inverse(to_prophoto),
                          .map_scale = std::exp2(rendering.exposure_ev) / rendering.limit,
                          .limit = rendering.limit};
}

/// Returns where the white balance of a frame of unknown colours is from, in words.
std::string origin_of(WhiteSource source) {
  switch (source) {
    case WhiteSource::as_shot:
      return "as shot";
    case WhiteSource::estimated:
      return "estimated from the image";
    case WhiteSource::gains:
      return "of the given gains";
    case WhiteSource::picked:
      return "of the picked pixel";
    default:
      return "not changed";
  }
}

/// Returns the white balance of a frame of unknown colours, with what that means as its reason.
Result<WhiteBalance> without_white(Result<WhiteBalance> balance) {
  if (!balance) return balance;
  balance->reason =
      "the colours of the camera are unknown (no colour matrix): shown as if they were those of sRGB, white balance " +
      origin_of(balance->source) + ". --profile states them";
  return balance;
}

// A neutral that is not a valid colour of a light has no XYZ: an automatic one is replaced by daylight, others are
// errors.
Result<WhiteBalance> with_white(Result<WhiteBalance> balance, const RawFrame& frame, const DevelopOptions& o) {
  if (has_unknown_colours(frame, o.space)) return without_white(std::move(balance));
  if (!balance || balance->white || frame.raw.layout == SensorLayout::monochrome) return balance;
  if (o.white_balance.mode == WhiteBalanceChoice::Mode::automatic) {
    if (Result<WhiteBalance> daylight = white_balance_of_temperature(frame.colour, daylight_k)) {
      daylight->reason =
          "automatic white balance found no plausible colour of a light and uses daylight; --wb overrides it";
      return daylight;
    }
  }
  return fail(ErrorCode::malformed,
              "the white balance of the file is not a colour that a light can have: try --wb 5500, or --space camera");
}

void decide_exposure(const AutoExposureOptions& automatically, const DevelopOptions& options,
                     std::span<const float> luminance, std::span<const float> largest, double black_noise_std,
                     Rendering& out) {
  if (options.exposure_ev) {
    out.exposure_ev = *options.exposure_ev;
    out.exposure_rule = "given";
    return;
  }
  const AutoExposure automatic = auto_exposure(luminance, largest, black_noise_std, automatically);
  out.exposure_ev = automatic.ev + options.exposure_offset_ev;
  out.exposure_rule = name_of(automatic.rule);
}

/// Returns the matrix of --saturation for linear colours of the output space.
Matrix3 colours_of(const DevelopOptions& options) {
  return options.saturation == 1 ? identity3() : saturation_matrix(options.saturation, luminance_of(options.space));
}

/// Returns by how much the range above the first saturated channel is extended, for what is reconstructed: to where the
/// last channel saturates.
double headroom_ev(const std::array<float, 3>& white_gain, const DevelopOptions& options) {
  if (options.highlights == Highlights::clip) return 0;
  return std::log2(static_cast<double>(*std::ranges::max_element(white_gain)));
}

/// Balances camera RGB by the white of the shot for as long as missing colours are interpolated, which relies on greys
/// of equal values: the matrix takes the gains back.
void balance_interpolation(const RawFrame& frame, Rendering& out) {
  const std::optional<Vector3>& neutral = frame.colour.as_shot_neutral;
  if (frame.raw.layout != SensorLayout::bayer || !neutral) return;
  for (const double share : *neutral) {
    if (!(share > 1e-3 && share < 1e3)) return;
  }
  out.white_gain = white_gain_of(*neutral);
  for (int i = 0; i < 9; ++i) out.transform.matrix[i] /= out.white_gain[i % 3];
}

}  // namespace

bool has_unknown_colours(const RawFrame& frame, OutputSpace space) {
  return frame.raw.layout != SensorLayout::monochrome && space != OutputSpace::camera &&
         frame.colour.calibrations.empty();
}

std::array<float, 3> white_gain_of(const Vector3& neutral) {
  std::array<float, 3> out{};
  for (int c = 0; c < 3; ++c) out[c] = static_cast<float>(1 / neutral[c]);
  return out;
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
  if (has_unknown_colours(frame, o.space)) return to_output * *inverse(*xyz_to_output(OutputSpace::srgb));
  Result<Matrix3> to_xyz = camera_to_xyz(frame.colour, balance.white->xy, output_white);
  if (!to_xyz) return to_xyz;
  return to_output * *to_xyz * diagonal3(balance.neutral);
}

void rendered_luminance(const CameraRgb& blocks, OutputSpace space, const std::array<float, 3>& white_gain,
                        const Matrix3& balanced, std::span<float> out) {
  const Vector3 luminance = luminance_of(space);
  Vector3 weights{};  // weights of white-balanced camera RGB
  for (int c = 0; c < 3; ++c) {
    for (int i = 0; i < 3; ++i) weights[c] += luminance[i] * balanced[i][c];
  }
  for (std::size_t i = 0; i < out.size(); ++i) {
    double y = 0;
    for (int c = 0; c < 3; ++c) y += weights[c] * std::min(blocks.plane[c].data()[i] * white_gain[c], 1.0f);
    out[i] = static_cast<float>(y);
  }
}

void rendered_largest(const CameraRgb& blocks, const std::array<float, 3>& white_gain, const Matrix3& balanced,
                      std::span<float> out) {
  for (std::size_t i = 0; i < out.size(); ++i) {
    Vector3 camera{};
    for (int c = 0; c < 3; ++c) camera[c] = std::min(blocks.plane[c].data()[i] * white_gain[c], 1.0f);
    const Vector3 rgb = balanced * camera;
    out[i] = static_cast<float>(*std::ranges::max_element(rgb));
  }
}

AutoExposureOptions exposure_options(const FrameInfo& info, const Thumbnail& light, const DevelopOptions& options) {
  AutoExposureOptions out;
  if (options.look.look == Look::camera) out.white_cd_m2 = saturation_luminance_cd_m2(info);
  if (out.white_cd_m2) *out.white_cd_m2 *= light.light_range;
  return out;
}

RgbTransform transform_of(const Matrix3& balanced, const Rendering& rendering, const DevelopOptions& options) {
  const Matrix3 scaled = (std::exp2(rendering.exposure_ev) / rendering.limit) * balanced;
  const Vector3 luminance = luminance_of(options.space);
  RgbTransform out;
  for (int i = 0; i < 9; ++i) out.matrix[i] = static_cast<float>(scaled[i / 3][i % 3]);
  for (int c = 0; c < 3; ++c) out.luminance[c] = static_cast<float>(luminance[c]);
  const bool keeps_all = options.space == OutputSpace::camera || options.highlights == Highlights::reconstruct;
  out.clip = keeps_all ? INFINITY : 1.0f;
  out.move_into_gamut = options.samples != SampleType::f32;
  return out;
}

float clip_of(const Rendering& rendering, const std::array<double, 3>& saturation) {
  float out = rendering.transform.clip;
  if (!std::isfinite(out)) return out;
  for (std::size_t c = 0; c < 3; ++c) out = std::min(out, rendering.white_gain[c] * static_cast<float>(saturation[c]));
  return out;
}

ToneTable tone_of(double limit, const DevelopOptions& options) {
  if (options.samples == SampleType::f32) return {};
  return make_tone_table(options.tone, options.space, limit, options.tone_shape);
}

Result<Rendering> decide_rendering(const RawFrame& frame, const Thumbnail& light, const DevelopOptions& requested,
                                   const Vector3& picked) {
  DevelopOptions options = requested;
  Result<WhiteBalance> balance{};
  if (options.space != OutputSpace::camera) {
    balance = with_white(choose_white(frame, options, light, picked), frame, options);
  }
  if (!balance) return tl::make_unexpected(std::move(balance.error()));
  Rendering out{.neutral = balance->neutral,
                .white = balance->white,
                .white_balance_rule = name_of(balance->source),
                .white_gain = white_gain_of(balance->neutral)};
  if (!balance->reason.empty()) out.warnings.push_back(balance->reason);

  const Result<Matrix3> balanced = balanced_to_output(frame, options, *balance);
  if (!balanced) return tl::make_unexpected(balanced.error());
  std::vector<float> blocks(light.mean.plane[0].size()), largest(blocks.size());
  rendered_luminance(light.mean, options.space, out.white_gain, *balanced, blocks);
  rendered_largest(light.mean, out.white_gain, *balanced, largest);
  const double noise_std = light.black_noise_std * *std::ranges::max_element(out.white_gain);
  decide_exposure(exposure_options(frame.raw.info, light, options), options, blocks, largest, noise_std, out);
  const bool has_curve = has_profile_curve(options, out.white);
  if (has_curve) {
    options.tone = ToneCurve::none;
    if (!options.exposure_ev) out.exposure_ev += std::log2(options.profile_tables->curve->mid_grey / mid_grey);
  }
  const double headroom = headroom_ev(out.white_gain, options);
  Result<std::optional<LookPlan>> look = plan_look(
      frame, {blocks, noise_std, out.white, out.exposure_ev, *balanced, headroom, light.light_range}, options);
  if (!look) return tl::make_unexpected(std::move(look.error()));
  out.look = *std::move(look);
  if (out.look) out.exposure_ev += out.look->dimming_ev;
  out.limit = tone_limit(options.tone, out.exposure_ev + headroom);
  const Matrix3 colours = colours_of(options);
  out.profile = decide_profile(frame, options, out, colours, has_curve);
  const Matrix3 adapted = out.look ? out.look->adaptation * *balanced : *balanced;
  out.transform = transform_of(out.profile ? adapted : colours * adapted, out, options);
  if (options.space == OutputSpace::camera) balance_interpolation(frame, out);
  out.tone = tone_of(out.limit, options);
  if (!out.look || out.look->kind != Look::model) return out;
  Result<ModelTable> model =
      tabulate_model(*out.look, {out.white, out.white_gain, out.transform, out.exposure_ev}, options);
  if (!model) return tl::make_unexpected(std::move(model.error()));
  out.look->table = std::move(model->table);
  std::ranges::move(model->warnings, std::back_inserter(out.warnings));
  return out;
}

}  // namespace lowlux::isp
