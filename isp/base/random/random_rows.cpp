#include "isp/base/random/random_rows.h"

#if defined(__aarch64__)  // NEON only: SVE vectors have no fixed size and cannot be struct members
#define HWY_DISABLED_TARGETS (HWY_SVE | HWY_SVE2 | HWY_SVE_256 | HWY_SVE2_128)
#endif
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "isp/base/random/random_rows.cpp"
#include <hwy/foreach_target.h>  // compiles this file once more for each instruction set
#include <hwy/highway.h>

#include "isp/base/random/random-inl.h"

HWY_BEFORE_NAMESPACE();
namespace lowlux::draws::HWY_NAMESPACE {

template <int kWord>
HWY_INLINE void put_one_word(const Row& from, std::size_t count, std::uint32_t* out) {
  const Row row = from;  // a copy, so that no store can change it and its products are hoisted out of the loop
  const Words w;
  VU x = hn::Iota(w, row.x0);
  for (std::size_t i = 0; i < count; i += hn::Lanes(w)) {
    store(w, words_of(row, x).word[kWord], out + i, count - i);
    x = hn::Add(x, hn::Set(w, static_cast<std::uint32_t>(hn::Lanes(w))));
  }
}

/// Calls put(words, index, number of pixels left) for each vector of pixels.
template <int kWord, class Put>
HWY_INLINE void for_each_draw(const Row& from, std::size_t count, const Put& put) {
  const Row row = from;
  HWY_ALIGN std::uint32_t words[1][block_pixels];
  for (std::size_t first = 0; first < count; first += block_pixels) {
    const std::size_t end = HWY_MIN(count, first + block_pixels);
    put_block<kWord, 1>(row, first, end - first, words);
    for (std::size_t i = first; i < end; i += hn::Lanes(Words())) {
      put(hn::Load(Words(), words[0] + (i - first)), i, count - i);
    }
  }
}

template <int kWord>
HWY_INLINE void put_one_normal(const Row& row, std::size_t count, float* out) {
  for_each_draw<kWord>(row, count, [out](VU r, std::size_t i, std::size_t left) HWY_ATTR {
    store(Floats(), normal_of(r), out + i, left);
  });
}

void PutWords(const Row& row, int word, std::size_t count, std::uint32_t* out) {
  if (word == 0) return put_one_word<0>(row, count, out);
  if (word == 1) return put_one_word<1>(row, count, out);
  if (word == 2) return put_one_word<2>(row, count, out);
  put_one_word<3>(row, count, out);
}

void PutNormals(const Row& row, int word, std::size_t count, float* out) {
  if (word == 0) return put_one_normal<0>(row, count, out);
  if (word == 1) return put_one_normal<1>(row, count, out);
  if (word == 2) return put_one_normal<2>(row, count, out);
  put_one_normal<3>(row, count, out);
}

void PutPoisson(const Row& row, const float* mean, std::size_t count, float* out) {
  for_each_draw<0>(row, count, [mean, out](VU r, std::size_t i, std::size_t left) HWY_ATTR {
    store(Floats(), poisson_of(r, load(Floats(), mean + i, left)), out + i, left);
  });
}

void NormalsOfWords(const std::uint32_t* r, std::size_t count, float* out) {
  for (std::size_t i = 0; i < count; i += hn::Lanes(Words())) {
    store(Floats(), normal_of(load(Words(), r + i, count - i)), out + i, count - i);
  }
}

void PoissonOfWords(const std::uint32_t* r, const float* mean, std::size_t count, float* out) {
  for (std::size_t i = 0; i < count; i += hn::Lanes(Words())) {
    const VF counts = poisson_of(load(Words(), r + i, count - i), load(Floats(), mean + i, count - i));
    store(Floats(), counts, out + i, count - i);
  }
}

bool ProductsAreRounded() { return rounds_products(); }

const char* TargetName() { return hwy::TargetName(HWY_TARGET); }

}  // namespace lowlux::draws::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace lowlux::draws {

HWY_EXPORT(PutWords);
HWY_EXPORT(PutNormals);
HWY_EXPORT(PutPoisson);
HWY_EXPORT(NormalsOfWords);
HWY_EXPORT(PoissonOfWords);
HWY_EXPORT(ProductsAreRounded);
HWY_EXPORT(TargetName);

void put_words(const Row& row, int word, std::size_t count, std::uint32_t* out) {
  HWY_DYNAMIC_DISPATCH(PutWords)(row, word, count, out);
}
void put_normals(const Row& row, int word, std::size_t count, float* out) {
  HWY_DYNAMIC_DISPATCH(PutNormals)(row, word, count, out);
}
void put_poisson(const Row& row, const float* mean, std::size_t count, float* out) {
  HWY_DYNAMIC_DISPATCH(PutPoisson)(row, mean, count, out);
}
void normals_of_words(const std::uint32_t* r, std::size_t count, float* out) {
  HWY_DYNAMIC_DISPATCH(NormalsOfWords)(r, count, out);
}
void poisson_of_words(const std::uint32_t* r, const float* mean, std::size_t count, float* out) {
  HWY_DYNAMIC_DISPATCH(PoissonOfWords)(r, mean, count, out);
}
const char* target_name() { return HWY_DYNAMIC_DISPATCH(TargetName)(); }
bool products_are_rounded() { return HWY_DYNAMIC_DISPATCH(ProductsAreRounded)(); }

}  // namespace lowlux::draws
#endif
