#include "capture/synthetic/fixed_pattern.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "isp/base/random/random.h"

namespace lowlux::capture {
namespace {

constexpr int prnu_word = 0, dsnu_word = 1, is_hot_word = 2, how_hot_word = 3;
constexpr int has_trap_word = 0, amplitude_word = 1;

void multiply(const PatternRow& row, int word, float deviation, std::span<float> values, std::span<float> scratch) {
  const auto z = scratch.first(values.size());
  normal_row({row.seed, 0, draw_purpose::fixed_pattern}, row.x0, row.y, word, z);
  for (std::size_t i = 0; i < values.size(); ++i) values[i] *= std::max(0.0f, 1.0f + deviation * z[i]);
}

/// Returns the exponentially distributed deviate of a word.
float exponential_of_word(std::uint32_t word, double mean) {
  return static_cast<float>(-mean * std::log((word + 0.5) * 0x1p-32));
}

/// Returns whether a pixel belongs to a fraction of all by its word.
bool is_among(std::uint32_t word, double fraction) { return word + 0.5 < fraction * 0x1p32; }

}  // namespace

void apply_prnu(const PatternRow& row, float deviation, std::span<float> values, std::span<float> scratch) {
  multiply(row, prnu_word, deviation, values, scratch);
}

void apply_dsnu(const PatternRow& row, float deviation, std::span<float> values, std::span<float> scratch) {
  multiply(row, dsnu_word, deviation, values, scratch);
}

void add_hot_pixels(const PatternRow& row, double fraction, double mean_e, std::span<float> charge_e,
                    std::span<std::uint32_t> scratch) {
  const DrawStream stream{row.seed, 0, draw_purpose::fixed_pattern};
  const auto is_hot = scratch.first(charge_e.size());
  words_row(stream, row.x0, row.y, is_hot_word, is_hot);
  for (std::size_t i = 0; i < charge_e.size(); ++i) {
    if (!is_among(is_hot[i], fraction)) continue;
    const PhiloxWords words = words_at(stream, row.x0 + static_cast<std::uint32_t>(i), row.y);
    charge_e[i] += exponential_of_word(words[how_hot_word], mean_e);
  }
}

void find_hot_pixels(const PatternRow& row, double fraction, std::span<std::uint32_t> scratch,
                     std::span<std::uint8_t> hot) {
  const auto words = scratch.first(hot.size());
  words_row({row.seed, 0, draw_purpose::fixed_pattern}, row.x0, row.y, is_hot_word, words);
  for (std::size_t i = 0; i < hot.size(); ++i) hot[i] = is_among(words[i], fraction) ? 1 : 0;
}

void add_column_pattern(const PatternRow& row, float deviation_e, std::span<float> offset_e, std::span<float> scratch) {
  const auto z = scratch.first(offset_e.size());
  normal_row({row.seed, 0, draw_purpose::column_noise}, row.x0, 0, 0, z);
  for (std::size_t i = 0; i < offset_e.size(); ++i) offset_e[i] += deviation_e * z[i];
}

void add_telegraph_noise(const PatternRow& row, std::uint64_t seed, std::uint32_t frame, double fraction, double mean_e,
                         std::span<float> offset_e, std::span<std::uint32_t> scratch) {
  const DrawStream traps{row.seed, 0, draw_purpose::telegraph_noise};
  const DrawStream states{seed, frame, draw_purpose::telegraph_state};
  const auto has_trap = scratch.first(offset_e.size());
  words_row(traps, row.x0, row.y, has_trap_word, has_trap);
  for (std::size_t i = 0; i < offset_e.size(); ++i) {
    if (!is_among(has_trap[i], fraction)) continue;
    const std::uint32_t x = row.x0 + static_cast<std::uint32_t>(i);
    const float half = 0.5f * exponential_of_word(words_at(traps, x, row.y)[amplitude_word], mean_e);
    const bool captured = words_at(states, x, row.y)[0] >> 31 != 0;
    offset_e[i] += captured ? -half : half;
  }
}

float row_offset_e(std::uint64_t seed, std::uint32_t frame, std::uint32_t y, float deviation_e) {
  return deviation_e * normal_of_word(words_at({seed, frame, draw_purpose::row_noise}, 0, y)[0]);
}

}  // namespace lowlux::capture
