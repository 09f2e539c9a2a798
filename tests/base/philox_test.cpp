#include "isp/base/random/random.h"

#include <gtest/gtest.h>

#include <vector>

namespace lowlux {
namespace {

using Counter = std::array<std::uint32_t, 4>;

// Known answers of Random123 (Salmon et al., file kat_vectors), which the compiler works out too.
static_assert(philox4x32_10({0, 0, 0, 0}, {0, 0}) == Counter{0x6627e8d5, 0xe169c58d, 0xbc57ac4c, 0x9b00dbd8});
static_assert(philox4x32_10({0x243f6a88, 0x85a308d3, 0x13198a2e, 0x03707344}, {0xa4093822, 0x299f31d0}) ==
              Counter{0xd16cfe09, 0x94fdcceb, 0x5001e420, 0x24126ea1});
static_assert(philox4x32_10({~0U, ~0U, ~0U, ~0U}, {~0U, ~0U}) ==
              Counter{0x408f276d, 0x41c83b0e, 0xa20bc7c6, 0x6d5451fd});

struct KnownAnswer {
  DrawStream stream;
  std::uint32_t x;
  std::uint32_t y;
  Counter words;
};

const std::vector<KnownAnswer> known_answers{
    {{0, 0, 0}, 0, 0, {0x6627e8d5, 0xe169c58d, 0xbc57ac4c, 0x9b00dbd8}},
    {{0x299f31d0a4093822, 0x13198a2e, 0x03707344},
     0x243f6a88,
     0x85a308d3,
     {0xd16cfe09, 0x94fdcceb, 0x5001e420, 0x24126ea1}},
    {{~0ULL, ~0U, ~0U}, ~0U, ~0U, {0x408f276d, 0x41c83b0e, 0xa20bc7c6, 0x6d5451fd}}};

TEST(Philox, WordsOfAPixelAreTheKnownAnswers) {
  for (const KnownAnswer& known : known_answers) EXPECT_EQ(words_at(known.stream, known.x, known.y), known.words);
}

TEST(Philox, RowsHoldTheWordsOfTheirPixels) {
  // From an odd column, through the end of the columns, and with all lengths of the last vector.
  for (const std::uint32_t x0 : {0U, 13U, 0xFFFFFFF1U}) {
    for (const KnownAnswer& known : known_answers) {
      for (std::size_t size = 0; size <= 64; ++size) {
        for (int word = 0; word < 4; ++word) {
          std::vector<std::uint32_t> row(size + 1, 77);
          words_row(known.stream, x0, known.y, word, std::span(row).first(size));
          for (std::uint32_t i = 0; i < size; ++i) {
            ASSERT_EQ(row[i], words_at(known.stream, x0 + i, known.y)[word]) << "x0 " << x0 << " i " << i;
          }
          ASSERT_EQ(row[size], 77U) << "nothing is written after " << size << " words";
        }
      }
    }
  }
}

TEST(Philox, EveryPartOfTheInputChangesTheWords) {
  const DrawStream stream{5, 6, 7};
  const PhiloxWords here = words_at(stream, 8, 9);
  EXPECT_NE(words_at(stream, 9, 9), here);
  EXPECT_NE(words_at(stream, 8, 8), here);
  EXPECT_NE(words_at({6, 6, 7}, 8, 9), here);
  EXPECT_NE(words_at({5 + (1ULL << 32), 6, 7}, 8, 9), here);
  EXPECT_NE(words_at({5, 7, 7}, 8, 9), here);
  EXPECT_NE(words_at({5, 6, 8}, 8, 9), here);
}

}  // namespace
}  // namespace lowlux
