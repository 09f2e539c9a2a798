#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

/// The row kernels of FrameMeter are dispatched at run time; they read and write only `width` samples.
namespace lowlux::isp::meter {

/// Borrows rows of codes, `stride` codes apart; at most 128, so that no sum below can overflow.
struct CodeRows {
  const std::uint16_t* dn;
  std::ptrdiff_t stride;
  int rows;
  int width;
};

/// Computes column[x] = sum of dn[x] over the rows.
void sum_columns(const CodeRows& in, std::uint32_t* column);

/// Computes the same, and square[x] = sum of min(|dn[x] - dn[x + 2]|, 5792)^2 for x < width - 2.
void sum_columns(const CodeRows& in, std::uint32_t* column, std::uint32_t* square);

/// Counts codes at the ends of the range.
struct Extremes {
  std::uint32_t clipped = 0;  // number of codes of white or more
  std::uint32_t zero = 0;
};
Extremes count_extremes(const std::uint16_t* dn, int width, std::uint16_t white);

/// Converts the luma of complete 2x2 cells of two rows, (weight . sites) / 256, to bins: bin[i] of cell i, up to
/// `last`.
struct LumaBins {
  std::array<std::uint16_t, 4> weight{};  // weights of the sites; their sum is 256
  int shift = 0;                          // right shift from a code to its bin; negative: left shift
  std::uint16_t last = 0;
};
void luma_bins(const std::uint16_t* upper, const std::uint16_t* lower, int width, const LumaBins& how,
               std::uint16_t* bin);

}  // namespace lowlux::isp::meter
