#include "denoise/spatial/frame_memory.h"

#include <algorithm>
#include <cassert>
#include <new>

#include "denoise/spatial/rows.h"
#include "isp/base/memory.h"

namespace lowlux::denoise {
namespace {

constexpr std::size_t line_floats = 16;  // one cache line
constexpr std::size_t lead = 16;         // floats that may be read before a row

constexpr std::size_t means_of_square = 6;  // of R, G, B, and their variances

/// Returns the floats of a row, an odd number of cache lines: at a power of two, the rows that are read together would
/// share cache sets.
std::size_t row_size(int cells) {
  const std::size_t lines = (lead + static_cast<std::size_t>(cells) + rows::padding + line_floats - 1) / line_floats;
  return (lines | 1U) * line_floats;
}

/// Allocates rows from one array; without memory it only counts.
class Rows {
 public:
  explicit Rows(float* memory) : memory_(memory) {}

  float* take(std::size_t row, std::size_t count) {
    float* const first = memory_ == nullptr ? nullptr : memory_ + used_ + lead;
    used_ += row * count;
    return first;
  }
  PlaneSet planes(int width, int height) {
    const std::size_t row = row_size(width);
    PlaneSet set;
    set.stride = static_cast<std::ptrdiff_t>(row);
    for (float*& plane : set.plane) plane = take(row, static_cast<std::size_t>(height));
    return set;
  }
  /// Returns scratch memory of at least `floats` floats for a kernel.
  rows::RowScratch kernel(std::size_t floats) {
    const std::size_t whole = (lead + floats + line_floats - 1) / line_floats * line_floats;
    return {take(whole, 1), whole - lead};
  }
  /// Makes everything that `lay_out` allocates one scratch memory.
  template <class LayOut>
  Scratch scratch(const LayOut& lay_out) {
    const std::size_t first = used_;
    lay_out();
    const Scratch out{memory_ == nullptr ? nullptr : memory_ + first, (used_ - first) * sizeof(float)};
    used_ += scratch_guard_bytes / sizeof(float);
    if (memory_ != nullptr) close_scratch(out);
    return out;
  }
  std::size_t used() const { return used_; }

