#pragma once

#include <array>
#include <cstdint>
#include <variant>

#include "isp/base/plane.h"

namespace lowlux {

/// Borrows three planes of equal size.
template <class T>
using RgbView = std::array<PlaneView<T>, 3>;

/// Holds three planes of equal size; the domain states what their values are.
template <class Domain>
struct RgbPlanes {
  std::array<Plane<float>, 3> plane;

  RgbPlanes() = default;
  RgbPlanes(int width, int height) : plane{Plane<float>(width, height), {width, height}, {width, height}} {}
  int width() const { return plane[0].width(); }
  int height() const { return plane[0].height(); }
  RgbView<float> view() { return {plane[0].view(), plane[1].view(), plane[2].view()}; }
  RgbView<const float> view() const { return {plane[0].view(), plane[1].view(), plane[2].view()}; }
};

/// Camera RGB has black removed, is 1 at the white level, signed, and not white balanced.
using CameraRgb = RgbPlanes<struct CameraRgbDomain>;
/// Scene-linear R, G, B (or X, Y, Z) of an OutputSpace is signed and unbounded.
using SceneLinear = RgbPlanes<struct SceneLinearDomain>;

/// Holds interleaved R G B codes, ready for a file or a display: `codes` is height x 3 width.
template <class Code>
struct Encoded {
  Plane<Code> codes;
  int width() const { return codes.width() / 3; }
  int height() const { return codes.height(); }
};
using Encoded8 = Encoded<std::uint8_t>;
using Encoded16 = Encoded<std::uint16_t>;

/// Holds a finished image in one of the three sample types files are written in.
using Picture = std::variant<Encoded8, Encoded16, SceneLinear>;

/// Lists the sample types of an image: display codes of 8 or 16 bits, or scene-linear float.
enum class SampleType : std::uint8_t { u8, u16, f32 };

/// Lists the colour spaces of an image. `camera` has no known primaries.
enum class OutputSpace : std::uint8_t { srgb, display_p3, rec2020, linear_srgb, linear_rec2020, xyz, camera };

constexpr bool is_linear(OutputSpace space) { return space >= OutputSpace::linear_srgb; }

}  // namespace lowlux
