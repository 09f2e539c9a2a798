#include "isp/cli/raw_luminance.h"

#include <algorithm>
#include <cstddef>
#include <vector>

#include "isp/base/executor.h"
#include "isp/model/scene_luminance.h"
#include "isp/raw/black_point.h"
#include "isp/raw/to_linear.h"

namespace lowlux::cli {
namespace {

std::vector<float> green_fractions(const RawDn& raw, const BlackPoint& black) {
  InlineExecutor executor;
  std::vector<float> out;
  if (raw.layout == SensorLayout::linear_rgb) {
    CameraRgb rgb(raw.active.width, raw.active.height);
    isp::to_fraction_rgb(raw, black, rgb.view(), executor);
    out.assign(rgb.plane[1].data(), rgb.plane[1].data() + rgb.plane[1].size());
    return out;
  }
  const RawFraction mosaic = isp::to_fraction(raw, black, executor);
  out.reserve(mosaic.value.size());
  for (int y = 0; y < mosaic.value.height(); ++y) {
    for (int x = 0; x < mosaic.value.width(); ++x) {
      if (raw.layout == SensorLayout::bayer && colour_at(raw.phase, x, y) != CfaColour::green) continue;
      out.push_back(mosaic.value.row(y)[x]);
    }
  }
  return out;
}

/// The value that `share` of the others exceed.
double exceeded_by(std::vector<float>& values, double share) {
  const auto place = static_cast<std::size_t>((1 - share) * static_cast<double>(values.size() - 1));
  const auto at = values.begin() + static_cast<std::ptrdiff_t>(place);
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

}  // namespace

Result<RawLuminance> raw_luminance(const RawFrame& frame, const FrameInfo& info, double share) {
  const auto saturation_cd_m2 = isp::saturation_luminance_cd_m2(info);
  if (!saturation_cd_m2) {
    return fail(
        ErrorCode::insufficient,
        "the luminance is unknown, it takes exposure time, f-number and ISO to estimate it; give --luminance and "
        "--highlight");
  }
  const auto black = isp::choose_black(frame.raw, {});
  if (!black) return tl::make_unexpected(black.error());
  std::vector<float> green = green_fractions(frame.raw, *black);
  if (green.empty()) return fail(ErrorCode::insufficient, "the file has no green pixels; give --luminance");
  constexpr double clipped = 0.995;  // of the range: noise and the last code
  const double highlight = exceeded_by(green, std::clamp(share, 0.0, 1.0));
  const double median = exceeded_by(green, 0.5);
  if (!(median > 0)) {
    return fail(ErrorCode::insufficient, "half of the green pixels are not above black; give --luminance");
  }
  return RawLuminance{median * *saturation_cd_m2, highlight * *saturation_cd_m2, highlight >= clipped};
}

}  // namespace lowlux::cli