 private:
  float* memory_;
  std::size_t used_ = 0;
};

void lay_out(Rows& from, int width, FrontMemory& out) {
  out.scratch = from.scratch([&] {
    for (float*& r : out.raw) r = from.take(row_size(2 * width), 1);
    for (auto& plane : out.window) {
      for (float*& r : plane) r = from.take(row_size(width), 1);
    }
    out.saturated = from.take(row_size(width), 1);
    out.ratio = from.take(row_size(width / 2), 1);
    out.variance = from.kernel(rows::variance_scratch(width));
  });
}

void lay_out(Rows& from, int width, BlockMemory& out) {
  out.scratch = from.scratch([&] {
    for (auto& plane : out.value) {
      for (float*& r : plane) r = from.take(row_size(width), 1);
    }
    for (auto* sums : {&out.weight, &out.residual}) {
      for (auto& plane : *sums) {
        for (float*& r : plane) r = from.take(row_size(width / 2), 1);
      }
    }
    out.weights = from.kernel(rows::finish_scratch(width));
    out.blocks = from.kernel(rows::block_scratch(width));
  });
}

void lay_out(Rows& from, int width, UpMemory& out) {
  out.scratch = from.scratch([&] {
    out.up = from.kernel(rows::up_scratch(width / 2));
    for (float** r : {&out.coarse, &out.share, &out.finer}) *r = from.take(row_size(width), 1);
  });
}

void lay_out(Rows& from, int width, UnpackMemory& out) {
  out.scratch = from.scratch([&] {
    out.up = from.kernel(rows::up_scratch(width / 2));
    for (float*& r : out.residual) r = from.take(row_size(width), 1);
    for (float** r : {&out.signal[0], &out.signal[1], &out.ratio}) *r = from.take(row_size(2 * width), 1);
    for (float** r : {&out.removed, &out.seen, &out.confidence}) *r = from.take(row_size(width), 1);
  });
}

void lay_out(Rows& from, int width, MeansMemory& out) {
  out.scratch = from.scratch([&] {
    for (float*& r : out.row) r = from.take(row_size(width), 1);
  });
}

void lay_out(Rows& from, int width, SearchMemory& out) {
  out.scratch = from.scratch([&] {
    for (float*& r : out.pair) r = from.take(row_size(2 * width), 1);
    for (float*& r : out.sums) r = from.take(row_size(2 * width), 1);
    out.ratio = from.take(row_size(2 * width), 1);
  });
}

void lay_out(Rows& from, int width, PatchMemory& out) {
  out.scratch = from.scratch([&] {
    for (auto* sums : {&out.change, &out.weight}) {
      for (auto& plane : *sums) {
        for (float*& r : plane) r = from.take(row_size(width), 1);
      }
    }
    for (auto* sums : {&out.residual, &out.residual_weight}) {
      for (auto& plane : *sums) {
        for (float*& r : plane) r = from.take(row_size(width / 2), 1);
      }
    }
    out.patches = from.kernel(rows::patch_scratch());
  });
}

/// Cells of the largest frame, including those appended as padding.
struct Extent {
  int levels;
  int width;
  int height;
  std::size_t starts;   // tiles of ChromaStarts
  std::size_t squares;  // over which means are kept
};

Extent extent_of(const FrameLayout& of) {
  const int levels = levels_of(of.columns, of.rows);
  return {levels, padded(of.columns, levels), padded(of.rows, levels),
          static_cast<std::size_t>(tiles_of(of.columns)) * static_cast<std::size_t>(tiles_of(of.rows)),
          static_cast<std::size_t>(squares_of(of.columns)) * static_cast<std::size_t>(squares_of(of.rows))};
}

}  // namespace

FrameLayout::FrameLayout(int max_width, int max_height, int threads, bool best)
    : columns((max_width + 1) / 2),
      rows((max_height + 1) / 2),
      thread(static_cast<std::size_t>(threads)),
      search(static_cast<std::size_t>(threads)),
      patches(best ? static_cast<std::size_t>(threads) : 0) {
  assert(max_width >= 2 && max_height >= 2 && threads >= 1);
  assert(max_width <= largest_side && max_height <= largest_side);
}

std::size_t FrameLayout::lay_out(float* memory) {
  const Extent extent = extent_of(*this);
  Rows from(memory);
  for (int l = 0; l < extent.levels; ++l) {
    const int w = extent.width >> l, h = extent.height >> l;
    level[l].noisy = from.planes(w, h);
    for (PlaneSet& set : level[l].value) set = from.planes(w, h);
    level[l].variance = from.planes(w / 2, h / 2);
    level[l].residual = from.planes(w / 2, h / 2);
  }
  difference = from.planes(extent.width / 2, extent.height / 2);
  for (ThreadMemory& own : thread) {
    denoise::lay_out(from, extent.width, own.front);
    denoise::lay_out(from, extent.width, own.blocks);
    denoise::lay_out(from, extent.width, own.up);
    denoise::lay_out(from, extent.width, own.unpack);
    denoise::lay_out(from, extent.width, own.means);
  }
  for (SearchMemory& own : search) denoise::lay_out(from, extent.width, own);
  for (PatchMemory& own : patches) denoise::lay_out(from, extent.width, own);
  return from.used();
}

std::size_t FrameMemory::bytes(int max_width, int max_height, int threads, bool best) {
  FrameLayout layout(max_width, max_height, threads, best);
  const Extent extent = extent_of(layout);
  const std::size_t cells = static_cast<std::size_t>(layout.columns) * static_cast<std::size_t>(layout.rows);
  const std::size_t padded_cells = static_cast<std::size_t>(extent.width) * static_cast<std::size_t>(extent.height);
  const auto workers = static_cast<std::size_t>(threads);
  return sizeof(float) * layout.lay_out(nullptr) + cells + padded_cells +
         sizeof(std::int32_t) * workers * static_cast<std::size_t>(max_width) +
         layout.patches.size() * (sizeof(PatchMemory) + static_cast<std::size_t>(extent.width)) +
         workers * (sizeof(ThreadMemory) + sizeof(SearchMemory)) + extent.starts * (2 * sizeof(float) + max_levels) +
         means_of_square * sizeof(float) * extent.squares + sizeof(FrameMemory);
}

FrameMemory::FrameMemory(int max_width, int max_height, int threads, bool best)
    : FrameLayout(max_width, max_height, threads, best),
      sources(columns, rows),
      found_(static_cast<std::size_t>(threads) * max_width) {
  const Extent extent = extent_of(*this);
  saturated = Plane<std::uint8_t>(extent.width, extent.height);
  // Memory is zeroed: cells next to rows are read, and must be finite.
  const std::size_t floats = lay_out(nullptr);
  memory_.reset(static_cast<float*>(std::calloc(floats, sizeof(float))));
  if (!memory_) throw std::bad_alloc();
  prefer_huge_pages(memory_.get(), floats * sizeof(float));
  lay_out(memory_.get());
  for (int i = 0; i < threads; ++i) search[i].found = found_.data() + static_cast<std::ptrdiff_t>(i) * max_width;
  const auto width = static_cast<std::size_t>(extent.width);
  chroma_.resize(patches.size() * width);
  for (std::size_t i = 0; i < patches.size(); ++i) patches[i].chroma = chroma_.data() + i * width;
  starts.resize(extent.starts);
  removed.resize(extent.starts);
  has_chroma.resize(extent.starts * max_levels);
  means.resize(means_of_square * extent.squares);
}

}  // namespace lowlux::denoise
