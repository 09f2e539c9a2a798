#include "calib/dark/dark_stack.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <utility>

#include <fmt/format.h>

namespace lowlux::calib {
namespace {

constexpr int max_frames = 32768;  // times 65535 fits in 32 bits

std::int64_t pixels_of_site(const FrameSetting& s, int site) {
  return static_cast<std::int64_t>((s.width + 1 - (site & 1)) / 2) * ((s.height + 1 - (site >> 1)) / 2);
}

}  // namespace

Result<void> check_noise_is_known(const DarkGroup& group) {
  if (group.frames >= 2) return {};
  return fail(ErrorCode::insufficient,
              fmt::format("there is one dark frame at {:g} s; noise needs two of each exposure time",
                          group.setting.exposure_s.value_or(0)));
}

Result<void> DarkStack::begin(const RawDn& raw, FrameSetting setting) {
  setting_ = std::move(setting);
  const int width = setting_.width, height = setting_.height;
  first_ = Plane<std::uint16_t>(width, height);
  sum_ = Plane<std::int32_t>(width, height);
  squares_ = Plane<float>(width, height);
  for (int y = 0; y < height; ++y) {
    std::copy_n(raw.dn.row(raw.active.y + y) + raw.active.x, width, first_.row(y));
    std::fill_n(sum_.row(y), width, 0);
    std::fill_n(squares_.row(y), width, 0.0f);
  }
  row_sum_.assign(2 * static_cast<std::size_t>(height), 0);
  row_squares_ = row_sum_;
  return {};
}

Result<void> DarkStack::add(const RawDn& raw) {
  auto setting = setting_of(raw);
  if (!setting) return tl::make_unexpected(setting.error());
  if (frames_ == 0) {
    if (auto begun = begin(raw, std::move(*setting)); !begun) return begun;
  } else {
    const auto what = fmt::format("{} frame {}", kind_ == StackedFrames::darks ? "dark" : "flat", frames_ + 1);
    if (auto same = check_same_setting(setting_, *setting, what); !same) return same;
    if (kind_ == StackedFrames::darks && !same_temperature(setting_.temperature_c, setting->temperature_c)) {
      return fail(ErrorCode::invalid_argument,
                  what + " has another temperature than the first; frames of one stack agree within 1 degree");
    }
  }
  if (frames_ == max_frames) {
    return fail(ErrorCode::too_large, fmt::format("a stack holds at most {} frames", max_frames));
  }
  for (int y = 0; y < setting_.height; ++y) add_row(raw, y);
  ++frames_;
  return {};
}

void DarkStack::add_row(const RawDn& raw, int y) {
  const std::uint16_t* codes = raw.dn.row(raw.active.y + y) + raw.active.x;
  const std::uint16_t* first = first_.row(y);
  std::int32_t* sum = sum_.row(y);
  float* squares = squares_.row(y);
  for (int parity = 0; parity < 2; ++parity) {
    std::int64_t difference = 0, at_zero = 0;
    for (int x = parity; x < setting_.width; x += 2) {
      const std::int32_t d = codes[x] - first[x];
      sum[x] += d;
      squares[x] += static_cast<float>(d) * static_cast<float>(d);
      difference += d;
      at_zero += codes[x] == 0;
    }
    const int columns = (setting_.width + 1 - parity) / 2;
    const double mean = static_cast<double>(difference) / columns;
    row_sum_[2 * y + parity] += mean;
    row_squares_[2 * y + parity] += mean * mean;
    at_zero_[site_of(parity, y)] += at_zero;
  }
}

Result<DarkGroup> DarkStack::group() const {
  if (frames_ < 2) {
    return fail(ErrorCode::insufficient, fmt::format("found {} dark frames of one setting; noise needs two", frames_));
  }
  return average();
}

DarkGroup DarkStack::average() const {
  assert(frames_ > 0);
  DarkGroup out;
  out.setting = setting_;
  out.frames = frames_;
  out.mean_dn = Plane<float>(setting_.width, setting_.height);
  out.variance_dn2 = Plane<float>(setting_.width, setting_.height);
  const double n = frames_, degrees = std::max(1, frames_ - 1);
  PerSite<double> variance{}, row_variance{};
  for (int y = 0; y < setting_.height; ++y) {
    for (int x = 0; x < setting_.width; ++x) {
      const double sum = sum_.at(x, y);
      const double pixel = std::max(0.0, (squares_.at(x, y) - sum * sum / n) / degrees);
      out.mean_dn.at(x, y) = static_cast<float>(first_.at(x, y) + sum / n);
      out.variance_dn2.at(x, y) = static_cast<float>(pixel);
      variance[site_of(x, y)] += pixel;
    }
    for (int parity = 0; parity < 2; ++parity) {
      const double sum = row_sum_[2 * y + parity];
      row_variance[site_of(parity, y)] += (row_squares_[2 * y + parity] - sum * sum / n) / degrees;
    }
  }
  for (int site = 0; site < 4; ++site) {
    const auto pixels = static_cast<double>(pixels_of_site(setting_, site));
    const int columns = (setting_.width + 1 - (site & 1)) / 2, rows = (setting_.height + 1 - (site >> 1)) / 2;
    // The pixels' variance includes that of the rows.
    const double of_rows = row_variance[site] / rows, of_pixels = variance[site] / pixels;
    out.row_variance_dn2[site] = (of_rows * columns - of_pixels) / (columns - 1);
    out.fraction_at_zero[site] = static_cast<double>(at_zero_[site]) / (pixels * n);
  }
  return out;
}

}  // namespace lowlux::calib
