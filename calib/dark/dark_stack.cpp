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

double saturated_fraction(const DarkGroup& group, double full_dn) {
  const float* means = group.mean_dn.data();
  const auto full = std::count_if(means, means + group.mean_dn.size(), [&](float dn) { return dn > full_dn; });
  return static_cast<double>(full) / static_cast<double>(std::max<std::size_t>(group.mean_dn.size(), 1));
}

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
  const PerSite<double> frame_dn = mean_difference(raw);
  for (int site = 0; site < 4; ++site) {
    frame_sum_[site] += frame_dn[site];
    frame_squares_[site] += frame_dn[site] * frame_dn[site];
  }
  for (int y = 0; y < setting_.height; ++y) add_row(raw, y, frame_dn);
  ++frames_;
  return {};
}

PerSite<double> DarkStack::mean_difference(const RawDn& raw) const {
  PerSite<std::int64_t> sum{};
  for (int y = 0; y < setting_.height; ++y) {
    const std::uint16_t* codes = raw.dn.row(raw.active.y + y) + raw.active.x;
    const std::uint16_t* first = first_.row(y);
    for (int x = 0; x < setting_.width; ++x) sum[site_of(x, y)] += codes[x] - first[x];
  }
  PerSite<double> out{};
  for (int site = 0; site < 4; ++site) {
    out[site] = static_cast<double>(sum[site]) / static_cast<double>(pixels_of_site(setting_, site));
  }
  return out;
}

void DarkStack::add_row(const RawDn& raw, int y, const PerSite<double>& frame_dn) {
  const std::uint16_t* codes = raw.dn.row(raw.active.y + y) + raw.active.x;
  const std::uint16_t* first = first_.row(y);
  std::int32_t* sum = sum_.row(y);
  float* squares = squares_.row(y);
  for (int parity = 0; parity < 2; ++parity) {
    const int site = site_of(parity, y);
    const auto of_frame = static_cast<float>(frame_dn[site]);
    std::int64_t difference = 0, at_zero = 0;
    for (int x = parity; x < setting_.width; x += 2) {
      const std::int32_t d = codes[x] - first[x];
      const float off = static_cast<float>(d) - of_frame;
      sum[x] += d;
      squares[x] += off * off;
      difference += d;
      at_zero += codes[x] == 0;
    }
    const int columns = (setting_.width + 1 - parity) / 2;
    const double mean = static_cast<double>(difference) / columns - frame_dn[site];
    row_sum_[2 * y + parity] += mean;
    row_squares_[2 * y + parity] += mean * mean;
    at_zero_[site] += at_zero;
  }
}

Result<DarkGroup> DarkStack::group() const {
  if (frames_ < 2) {
    return fail(ErrorCode::insufficient, fmt::format("found {} dark frames of one setting; noise needs two", frames_));
  }
  return average();
}

PerSite<double> DarkStack::frame_variance() const {
  PerSite<double> out{};
  const double n = frames_, degrees = std::max(1, frames_ - 1);
  for (int site = 0; site < 4; ++site) {
    out[site] = (frame_squares_[site] - frame_sum_[site] * frame_sum_[site] / n) / degrees;
  }
  return out;
}

// With M rows, N columns and temporal variances f^2 of frames, r^2 of rows and p^2 of pixels, the expectations are
//     row means about the mean of the frame   (r^2 + p^2 / N) (1 - 1 / M)
//     pixels about the mean of the frame      r^2 (1 - 1 / M) + p^2 (1 - 1 / (M N))
//     means of frames                         f^2 + r^2 / M + p^2 / (M N).
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
      const int site = site_of(x, y);
      const double sum = sum_.at(x, y), off = sum - frame_sum_[site];
      const double pixel = std::max(0.0, (squares_.at(x, y) - off * off / n) / degrees);
      const auto pixels = static_cast<double>(pixels_of_site(setting_, site));
      out.mean_dn.at(x, y) = static_cast<float>(first_.at(x, y) + sum / n);
      out.variance_dn2.at(x, y) = static_cast<float>(pixel * pixels / (pixels - 1));
      variance[site] += pixel / pixels;
    }
    for (int parity = 0; parity < 2; ++parity) {
      const double sum = row_sum_[2 * y + parity];
      row_variance[site_of(parity, y)] += (row_squares_[2 * y + parity] - sum * sum / n) / degrees;
    }
  }
  out.frame_variance_dn2 = frame_variance();
  for (int site = 0; site < 4; ++site) {
    const int columns = (setting_.width + 1 - (site & 1)) / 2, rows = (setting_.height + 1 - (site >> 1)) / 2;
    const double of_pixels = (variance[site] - row_variance[site] / rows) * columns / (columns - 1);
    const double of_row_means = row_variance[site] / (rows - 1);
    out.row_variance_dn2[site] = of_row_means - of_pixels / columns;
    out.frame_variance_dn2[site] -= of_row_means / rows;
    out.fraction_at_zero[site] = static_cast<double>(at_zero_[site]) / (pixels_of_site(setting_, site) * n);
  }
  return out;
}

}  // namespace lowlux::calib
