#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <memory>
#include <vector>

#include "denoise/layout.h"
#include "denoise/nl_bayes_rows.h"
#include "denoise/point_sources.h"
#include "isp/base/plane.h"

/// The memory of a Denoiser: everything a frame needs, laid out for the largest.
namespace lowlux::denoise {

/// Four planes of one size: L, C1, C2, C3.
struct PlaneSet {
  std::array<float*, 4> plane{};
  std::ptrdiff_t stride = 0;

  float* row(int p, int y) const { return plane[p] + y * stride; }
};

/// One pyramid level. `variance` and `residual` are of half its size.
struct PyramidLevel {
  int width = 0;  // of the frame at hand
  int height = 0;
  PlaneSet noisy;
  PlaneSet value[2];  // of pass 1 and of pass 2
  PlaneSet variance;  // mean over 2x2 cells, divided by 4
  PlaneSet residual;
};

/// Rows of one thread. All are of the widest level and its padding.
struct ThreadMemory {
  std::array<float*, 2> raw{};                     // one row of raw samples each
  std::array<std::array<float*, 16>, 3> window{};  // R, G, B with dark, last 16 rows
  std::array<std::array<float*, 8>, 4> value{};    // sums of blocks, of 8 rows
  std::array<std::array<float*, 4>, 4> weight{};   // of 4 rows of half size
  std::array<std::array<float*, 4>, 4> residual{};
  std::array<float*, 11> row{};
  float* blocks = nullptr;
};

/// Sums of patches of one thread, for Level::best only.
struct PatchMemory {
  std::array<std::array<float*, rows::ring>, 4> change{};
  std::array<std::array<float*, rows::ring>, 4> weight{};
  std::array<std::array<float*, 2>, 4> residual{};  // of half size
  std::array<std::array<float*, 2>, 4> residual_weight{};
  float* scratch = nullptr;
  std::uint8_t* chroma = nullptr;  // of each patch of a row
};

/// What lies in one stretch of floats.
struct FrameLayout {
  /// @param best  whether Level::best is wanted too
  FrameLayout(int max_width, int max_height, int threads, bool best);

  int columns;  // cells of the largest frame
  int rows;
  std::array<PyramidLevel, most_levels> level{};
  PlaneSet difference;  // of the size of level 1
  std::vector<ThreadMemory> thread;
  std::vector<SearchMemory> search;  // of each thread
  std::vector<PatchMemory> patches;  // of each thread, or empty

  /// Places everything from `memory` on; without memory it only counts.
  /// @return the floats that takes
  std::size_t lay_out(float* memory);
};

struct FrameMemory : FrameLayout {
  FrameMemory(int max_width, int max_height, int threads, bool best);
  /// Of memory that one takes.
  static std::size_t bytes(int max_width, int max_height, int threads, bool best);

  Plane<std::uint8_t> sources;            // cells that hold point sources
  Plane<std::uint8_t> saturated;          // cells of level 0 that hold saturated sites: 1
  std::vector<float> starts;              // chroma start level of each tile
  std::vector<unsigned char> has_chroma;  // for each level, each tile

 private:
  struct Free {
    void operator()(float* memory) const { std::free(memory); }
  };
  std::unique_ptr<float[], Free> memory_;  // zeros of the system, which threads touch first
  std::vector<std::int32_t> found_;
  std::vector<std::uint8_t> chroma_;
};

}  // namespace lowlux::denoise
