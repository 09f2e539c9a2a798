#pragma once

#include <optional>

#include "isp/base/frame.h"
#include "isp/base/result.h"
#include "isp/pipeline/options.h"

namespace lowlux::isp {

/// Holds which part of the rendered image is kept, and the size it is shrunk to, both before orientation.
struct Framing {
  Rect pixels;
  PictureSize size;

  bool shrinks() const { return size.width != pixels.width || size.height != pixels.height; }
};

/// Decides the framing of an image of `size`; nullopt where all of it is kept as it is. Percentages are rounded to the
/// nearest pixel at each edge. The shorter side of a shrunk image is rounded to the nearest pixel, to 1 at least.
/// Error: invalid_argument, where the crop holds no pixel or reaches beyond the image.
Result<std::optional<Framing>> decide_framing(const PictureSize& size, Orientation orientation,
                                              const DevelopOptions& options);

/// Returns where a region of the upright image lies before orientation.
/// @param upright  size of the upright image
Rect before_orientation(const Rect& region, const PictureSize& upright, Orientation orientation);

}  // namespace lowlux::isp
