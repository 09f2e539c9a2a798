#include "denoise/spatial/nl_bayes_rows.h"

#include <algorithm>
#include <cassert>
#include <cstddef>
#include <cstdint>

#if defined(__aarch64__)  // NEON only, as in isp/raw: arrays of vectors need vectors of known size
#define HWY_DISABLED_TARGETS (HWY_SVE | HWY_SVE2 | HWY_SVE_256 | HWY_SVE2_128)
#endif
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "denoise/spatial/nl_bayes_rows.cpp"
#include <hwy/foreach_target.h>  // compiles this file once more for each instruction set
#include <hwy/highway.h>

#include "denoise/spatial/nl_bayes_rows-inl.h"

HWY_BEFORE_NAMESPACE();
namespace lowlux::denoise::rows::HWY_NAMESPACE {

struct Scratch {
  Keys keys;
  Members members;
  Patches patches;
};

/// Adds the result of one plane of a group to the sums.
HWY_INLINE void add_group(const PatchRow& in, int p, const Scratch& s, const Filtered& filtered, int x0,
                          const PatchSums& sums) {
  const hn::FixedTag<float, 4> four;
  const auto weight = hn::Set(four, filtered.weight);
  for (int i = 0; i < s.members.count; ++i) {
    const int x = s.members.x[i], y = s.members.y[i];
    for (int j = 0; j < patch; ++j) {
      const auto pilot = hn::LoadU(four, in.pilot[p] + (y + j) * in.stride + x);
      const auto change = hn::Sub(hn::Load(four, s.patches.noisy[i] + patch * j), pilot);
      float* const changes = sums.change[p][(y + j) % ring] + x;
      float* const weights = sums.weight[p][(y + j) % ring] + x;
      hn::StoreU(hn::MulAdd(weight, change, hn::LoadU(four, changes)), four, changes);
      hn::StoreU(hn::Add(weight, hn::LoadU(four, weights)), four, weights);
    }
  }
  for (int j = 0; j < 2; ++j) {
    for (int i = 0; i < 2; ++i) {
      sums.residual[p][j][x0 / 2 + i] += filtered.weight * filtered.residual;
      sums.residual_weight[p][j][x0 / 2 + i] += filtered.weight;
    }
  }
}

std::size_t PatchScratch() { return (sizeof(Scratch) + alignof(Scratch)) / sizeof(float); }

void NlBayesRow(const PatchRow& in, float* scratch, const PatchSums& sums) {
  auto* const bytes = reinterpret_cast<std::byte*>(scratch);
  const std::size_t beyond = reinterpret_cast<std::uintptr_t>(bytes) % alignof(Scratch);
  Scratch& s = *reinterpret_cast<Scratch*>(bytes + (alignof(Scratch) - beyond));
  for (int x0 = 0; x0 < in.width; x0 += patch) {
    search(in, x0, s.keys);
    choose(in, x0, s.keys, s.members);
    const int planes = in.chroma != nullptr && in.chroma[x0 / patch] != 0 ? 4 : 1;
    for (int p = 0; p < planes; ++p) {
      gather(in, p, s.members, s.patches);
      const float variance = group_variance(in, p, s.members);
      const ResidualOfPatches& left = in.left[p != 0 ? 1 : planes == 4 ? 0 : 2];
      add_group(in, p, s, filter(s.members.count, variance, left, s.patches), x0, sums);
    }
  }
}

void AddMeanRow(const float* sum, const float* weight, int count, const float* to, float* out) {
  const Floats f;
  for (int i = 0; i < count; i += lanes()) {
    const VF w = load(weight + i);
    const VF mean = hn::IfThenElseZero(hn::Gt(w, hn::Zero(f)), hn::Div(load(sum + i), w));
    store(to == nullptr ? mean : hn::Add(mean, load(to + i)), out + i);
  }
}

}  // namespace lowlux::denoise::rows::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace lowlux::denoise::rows {

HWY_EXPORT(PatchScratch);
HWY_EXPORT(NlBayesRow);
HWY_EXPORT(AddMeanRow);

std::size_t patch_scratch() { return HWY_DYNAMIC_DISPATCH(PatchScratch)(); }
void nl_bayes_row(const PatchRow& in, const RowScratch& scratch, const PatchSums& sums) {
  assert(scratch.floats >= patch_scratch());
  HWY_DYNAMIC_DISPATCH(NlBayesRow)(in, scratch.data, sums);
}
void add_mean_row(const float* sum, const float* weight, int count, const float* to, float* out) {
  HWY_DYNAMIC_DISPATCH(AddMeanRow)(sum, weight, count, to, out);
}

}  // namespace lowlux::denoise::rows
#endif
