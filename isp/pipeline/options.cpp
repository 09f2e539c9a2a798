#include "isp/pipeline/options.h"

namespace lowlux::isp {

PictureSize picture_size(const RawDn& raw, const DevelopOptions& options) {
  const int step = options.half ? 2 : 1;
  return {raw.default_crop.width / step, raw.default_crop.height / step};
}

Result<void> check_options(const DevelopOptions& o) {
  const bool needs_float = o.space == OutputSpace::camera || o.space == OutputSpace::xyz;
  if (needs_float && o.samples != SampleType::f32) {
    return fail(
        ErrorCode::invalid_argument,
        "camera RGB and XYZ may be negative or above 1 and require float samples: PFM, OpenEXR or TIFF with --bits 32");
  }
  if (o.samples == SampleType::f32 && (!is_linear(o.space) || o.tone != ToneCurve::none)) {
    return fail(ErrorCode::invalid_argument,
                "float samples are scene-linear: they require a linear space and --tone none");
  }
  if (o.tone_shape != ToneShape{} && (o.tone == ToneCurve::none || o.look.noise_limit)) {
    return fail(ErrorCode::invalid_argument,
                "--brightness and --contrast change the standard tone curve: they cannot be combined with --tone none, "
                "linear spaces or --noise-limit");
  }
  const bool has_look = o.look.look != Look::camera;
  if (o.saturation != 1 && (needs_float || has_look)) {
    return fail(ErrorCode::invalid_argument,
                "--saturation cannot be combined with --space camera or xyz, or with --look");
  }
  if (o.local_tone > 0 && (o.tone == ToneCurve::none || has_look)) {
    return fail(ErrorCode::invalid_argument,
                "--local-tone requires the standard tone curve: it cannot be combined with --tone none, linear spaces "
                "or --look");
  }
  if (o.display && (o.space != OutputSpace::srgb || o.samples == SampleType::f32)) {
    return fail(ErrorCode::invalid_argument, "images for another display must be sRGB of 8 or 16 bits");
  }
  return {};
}

}  // namespace lowlux::isp
