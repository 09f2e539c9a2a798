#include "denoise/frame_memory.h"

#include <algorithm>
#include <cassert>
#include <new>

#include "denoise/rows.h"
#include "isp/base/huge_pages.h"

namespace lowlux::denoise {
namespace {

constexpr std::size_t line_floats = 16;  // one cache line
constexpr std::size_t lead = 16;         // floats that may be read before a row

/// An odd number of cache lines: at a power of two, the rows that are read together would share cache sets.
std::size_t row_size(int cells) {
  const std::size_t lines = (lead + static_cast<std::size_t>(cells) + rows::padding + line_floats - 1) / line_floats;
  return (lines | 1U) * line_floats;
}

/// Hands out rows of one stretch of memory; without memory it counts.
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
  std::size_t used() const { return used_; }

 private:
  float* memory_;
  std::size_t used_ = 0;
};

void lay_out_thread(Rows& from, int width, ThreadMemory& out) {
  const std::size_t row = row_size(width), half = row_size(width / 2);
  for (float*& r : out.raw) r = from.take(row_size(2 * width), 1);
  for (auto& plane : out.window) {
    for (float*& r : plane) r = from.take(row, 1);
  }
  for (auto& plane : out.value) {
    for (float*& r : plane) r = from.take(row, 1);
  }
  for (auto* sums : {&out.weight, &out.residual}) {
    for (auto& plane : *sums) {
      for (float*& r : plane) r = from.take(half, 1);
    }
  }
  for (float*& r : out.row) r = from.take(row_size(2 * width), 1);
  out.blocks = from.take(rows::block_scratch(width) + row, 1);
}

void lay_out_search(Rows& from, int width, SearchMemory& out) {
  for (float*& r : out.pair) r = from.take(row_size(2 * width), 1);
  for (float*& r : out.sums) r = from.take(row_size(2 * width), 1);
}

void lay_out_patches(Rows& from, int width, PatchMemory& out) {
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
  out.scratch = from.take(rows::patch_scratch(), 1);
}

/// Cells of the largest frame, those that are appended with them.
struct Extent {
  int levels;
  int width;
  int height;
  std::size_t starts;  // tiles of chroma's start
};

Extent extent_of(const FrameLayout& of) {
  const int levels = levels_of(of.columns, of.rows);
  return {levels, padded(of.columns, levels), padded(of.rows, levels),
          static_cast<std::size_t>(tiles_of(of.columns)) * static_cast<std::size_t>(tiles_of(of.rows))};
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
  for (ThreadMemory& own : thread) lay_out_thread(from, extent.width, own);
  for (SearchMemory& own : search) lay_out_search(from, extent.width, own);
  for (PatchMemory& own : patches) lay_out_patches(from, extent.width, own);
  return from.used() + 2 * lead + denoise::rows::padding;
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
         workers * (sizeof(ThreadMemory) + sizeof(SearchMemory)) + extent.starts * (sizeof(float) + most_levels) +
         sizeof(FrameMemory);
}

FrameMemory::FrameMemory(int max_width, int max_height, int threads, bool best)
    : FrameLayout(max_width, max_height, threads, best),
      sources(columns, rows),
      found_(static_cast<std::size_t>(threads) * max_width) {
  const Extent extent = extent_of(*this);
  saturated = Plane<std::uint8_t>(extent.width, extent.height);
  // Zeros: what lies beside rows is read, and must be numbers.
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
  has_chroma.resize(extent.starts * most_levels);
}

}  // namespace lowlux::denoise
