#pragma once

#include <array>
#include <span>

#include "isp/base/executor.h"
#include "isp/base/frame.h"
#include "isp/base/plane.h"
#include "isp/pipeline/plan/levels.h"

/// The denoiser works on Bayer cells. A pixel that has all colours, or none, becomes one cell R, G, G, B whose four
/// sites are at one place.
namespace lowlux::isp {

/// The parts of a pixel's charge that the sites of R, G, B of its cell get, such that sums of sites which the denoiser
/// takes as independent have the variance of the pixel's values. Three colours: two sites of half the green charge
/// have, like any two independent halves of it, a sum of the same mean and variance. Monochrome: four sites of a part s
/// each have the luma 0.2 R + 0.3 G1 + 0.3 G2 + 0.2 B = s y of variance s^2 Var[y], and independent ones of variance s
/// Var[y] have 0.26 s Var[y]: s = 0.26.
inline constexpr std::array<double, 3> parts_of_colours{1, 0.5, 1};
inline constexpr std::array<double, 3> parts_of_grey{0.26, 0.26, 0.26};

constexpr bool is_mosaic(const RawDn& raw) { return raw.layout == SensorLayout::bayer; }
constexpr int planes_of(const RawDn& raw) { return raw.layout == SensorLayout::linear_rgb ? 3 : 1; }

/// Reads a region of the active area of a frame that is not a mosaic as fractions of white, defects repaired.
/// @param part  its corner is at an even column and row
/// @param out   planes_of(raw) planes, `part` height x width
void read_pixels(const RawFrame& frame, const RawLevels& levels, const Rect& part,
                 std::span<const PlaneView<float>> out, Executor& executor);

/// Makes the cells of pixels: a mosaic of phase rggb.
/// @param planes  fractions of white: three, or one that serves for all colours
/// @param cell_e  charge of the sites of R, G, B at white [e-]
/// @param cells   twice as high and wide
void make_cells(std::span<const PlaneView<const float>> planes, const std::array<double, 3>& cell_e,
                PlaneView<float> cells, Executor& executor);

/// Makes pixels of cells again, greens and the four sites of monochrome pixels by their mean.
void join_cells(PlaneView<const float> cells, const std::array<double, 3>& cell_e,
                std::span<const PlaneView<float>> planes, Executor& executor);

}  // namespace lowlux::isp
