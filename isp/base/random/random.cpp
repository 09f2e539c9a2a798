#include "isp/base/random/random.h"

#include <cassert>

#include "isp/base/random/random_rows.h"

namespace lowlux {
namespace {

std::uint32_t low(std::uint64_t seed) { return static_cast<std::uint32_t>(seed); }
std::uint32_t high(std::uint64_t seed) { return static_cast<std::uint32_t>(seed >> 32); }

}  // namespace

draws::Row draws::row_of(const DrawStream& s, std::uint32_t x0, std::uint32_t y) {
  return {x0, y, s.frame, s.purpose, {low(s.seed), high(s.seed)}};
}

PhiloxWords words_at(const DrawStream& s, std::uint32_t x, std::uint32_t y) {
  return philox4x32_10({x, y, s.frame, s.purpose}, {low(s.seed), high(s.seed)});
}

void words_row(const DrawStream& stream, std::uint32_t x0, std::uint32_t y, int word, std::span<std::uint32_t> out) {
  assert(word >= 0 && word < 4);
  draws::put_words(draws::row_of(stream, x0, y), word, out.size(), out.data());
}

void poisson_row(const DrawStream& stream, std::uint32_t x0, std::uint32_t y, std::span<const float> mean,
                 std::span<float> counts) {
  assert(mean.size() == counts.size());
  draws::put_poisson(draws::row_of(stream, x0, y), mean.data(), counts.size(), counts.data());
}

void normal_row(const DrawStream& stream, std::uint32_t x0, std::uint32_t y, int word, std::span<float> out) {
  assert(word >= 0 && word < 4);
  draws::put_normals(draws::row_of(stream, x0, y), word, out.size(), out.data());
}

float poisson_of_word(std::uint32_t r, float mean) {
  float count = 0;
  draws::poisson_of_words(&r, &mean, 1, &count);
  return count;
}

float normal_of_word(std::uint32_t r) {
  float deviate = 0;
  draws::normals_of_words(&r, 1, &deviate);
  return deviate;
}

}  // namespace lowlux
