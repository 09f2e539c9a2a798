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

}  // namespace lowlux::isp
