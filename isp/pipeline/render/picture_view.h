#pragma once

#include <cstdint>
#include <optional>
#include <variant>

#include "isp/base/executor.h"
#include "isp/base/frame.h"
#include "isp/base/image.h"
#include "isp/pipeline/plan.h"
#include "isp/raw/kernel/raw_to_rgb.h"

namespace lowlux::isp {

/// Refers to an image owned elsewhere, or to a crop of one: codes are height x 3 width.
using PictureView = std::variant<PlaneView<std::uint8_t>, PlaneView<std::uint16_t>, RgbView<float>>;

/// Returns an uninitialised image.
Picture make_picture(SampleType samples, int width, int height);

/// Allocates memory for an image of that type and size, unless `picture` is one.
void fit(std::optional<Picture>& picture, SampleType samples, int width, int height);

PictureView view_of(Picture& picture);

/// Returns a crop of an image.
/// @param pixels  inside the image
PictureView crop_of(const PictureView& picture, const Rect& pixels);

/// Copies an image to another of the same size and sample type.
void copy_pixels(const PictureView& from, const PictureView& to);

/// Writes what the kernel makes of `in`, as the plan states: codes, those of the plan's display, or floats.
void encode(RawToRgb& kernel, const RgbInput& in, const RgbTransform& transform, const DevelopPlan& plan,
            const PictureView& out, Executor& executor);

}  // namespace lowlux::isp
