#pragma once

#include <array>
#include <cstdint>
#include <span>

namespace lowlux {

/// Computes Philox4x32-10 (Salmon, Moraes, Dror, Shaw: "Parallel random numbers: as easy as 1, 2, 3", SC11): a
/// bijection of the 128-bit counter for each key, whose outputs serve as independent random words.
constexpr std::array<std::uint32_t, 4> philox4x32_10(std::array<std::uint32_t, 4> counter,
                                                     std::array<std::uint32_t, 2> key) {
  auto& [c0, c1, c2, c3] = counter;
  for (int round = 0; round < 10; ++round) {
    const std::uint64_t p = 0xD2511F53ULL * c0, q = 0xCD9E8D57ULL * c2;
    c0 = static_cast<std::uint32_t>(q >> 32) ^ c1 ^ key[0];
    c1 = static_cast<std::uint32_t>(q);
    c2 = static_cast<std::uint32_t>(p >> 32) ^ c3 ^ key[1];
    c3 = static_cast<std::uint32_t>(p);
    key[0] += 0x9E3779B9U;
    key[1] += 0xBB67AE85U;
  }
  return counter;
}

/// Selects a stream of random numbers. Together with a pixel (x, y) it is the complete input of the generator,
/// Philox4x32-10 (Salmon et al., SC11) with key = seed and counter = (x, y, frame, purpose). There is no state: a draw
/// is the same on every instruction set, compiler, tile and thread.
struct DrawStream {
  std::uint64_t seed = 0;
  std::uint32_t frame = 0;
  std::uint32_t purpose = 0;
};

/// Lists the `purpose` of each quantity. No counter serves two quantities; the four words of one counter are
/// independent.
namespace draw_purpose {
inline constexpr std::uint32_t electrons = 0;            // word 0: collected electrons, word 1: read noise
inline constexpr std::uint32_t fixed_pattern = 2;        // frame 0. Words 0: PRNU, 1: DSNU, 2: is it hot, 3: how hot
inline constexpr std::uint32_t row_noise = 3;            // x = 0, word 0
inline constexpr std::uint32_t column_noise = 4;         // y = 0, frame 0, word 0: a fixed pattern
inline constexpr std::uint32_t scene = 5;                // random scene content: stars
inline constexpr std::uint32_t burst = 6;                // motion between frames. y = 0: camera, x = frame; else movers
inline constexpr std::uint32_t code_dither = 9;          // word 0: rounds electrons to codes without bias
inline constexpr std::uint32_t visual_noise_rods = 10;   // word 0: isomerisations in rods, by cells of 4 pixels
inline constexpr std::uint32_t visual_noise_cones = 11;  // word 0: isomerisations in cones, by cells of 4 pixels
inline constexpr std::uint32_t telegraph_noise = 12;     // frame 0: words 0: has a trap, 1: amplitude
inline constexpr std::uint32_t telegraph_state = 13;     // word 0: state of the trap in a frame
inline constexpr std::uint32_t wavelength_bin = 16;      // + i, for photons sampled by wavelength
}  // namespace draw_purpose

using PhiloxWords = std::array<std::uint32_t, 4>;

/// Limits the means of poisson_row and poisson_of_word; larger means are clamped to it, so callers check first.
inline constexpr float poisson_max_mean = 1e6f;

/// Returns the four words of pixel (x, y).
PhiloxWords words_at(const DrawStream& stream, std::uint32_t x, std::uint32_t y);

/// Writes one word of each of the pixels (x0, y), (x0 + 1, y)...
/// @param word 0..3
void words_row(const DrawStream& stream, std::uint32_t x0, std::uint32_t y, int word, std::span<std::uint32_t> out);

/// Draws Poisson counts by inverse CDF: the smallest k with F(k; mean) >= (r + 1/2) / 2^32, with r word 0 of pixel (x0
/// + i, y). Exact: equal to the CDF evaluated in double, for every mean up to poisson_max_mean. Never falls when the
/// mean or r rises. Means that are zero, negative or not a number give 0.
/// @param mean [events]; as many as counts. Both may be the same memory.
void poisson_row(const DrawStream& stream, std::uint32_t x0, std::uint32_t y, std::span<const float> mean,
                 std::span<float> counts);

/// Draws standard normal deviates by inverse CDF of one word (0..3) of each pixel: relative error below 1e-6, |z| <=
/// 6.4.
void normal_row(const DrawStream& stream, std::uint32_t x0, std::uint32_t y, int word, std::span<float> out);

/// Both functions draw one deviate from one word r of any origin: bit for bit the result of poisson_row and normal_row.
float poisson_of_word(std::uint32_t r, float mean);
float normal_of_word(std::uint32_t r);

}  // namespace lowlux
