#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <memory>
#include <vector>

#include "denoise/spatial/layout.h"
#include "denoise/spatial/nl_bayes_rows.h"
#include "denoise/spatial/point_sources.h"
#include "denoise/spatial/rows.h"
#include "isp/base/memory.h"
#include "isp/base/plane.h"

/// The memory of a Denoiser: everything that a frame needs, laid out for the largest frame.
namespace lowlux::denoise {

/// Four planes of one size: L, C1, C2, C3.
struct PlaneSet {
  std::array<float*, 4> plane{};
  std::ptrdiff_t stride = 0;

  float* row(int p, int y) const { return plane[p] + y * stride; }
};

/// One pyramid level. `variance` and `residual` have half its width and height.
struct PyramidLevel {
  int width = 0;  // width of the current frame
  int height = 0;
  PlaneSet noisy;
  PlaneSet value[2];  // results of pass 1 and of pass 2
  PlaneSet variance;  // mean over 2x2 cells, divided by 4
  PlaneSet residual;
};

/// Rows of one thread while it computes planes and variances of level 0. All rows of the thread memories are as long as
/// those of the widest level with its padding, rows of raw samples twice as long.
struct FrontMemory {
  Scratch scratch;
  std::array<float*, 2> raw{};                     // raw samples
  std::array<std::array<float*, 16>, 3> window{};  // R, G, B with dark charge, last 16 rows
  float* saturated = nullptr;
  float* ratio = nullptr;  // noise ratio, one value for two columns
  rows::RowScratch variance{};
};

/// Block sums of one thread.
struct BlockMemory {
  Scratch scratch;
  std::array<std::array<float*, 8>, 4> value{};   // 8 rows
  std::array<std::array<float*, 4>, 4> weight{};  // 4 rows of half width
  std::array<std::array<float*, 4>, 4> residual{};
  rows::RowScratch weights{};  // one row
  rows::RowScratch blocks{};
};

/// Rows of one thread while it adds a level to the next coarser one.
struct UpMemory {
  Scratch scratch;
  rows::RowScratch up{};
  float* coarse = nullptr;
  float* share = nullptr;  // fraction at the coarse level, see fraction_row()
  float* finer = nullptr;  // the same fraction at the next finer level
};

/// Rows of one thread while it converts the planes of level 0 to a mosaic.
struct UnpackMemory {
  Scratch scratch;
  rows::RowScratch up{};
  std::array<float*, 4> residual{};  // then of light: of luma, R, G, B
  float* removed = nullptr;
  float* seen = nullptr;
  std::array<float*, 2> signal{};  // raw samples
  float* ratio = nullptr;          // noise ratio of raw samples
  float* confidence = nullptr;
};

/// Rows of one thread while it restores the means of areas.
struct MeansMemory {
  Scratch scratch;
  std::array<float*, 3> row{};  // R, G, B
};

struct ThreadMemory {
  FrontMemory front;
  BlockMemory blocks;
  UpMemory up;
  UnpackMemory unpack;
  MeansMemory means;
};

/// Patch sums of one thread, for Level::best only.
struct PatchMemory {
  Scratch scratch;
  std::array<std::array<float*, rows::ring>, 4> change{};
  std::array<std::array<float*, rows::ring>, 4> weight{};
  std::array<std::array<float*, 2>, 4> residual{};  // of half width
  std::array<std::array<float*, 2>, 4> residual_weight{};
  rows::RowScratch patches{};
  std::uint8_t* chroma = nullptr;  // whether chroma is wanted in each patch of a row
};

/// Layout of a frame's memory in one array of floats.
struct FrameLayout {
  /// Computes the sizes for the largest frame.
  /// @param best  whether Level::best is needed too
  FrameLayout(int max_width, int max_height, int threads, bool best);

  int columns;  // cells of the largest frame
  int rows;
  std::array<PyramidLevel, max_levels> level{};
  PlaneSet difference;  // difference image, of the size of level 1
  std::vector<ThreadMemory> thread;
  std::vector<SearchMemory> search;  // one for each thread
  std::vector<PatchMemory> patches;  // one for each thread, or empty

  /// Places everything from `memory` on, each scratch memory followed by a guard of its own; without memory it only
  /// counts.
  /// @return the number of floats needed
  std::size_t lay_out(float* memory);
};

struct FrameMemory : FrameLayout {
  FrameMemory(int max_width, int max_height, int threads, bool best);
  /// Returns the number of bytes that one FrameMemory takes.
  static std::size_t bytes(int max_width, int max_height, int threads, bool best);
  /// Returns a mosaic in the memory of the noisy planes of level 0, which are not needed once all passes are done.
  PlaneView<float> mosaic(int width, int height) const {
    const PlaneSet& planes = level[0].noisy;
    return {planes.plane[0], width, height, 2 * planes.stride};
  }

  Plane<std::uint8_t> sources;            // cells that hold point sources
  Plane<std::uint8_t> saturated;          // cells of level 0 that hold saturated sites: 1
  std::vector<float> starts;              // chroma start level of each tile
  std::vector<float> removed;             // see removed_noise(), of each tile
  std::vector<unsigned char> has_chroma;  // for each level, each tile
  std::vector<float> means;               // see restore_means(): of R, G, B in each square, then their variances

 private:
  struct Free {
    void operator()(float* memory) const { std::free(memory); }
  };
  std::unique_ptr<float[], Free> memory_;  // zeroed by the system; threads touch it first
  std::vector<std::int32_t> found_;
  std::vector<std::uint8_t> chroma_;
};

}  // namespace lowlux::denoise
