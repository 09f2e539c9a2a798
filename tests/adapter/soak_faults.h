#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>

#include "isp/adapter/lowlux_stage.h"
#include "tests/adapter/soak_parts.h"

/// What the soak does wrong on purpose.
namespace lowlux {

/// Makes one thing wrong in a configuration; the code it is refused with.
inline int make_wrong(Chance& chance, lowlux_stage_input& in, lowlux_stage_output& out) {
  switch (chance.below(7)) {
    case 0:
      in.fourcc ^= 0x5a5a5a5a;
      return LOWLUX_STAGE_UNSUPPORTED;
    case 1:
      out.fourcc += 1;
      return LOWLUX_STAGE_UNSUPPORTED;
    case 2:
      in.width = in.height = 65536;
      in.crop = in.masked = {};
      return LOWLUX_STAGE_TOO_LARGE;
    case 3:
      in.crop = {in.width - 1, 0, 2, 2};
      return LOWLUX_STAGE_BAD_ARGUMENT;
    case 4:
      in.white_level = std::numeric_limits<double>::quiet_NaN();
      return LOWLUX_STAGE_BAD_ARGUMENT;
    case 5:
      in.height = chance.from(-5, 1);
      return LOWLUX_STAGE_BAD_ARGUMENT;
    default:
      out.size = static_cast<std::size_t>(chance.below(8));
      return LOWLUX_STAGE_BAD_ARGUMENT;
  }
}

/// The same of what a frame of `in` is processed with.
inline int make_wrong(Chance& chance, const lowlux_stage_input& in, lowlux_stage_source& source,
                      lowlux_stage_picture& picture, lowlux_stage_params& wanted) {
  lowlux_stage_plane& plane = picture.plane[chance.below(picture.planes)];
  switch (chance.below(12)) {
    case 0:
      source.data = nullptr;
      return LOWLUX_STAGE_MISSING_PLANE;
    case 1:
      source.length -= static_cast<std::size_t>(chance.from(1, static_cast<int>(source.length)));
      return LOWLUX_STAGE_SHORT_BUFFER;
    case 2:
      source.stride = static_cast<std::size_t>(chance.below(static_cast<int>(in.stride)));
      return LOWLUX_STAGE_BAD_STRIDE;
    case 3:
      source.stride = SIZE_MAX - static_cast<std::size_t>(chance.below(1000));
      return LOWLUX_STAGE_BAD_STRIDE;
    case 4:
      plane.data = nullptr;
      return LOWLUX_STAGE_MISSING_PLANE;
    case 5:
      plane.length -= static_cast<std::size_t>(chance.from(1, static_cast<int>(plane.length)));
      return LOWLUX_STAGE_SHORT_BUFFER;
    case 6:
      plane.stride = chance.one_in(2) ? 1 : SIZE_MAX / 2 + 1;
      return LOWLUX_STAGE_BAD_STRIDE;
    case 7:
      picture.planes = 0;
      return LOWLUX_STAGE_MISSING_PLANE;
    case 8:
      wanted.valid |= LOWLUX_STAGE_HAS_BLACK;
      wanted.black_level[chance.below(4)] = chance.one_in(2) ? 65535.0F : std::numeric_limits<float>::quiet_NaN();
      return LOWLUX_STAGE_BAD_PARAMETER;
    case 9:
      wanted.valid |= LOWLUX_STAGE_HAS_EXPOSURE | 1U << chance.from(20, 31);
      wanted.exposure_s = -1;
      return LOWLUX_STAGE_BAD_PARAMETER;
    case 10:
      wanted.size = static_cast<std::size_t>(chance.below(100));
      return LOWLUX_STAGE_BAD_ARGUMENT;
    default:
      picture.size = SIZE_MAX;
      return LOWLUX_STAGE_BAD_ARGUMENT;
  }
}

}  // namespace lowlux
