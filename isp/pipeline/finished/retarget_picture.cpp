#include "isp/pipeline/finished/retarget_picture.h"

#include <algorithm>
#include <utility>
#include <variant>
#include <vector>

#include "isp/pipeline/finished/display_target.h"
#include "isp/pipeline/finished/encode_picture.h"
#include "isp/render/output_space.h"
#include "isp/render/retarget/retarget_rows.h"

namespace lowlux::isp {
namespace {

constexpr double highest_code = 65535;

double fraction_of_held(const Encoded16& picture, const RetargetMap& map) {
  constexpr std::size_t max_pixels = 4096;
  const std::size_t pixels = picture.codes.size() / 3;
  const std::size_t asked = std::min(max_pixels, pixels);
  std::size_t held = 0;
  for (std::size_t i = 0; i < asked; ++i) {
    const std::uint16_t* rgb = picture.codes.data() + 3 * (i * pixels / asked);
    held += map({rgb[0] / highest_code, rgb[1] / highest_code, rgb[2] / highest_code}).held ? 1 : 0;
  }
  return asked == 0 ? 0 : static_cast<double>(held) / static_cast<double>(asked);
}

template <class Code>
Encoded<Code> looked_up_codes(const RetargetTable& table, const Encoded16& in, Executor& executor) {
  Encoded<Code> out{Plane<Code>(in.codes.width(), in.codes.height())};
  for_each_band(executor, in.height(), [&](const RowBand& band, int) {
    for (int y = band.first; y < band.last; ++y) apply(table, in.codes.row(y), in.width(), out.codes.row(y));
  });
  return out;
}

SceneLinear decoded(const Encoded16& codes, Executor& executor) {
  std::vector<float> light(65536);
  for (std::size_t i = 0; i < light.size(); ++i) {
    light[i] = static_cast<float>(decode_transfer(OutputSpace::srgb, static_cast<double>(i) / highest_code));
  }
  SceneLinear out(codes.width(), codes.height());
  for_each_band(executor, codes.height(), [&](const RowBand& band, int) {
    for (int y = band.first; y < band.last; ++y) {
      for (int x = 0; x < codes.width(); ++x) {
        for (int c = 0; c < 3; ++c) out.plane[c].at(x, y) = light[codes.codes.at(3 * x + c, y)];
      }
    }
  });
  return out;
}

}  // namespace

Result<RetargetedPicture> retarget_picture(const SceneLinear& xyz, const RetargetOptions& options, SampleType samples,
                                           Executor& executor) {
  const auto map = retargeting(options);
  if (!map) return tl::make_unexpected(map.error());
  const MeasuredTable made = retarget_table(*map, executor);
  const Picture picture = encode_picture(xyz, OutputSpace::srgb, SampleType::u16, executor);
  const auto& in = std::get<Encoded16>(picture);
  RetargetedPicture out;
  out.levels = made.table.levels;
  out.error = made.error;
  out.fraction_outside_gamut = fraction_of_held(in, *map);
  if (samples == SampleType::u8) {
    out.picture = looked_up_codes<std::uint8_t>(made.table, in, executor);
  } else {
    Encoded16 shown = looked_up_codes<std::uint16_t>(made.table, in, executor);
    if (samples == SampleType::u16) {
      out.picture = std::move(shown);
    } else {
      out.picture = decoded(shown, executor);
    }
  }
  return out;
}

}  // namespace lowlux::isp
