#include "isp/pipeline/render/picture_view.h"

#include <cassert>
#include <cstddef>
#include <cstring>
#include <type_traits>

#include "isp/render/retarget/retarget_rows.h"

namespace lowlux::isp {
namespace {

CodeChange change_by(const RetargetTable& table) {
  return {[](const void* context, const std::uint16_t* rgb, int width, std::uint8_t* out) {
            apply(*static_cast<const RetargetTable*>(context), rgb, width, out);
          },
          [](const void* context, const std::uint16_t* rgb, int width, std::uint16_t* out) {
            apply(*static_cast<const RetargetTable*>(context), rgb, width, out);
          },
          &table};
}

template <class T>
void copy_rows(const PlaneView<T>& from, const PlaneView<T>& to) {
  assert(from.width == to.width && from.height == to.height);
  for (int y = 0; y < to.height; ++y) {
    std::memcpy(to.row(y), from.row(y), static_cast<std::size_t>(to.width) * sizeof(T));
  }
}

void copy_rows(const RgbView<float>& from, const RgbView<float>& to) {
  for (std::size_t c = 0; c < 3; ++c) copy_rows(from[c], to[c]);
}

}  // namespace

Picture make_picture(SampleType samples, int width, int height) {
  switch (samples) {
    case SampleType::u8:
      return Encoded8{Plane<std::uint8_t>(3 * width, height)};
    case SampleType::u16:
      return Encoded16{Plane<std::uint16_t>(3 * width, height)};
    case SampleType::f32:
      break;
  }
  return SceneLinear(width, height);
}

void fit(std::optional<Picture>& picture, SampleType samples, int width, int height) {
  const auto has_size = [&](const auto& image) { return image.width() == width && image.height() == height; };
  if (picture && picture->index() == static_cast<std::size_t>(samples) && std::visit(has_size, *picture)) return;
  picture.reset();  // frees its memory before the next one is allocated
  picture = make_picture(samples, width, height);
}

PictureView view_of(Picture& picture) {
  return std::visit(
      [](auto& image) -> PictureView {
        if constexpr (std::is_same_v<std::remove_reference_t<decltype(image)>, SceneLinear>) {
          return image.view();
        } else {
          return image.codes.view();
        }
      },
      picture);
}

PictureView crop_of(const PictureView& picture, const Rect& pixels) {
  return std::visit(
      [&](const auto& view) -> PictureView {
        const auto part = [&](const auto& plane, int samples) {
          return plane.crop(samples * pixels.x, pixels.y, samples * pixels.width, pixels.height);
        };
        if constexpr (std::is_same_v<std::remove_cvref_t<decltype(view)>, RgbView<float>>) {
          return RgbView<float>{part(view[0], 1), part(view[1], 1), part(view[2], 1)};
        } else {
          return part(view, 3);
        }
      },
      picture);
}

void copy_pixels(const PictureView& from, const PictureView& to) {
  std::visit([&](const auto& out) { copy_rows(std::get<std::remove_cvref_t<decltype(out)>>(from), out); }, to);
}

void encode(RawToRgb& kernel, const RgbInput& in, const RgbTransform& transform, const DevelopPlan& plan,
            const PictureView& out, Executor& executor) {
  const CodeChange retarget = plan.display ? change_by(plan.display->made.table) : CodeChange{};
  const CodeChange* const change = plan.display ? &retarget : nullptr;
  std::visit(
      [&](const auto& view) {
        using View = std::remove_cvref_t<decltype(view)>;
        if constexpr (std::is_same_v<View, PlaneView<std::uint8_t>>) {
          kernel.rgb8(in, transform, plan.rendering.tone, view, executor, change);
        } else if constexpr (std::is_same_v<View, PlaneView<std::uint16_t>>) {
          kernel.rgb16(in, transform, plan.rendering.tone, view, executor, change);
        } else {
          kernel.linear(in, transform, view, executor);
        }
      },
      out);
}

}  // namespace lowlux::isp
