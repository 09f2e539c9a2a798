#pragma once

#include <optional>
#include <span>

#include "denoise/denoise_options.h"
#include "denoise/spatial/layout.h"

/// Selects the pyramid level on which the chroma of each tile starts.
namespace lowlux::denoise {

struct ChromaStarts {
  std::span<float> start;               // start level of each tile
  std::span<unsigned char> has_chroma;  // for each level, each tile: whether blocks of chroma are needed there
  int columns = 0;                      // number of tiles
  int rows = 0;
  float least = 0;
  float most = 0;

  bool everywhere(int level) const { return most <= static_cast<float>(level); }
  bool nowhere(int level) const { return least >= static_cast<float>(level + 1); }
};

/// Returns 0, 1 or 2 for a mean signal to noise ratio of one site, q = s / sqrt(r (s + dark + variance)) with the noise
/// ratio r, of at least 3, of at least 0.7, or below. Returns 2 without signal.
int start_of(double mean_signal_e, double mean_dark_e, double variance_e2, double noise_ratio = 1);

/// Fills least, most and has_chroma. A tile needs chroma on a level if a tile up to two tiles away starts on that level
/// or finer: one tile for the blend, one for the cells that recomposition reads around a cell.
void complete(ChromaStarts& starts);

/// Interpolates values of tiles bilinearly between the centres of tiles, for a row of cells of level `grid`.
/// @param tiles  columns * rows of them, row by row
void interpolate_row(std::span<const float> tiles, int columns, int rows, int grid, int y, std::span<float> out);

/// Computes the fraction of coarser levels in the chroma of `level`, for a row of cells of level `grid`.
void fraction_row(const ChromaStarts& starts, int level, int grid, int y, std::span<float> out);

}  // namespace lowlux::denoise
