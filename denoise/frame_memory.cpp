#include "denoise/frame_memory.h"

#include <algorithm>
#include <cassert>

#include "denoise/rows.h"

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

void lay_out(Rows& from, int width, int height, int levels, FrameMemory& out) {
  for (int l = 0; l < levels; ++l) {
    PyramidLevel& level = out.level[l];
    const int w = width >> l, h = height >> l;
    level.noisy = from.planes(w, h);
    for (PlaneSet& set : level.value) set = from.planes(w, h);
    level.variance = from.planes(w / 2, h / 2);
    level.residual = from.planes(w / 2, h / 2);
  }
  out.difference = from.planes(width / 2, height / 2);
  for (ThreadMemory& thread : out.thread) lay_out_thread(from, width, thread);
  for (SearchMemory& search : out.search) lay_out_search(from, width, search);
  for (PatchMemory& patches : out.patches) lay_out_patches(from, width, patches);
}

}  // namespace

FrameMemory::FrameMemory(int max_width, int max_height, int threads, bool best)
    : columns((max_width + 1) / 2),
      rows((max_height + 1) / 2),
      thread(static_cast<std::size_t>(threads)),
      search(static_cast<std::size_t>(threads)),
      patches(best ? static_cast<std::size_t>(threads) : 0),
      sources(columns, rows),
      found_(static_cast<std::size_t>(threads) * max_width) {
  assert(max_width >= 2 && max_height >= 2 && threads >= 1);
  assert(max_width <= largest_side && max_height <= largest_side);
  const int levels = levels_of(columns, rows), width = padded(columns, levels), height = padded(rows, levels);
  saturated = Plane<std::uint8_t>(width, height);
  Rows counted(nullptr);
  lay_out(counted, width, height, levels, *this);
  // Zeros: what lies beside rows is read, and must be numbers.
  memory_ = std::make_unique<float[]>(counted.used() + 2 * lead + rows::padding);
  Rows real(memory_.get());
  lay_out(real, width, height, levels, *this);
  for (int i = 0; i < threads; ++i) search[i].found = found_.data() + static_cast<std::ptrdiff_t>(i) * max_width;
  chroma_.resize(patches.size() * static_cast<std::size_t>(width));
  for (std::size_t i = 0; i < patches.size(); ++i)
    patches[i].chroma = chroma_.data() + i * static_cast<std::size_t>(width);
  const auto tiles = static_cast<std::size_t>(tiles_of(columns)) * static_cast<std::size_t>(tiles_of(rows));
  starts.resize(tiles);
  has_chroma.resize(tiles * most_levels);
}

}  // namespace lowlux::denoise
