#pragma once

#include <array>
#include <optional>
#include <span>

#include "isp/base/executor.h"
#include "isp/base/frame.h"
#include "isp/base/noise_ratio.h"
#include "isp/base/plane.h"
#include "isp/pipeline/plan/levels.h"

/// The denoiser works on Bayer cells. A pixel that has all colours, or none, becomes one cell R, G, G, B whose four
/// sites are at one place.
namespace lowlux::isp {

/// The parts of a pixel's charge that the sites of R, G, B of its cell get, such that the denoiser, which takes the
/// noise of sites as independent, is right. Three colours: two sites of half the green charge, less and more of a
/// deviation (make_cells). Monochrome: four sites of a part s each have the luma 0.2 R + 0.3 G1 + 0.3 G2 + 0.2 B = s y
/// of variance s^2 Var[y], and independent ones of variance s Var[y] have 0.26 s Var[y]: s = 0.26.
inline constexpr std::array<double, 3> parts_of_colours{1, 0.5, 1};
inline constexpr std::array<double, 3> parts_of_grey{0.26, 0.26, 0.26};

/// Returns the parts for a frame that is not a mosaic.
constexpr const std::array<double, 3>& parts_of(const RawDn& raw) {
  return raw.layout == SensorLayout::linear_rgb ? parts_of_colours : parts_of_grey;
}

constexpr bool is_mosaic(const RawDn& raw) { return raw.layout == SensorLayout::bayer; }
constexpr int planes_of(const RawDn& raw) { return raw.layout == SensorLayout::linear_rgb ? 3 : 1; }

/// Reads a region of the active area of a frame that is not a mosaic as fractions of white, defects repaired.
/// @param part  its corner is at an even column and row
/// @param out   planes_of(raw) planes, `part` height x width
void read_pixels(const RawFrame& frame, const RawLevels& levels, const Rect& part,
                 std::span<const PlaneView<float>> out, Executor& executor);

/// States the charge of cells.
struct CellCharge {
  std::array<double, 3> cell_e{};          // charge of the sites of R, G, B at white [e-]
  std::optional<double> half_variance_e2;  // set for parts_of_colours: of a half of green without light
  NoiseRatioView noise_ratio{};            // noise ratio of the pixels
  int x = 0, y = 0;                        // corner of the pixels in their frame, by which signs of deviations differ
};

/// Makes the cells of pixels: a mosaic of phase rggb. Two halves of one green value are alike, where the denoiser
/// expects two measurements. So a deviation d is subtracted from one and added to the other, which keeps their sum:
///     d = +-sqrt(r (max(g, 0) + half_variance_e2) / 2) for a half g and the noise ratio r,
/// of a sign that differs from pixel to pixel without order. Each half has the variance of its model then, and both are
/// uncorrelated. Without d, means of flats of 20 e- were off by 0.2 %.
/// @param planes  fractions of white: three, or one that serves for all colours
/// @param cells   twice as high and wide
void make_cells(std::span<const PlaneView<const float>> planes, const CellCharge& charge, PlaneView<float> cells,
                Executor& executor);

/// Makes pixels of cells again, greens and the four sites of monochrome pixels by their mean.
void join_cells(PlaneView<const float> cells, const std::array<double, 3>& cell_e,
                std::span<const PlaneView<float>> planes, Executor& executor);

}  // namespace lowlux::isp
