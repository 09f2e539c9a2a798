#include "calib/black_figures.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "calib/dark_image.h"

namespace lowlux::calib {
namespace {

constexpr double cut_deviations = 5;
constexpr double most_excluded = 0.05;
constexpr double clipped_share = 1e-3;
constexpr double fewest_pixels = 500;  // of a site: the standard error is below 0.05 standard deviations

int lines_of(int pixels, int parity) { return (pixels + 1 - parity) / 2; }

LineScatter scatter_of(double common_variance, double pixel_variance, double pixels, int lines) {
  const double white = pixel_variance * lines / pixels;
  return {std::sqrt(std::max(0.0, common_variance + white)), std::sqrt(white)};
}

void exclude(const Plane<float>& mean_dn, int site, int frames, PixelMask& mask) {
  const SiteSpread spread = spread_of(mean_dn, site, 0.5 / frames);
  const double cut = cut_deviations * std::max(spread.deviation, 0.5 / frames);
  for (int y = site >> 1; y < mask.height(); y += 2) {
    for (int x = site & 1; x < mask.width(); x += 2) {
      mask.at(x, y) = std::fabs(mean_dn.at(x, y) - spread.median) > cut ? 1 : 0;
    }
  }
}

Result<void> check_codes(const DarkGroup& group) {
  for (int site = 0; site < 4; ++site) {
    if (group.share_at_zero[site] <= clipped_share) continue;
    return fail(ErrorCode::insufficient,
                fmt::format("{:.2g} % of the dark samples are at code 0, so their mean is too high; raise the camera's "
                            "black level (offset)",
                            100 * group.share_at_zero[site]));
  }
  const double white = *std::min_element(group.setting.white_dn.begin(), group.setting.white_dn.end());
  const auto at_white = std::count_if(group.mean_dn.data(), group.mean_dn.data() + group.mean_dn.size(),
                                      [white](float dn) { return dn >= white; });
  const double share = static_cast<double>(at_white) / static_cast<double>(group.mean_dn.size());
  if (share <= most_excluded) return {};
  return fail(ErrorCode::insufficient,
              fmt::format("{:.2g} % of the dark samples are at the white level {:g} DN; expose "
                          "less, or cover the lens",
                          100 * share, white));
}

}  // namespace

Result<BlackFigures> measure_black(const DarkGroup& group) {
  if (auto good = check_codes(group); !good) return tl::make_unexpected(good.error());
  BlackFigures out;
  out.frames = group.frames;
  PixelMask mask(group.mean_dn.width(), group.mean_dn.height());
  double row = 0, column = 0;
  const double one = 1;
  for (int site = 0; site < 4; ++site) {
    exclude(group.mean_dn, site, group.frames, mask);
    const ImageFigures f = figures_of({{&group, 1}, {&one, 1}}, mask, site);
    if (f.pixels < fewest_pixels) {
      return fail(ErrorCode::insufficient,
                  fmt::format("a CFA site has {:g} dark pixels, a black level needs {:g}", f.pixels, fewest_pixels));
    }
    out.level_dn[site] = {f.mean, f.standard_error};
    // The mean of the frames has less noise than one of them.
    const double averaged_away = 1 - 1.0 / group.frames, temporal = f.temporal_variance * group.frames;
    out.deviation_dn[site] = std::sqrt(f.variance + averaged_away * temporal);
    out.rows[site] = scatter_of(f.row_variance, f.variance, f.pixels, lines_of(mask.height(), site >> 1));
    out.columns[site] = scatter_of(f.column_variance, f.variance, f.pixels, lines_of(mask.width(), site & 1));
    row += (f.row_variance + averaged_away * group.row_variance_dn2[site]) / 4;
    column += f.column_variance / 4;
    out.pixels += static_cast<std::int64_t>(f.pixels);
  }
  out.row_noise_dn = std::sqrt(std::max(0.0, row));
  out.column_noise_dn = std::sqrt(std::max(0.0, column));
  out.excluded_share = 1 - static_cast<double>(out.pixels) / static_cast<double>(mask.size());
  if (out.excluded_share <= most_excluded) return out;
  return fail(ErrorCode::insufficient,
              fmt::format("{:.2g} % of the pixels lie far from the others, at most {:g} % may; is this dark?",
                          100 * out.excluded_share, 100 * most_excluded));
}

Result<BlackFigures> measure_black(const RawDn& frame) {
  DarkStack stack;
  if (auto added = stack.add(frame); !added) return tl::make_unexpected(added.error());
  return measure_black(stack.average());
}

Result<RawDn> part_of(const RawDn& frame, const Rect& part) {
  Rect even = part;
  const auto align = [](int& start, int& length, int origin) {
    if (((start - origin) & 1) != 0) {
      ++start;
      --length;
    }
  };
  align(even.x, even.width, frame.active.x);
  align(even.y, even.height, frame.active.y);
  if (even.x < 0 || even.y < 0 || even.width < 1 || even.height < 1 || even.width > frame.dn.width() - even.x ||
      even.height > frame.dn.height() - even.y) {
    return fail(ErrorCode::invalid_argument, fmt::format("there are no pixels {} x {} at ({}, {}) in the readout",
                                                         part.width, part.height, part.x, part.y));
  }
  RawDn out;
  out.dn = Plane<std::uint16_t>(even.width, even.height);
  for (int y = 0; y < even.height; ++y) {
    std::copy_n(frame.dn.row(even.y + y) + even.x, even.width, out.dn.row(y));
  }
  out.layout = frame.layout;
  out.phase = frame.phase;
  out.active = out.default_crop = {0, 0, even.width, even.height};
  out.white_dn = frame.white_dn;
  out.info = frame.info;
  return out;
}

}  // namespace lowlux::calib
