#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <limits>
#include <string_view>
#include <vector>

#include "isp/adapter/lowlux_stage.h"
#include "isp/base/packed/raw_format.h"
#include "tests/fuzz/input.h"

/// What the stage's C functions are given by a fuzzer.
namespace lowlux::test {

inline constexpr int max_pixels = 64;  // each way

inline lowlux_stage_rect any_rect(FuzzInput& in) {
  lowlux_stage_rect out{};
  if (in.below(2) == 0) return out;
  for (std::int32_t* const side : {&out.x, &out.y, &out.width, &out.height}) {
    *side = (in.below(256) ^ 0x80) - 0x80;  // a byte with a sign
  }
  return out;
}

/// Of one of the formats there are.
inline lowlux_stage_input any_format(FuzzInput& in) {
  lowlux_stage_input out{};
  out.size = sizeof out;
  const auto formats = lowlux::raw_formats();
  const lowlux::RawFormatNames& names = formats[in.take<std::uint8_t>() % formats.size()];
  out.api = names.v4l2_fourcc != 0 ? LOWLUX_STAGE_V4L2 : LOWLUX_STAGE_DRM;
  out.fourcc = names.v4l2_fourcc != 0 ? names.v4l2_fourcc : names.drm_fourcc;
  out.modifier = names.v4l2_fourcc != 0 ? 0 : names.drm_modifier;
  return out;
}

inline lowlux_stage_input any_input(FuzzInput& in) {
  lowlux_stage_input out = any_format(in);
  if (in.below(16) == 0) out.fourcc = in.take<std::uint32_t>();
  out.width = in.below(max_pixels + 1);
  out.height = in.below(max_pixels + 1);
  out.crop = any_rect(in);
  out.masked = any_rect(in);
  if (in.below(4) == 0) out.white_level = in.take<double>();
  return out;
}

inline lowlux_stage_output any_output(FuzzInput& in) {
  constexpr std::uint32_t pictures[] = {LOWLUX_STAGE_XBGR8888, LOWLUX_STAGE_XRGB8888, LOWLUX_STAGE_BGR888,
                                        LOWLUX_STAGE_RGB888,   LOWLUX_STAGE_NV12,     LOWLUX_STAGE_RGB48,
                                        LOWLUX_STAGE_BAYER16};
  lowlux_stage_output out{};
  out.size = sizeof out;
  out.fourcc = pictures[in.below(7)];
  if (in.below(4) == 0) {
    for (std::size_t& stride : out.stride) stride = in.take<std::uint16_t>();
  }
  if (in.below(4) == 0) out.yuv_matrix = in.take<std::int16_t>();
  return out;
}

/// Figures that a frame can have, any of them valid.
inline lowlux_stage_params possible_params(FuzzInput& in) {
  lowlux_stage_params out{};
  out.valid = in.take<std::uint32_t>() & LOWLUX_STAGE_HAS_ALL;
  const auto figure = [&](double scale) { return static_cast<float>(scale * (1 + in.below(255))); };
  for (float& level : out.black_level) level = figure(0.5);
  out.exposure_s = figure(1e-3);
  out.analogue_gain = figure(0.25);
  out.digital_gain = figure(0.125);
  for (float& gain : out.colour_gains) gain = figure(0.02);
  for (float& weight : out.colour_matrix) weight = figure(0.02) - 2;
  out.lux = figure(0.1);
  out.temperature_c = figure(0.5) - 50;
  out.denoise = in.below(LOWLUX_STAGE_DENOISE_AUTO + 1);
  out.sequence = in.take<std::uint8_t>();
  out.timestamp_ns = in.take<std::uint32_t>();
  out.gamma = out.contrast = out.sharpness = figure(0.1);
  out.saturation = figure(1.0 / 64);
  out.exposure_ev = figure(0.1) - 5;
  out.noise_gain = figure(0.05);
  out.noise_read = figure(0.1);
  out.f_number = figure(0.1);
  out.scene_luminance_cd_m2 = figure(0.01);
  out.budget_ms = figure(0.1);
  return out;
}

/// Sizes that structs had before they grew.
template <class T>
inline constexpr std::size_t first_size = sizeof(T);
template <>
inline constexpr std::size_t first_size<lowlux_stage_params> = offsetof(lowlux_stage_params, budget_ms);
template <>
inline constexpr std::size_t first_size<lowlux_stage_result> = offsetof(lowlux_stage_result, step);

/// A struct as a caller hands it over: in memory that ends where its size says, what lies behind its members filled.
template <class T>
class Handed {
 public:
  /// For an answer: nothing but its size is set.
  explicit Handed(FuzzInput& in) : size_(any_size(in)), bytes_(std::max(room(), sizeof size_), 0xA5) {
    std::memcpy(bytes_.data(), &size_, sizeof size_);
    before_ = bytes_;
  }
  Handed(const T& own, FuzzInput& in) : Handed(in) {
    std::memcpy(bytes_.data(), &own, std::min(sizeof own, bytes_.size()));
    std::memcpy(bytes_.data(), &size_, sizeof size_);
    before_ = bytes_;
  }

  T* get() { return reinterpret_cast<T*>(bytes_.data()); }
  /// Whether some version has this size.
  bool is_known() const { return size_ == first_size<T> || (size_ >= sizeof(T) && size_ <= largest); }
  bool is_untouched() const { return bytes_ == before_; }
  /// Whether what no version of today knows is as it was.
  bool keeps_the_rest() const {
    const std::size_t known = std::min(sizeof(T), bytes_.size());
    const auto from = static_cast<std::ptrdiff_t>(known);
    return std::memcmp(bytes_.data(), &size_, sizeof size_) == 0 &&
           std::equal(bytes_.begin() + from, bytes_.end(), before_.begin() + from);
  }
  /// The members that there are, others 0.
  T value() const {
    T out{};
    std::memcpy(&out, bytes_.data(), std::min(sizeof out, bytes_.size()));
    return out;
  }

 private:
  static constexpr std::size_t largest = 65536;

  static std::size_t any_size(FuzzInput& in) {
    const std::array<std::size_t, 8> sizes{
        first_size<T>,
        sizeof(T) - 1 - static_cast<std::size_t>(in.below(static_cast<int>(std::min<std::size_t>(sizeof(T), 256)))),
        largest,
        largest + 1,
        sizeof(T) + 8,
        std::numeric_limits<std::size_t>::max(),
        in.take<std::uint16_t>(),
        0};
    const int which = in.below(64);  // most calls are those that a program makes
    return which < 8 ? sizes[static_cast<std::size_t>(which)] : sizeof(T);
  }
  std::size_t room() const { return is_known() || size_ < sizeof(T) ? size_ : 0; }

  std::size_t size_;
  std::vector<std::uint8_t> bytes_, before_;
};

/// One line that says something.
inline bool is_message(std::string_view text) { return !text.empty() && text.find('\n') == std::string_view::npos; }

}  // namespace lowlux::test
