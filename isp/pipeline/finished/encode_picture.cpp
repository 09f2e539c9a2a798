#include "isp/pipeline/finished/encode_picture.h"

#include <cmath>
#include <type_traits>
#include <variant>

#include "isp/pipeline/render/pipeline.h"
#include "isp/raw/kernel/raw_to_rgb.h"
#include "isp/render/output_space.h"
#include "isp/render/tone.h"

namespace lowlux::isp {

Picture encode_picture(const SceneLinear& xyz, OutputSpace space, SampleType samples, Executor& executor) {
  DevelopPlan size;
  size.options.samples = samples;
  size.width = xyz.width();
  size.height = xyz.height();
  Picture out = make_picture(size);
  RgbTransform transform;
  const Matrix3 matrix = *xyz_to_output(space);
  const Vector3 weights = *luminance_weights(space);
  for (int i = 0; i < 9; ++i) transform.matrix[i] = static_cast<float>(matrix[i / 3][i % 3]);
  for (int c = 0; c < 3; ++c) transform.luminance[c] = static_cast<float>(weights[c]);
  transform.clip = INFINITY;
  transform.move_into_gamut = samples != SampleType::f32;
  RawToRgb kernel(xyz.width(), executor.width());
  const CameraPlanes in{xyz.view()};
  std::visit(
      [&](auto& picture) {
        using P = std::remove_reference_t<decltype(picture)>;
        if constexpr (std::is_same_v<P, SceneLinear>) {
          kernel.linear(in, transform, picture.view(), executor);
        } else {
          const ToneTable tone = make_tone_table(ToneCurve::none, space, 1);
          if constexpr (std::is_same_v<P, Encoded8>) kernel.rgb8(in, transform, tone, picture.codes.view(), executor);
          if constexpr (std::is_same_v<P, Encoded16>) kernel.rgb16(in, transform, tone, picture.codes.view(), executor);
        }
      },
      out);
  return out;
}

}  // namespace lowlux::isp
