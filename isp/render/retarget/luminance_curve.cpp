#include "isp/render/retarget/luminance_curve.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <string>

#include "isp/base/text.h"
#include "isp/model/vision/seeing.h"

namespace lowlux::isp {
namespace {

constexpr std::size_t nodes = LuminanceCurve::segments + 1;
constexpr int reach = 6;  // candidates on either side of a node's value
constexpr std::size_t candidates = 2 * reach + 1;
constexpr double first_step = 0.25, last_step = 1e-5;  // decades

struct Bounds {
  double low = 0;
  double high = 0;
};

double segment_cost(double source_log, double from, double to) {
  constexpr double contrast = 0.4, tau = 1e-4;
  const double shown = 0.5 * (from + to), slope = (to - from) / LuminanceCurve::spacing();
  const auto threshold = [](double log) { return threshold_log_contrast(std::pow(10.0, log)); };
  const double change = (contrast - threshold(source_log)) - (slope * contrast - threshold(shown));
  const double shift = source_log - shown;
  return LuminanceCurve::spacing() * (change * change + tau * shift * shift);
}

double middle_log(const LuminanceCurve& curve, std::size_t segment) {
  return curve.first_log + (static_cast<double>(segment) + 0.5) * LuminanceCurve::spacing();
}

/// Finds the best curve whose nodes are integer steps from the given one's, `reach` at most. @return whether it differs
bool improve(LuminanceCurve& curve, double step, const Bounds& bounds) {
  std::array<std::array<double, candidates>, nodes> value{}, cost{};
  std::array<std::array<std::size_t, candidates>, nodes> before{};
  for (std::size_t i = 0; i < nodes; ++i) {
    for (std::size_t k = 0; k < candidates; ++k) {
      const double moved = curve.shown_log[i] + step * (static_cast<int>(k) - reach);
      value[i][k] = std::clamp(moved, bounds.low, bounds.high);
    }
  }
  for (std::size_t i = 1; i < nodes; ++i) {
    for (std::size_t k = 0; k < candidates; ++k) {
      cost[i][k] = std::numeric_limits<double>::infinity();
      for (std::size_t j = 0; j < candidates; ++j) {
        if (value[i - 1][j] > value[i][k]) continue;
        const double sum = cost[i - 1][j] + segment_cost(middle_log(curve, i - 1), value[i - 1][j], value[i][k]);
        if (sum >= cost[i][k]) continue;
        cost[i][k] = sum;
        before[i][k] = j;
      }
    }
  }
  LuminanceCurve best = curve;
  auto at = static_cast<std::size_t>(std::ranges::min_element(cost.back()) - cost.back().begin());
  for (std::size_t i = nodes; i-- > 0; at = before[i][at]) best.shown_log[i] = value[i][at];
  if (!(luminance_curve_cost(best) < luminance_curve_cost(curve) * (1 - 1e-12))) return false;
  curve = best;
  return true;
}

Result<void> check(const LuminanceRange& range) {
  const auto positive = [](double v) { return v > 0 && std::isfinite(v); };
  if (!positive(range.source_white_cd_m2) || !positive(range.display_white_cd_m2)) {
    return fail(ErrorCode::invalid_argument, "luminances of white must be positive and finite, found " +
                                                 number_text(range.source_white_cd_m2) + " and " +
                                                 number_text(range.display_white_cd_m2) + " cd/m2");
  }
  if (!(range.display_black_cd_m2 >= 0 && range.display_black_cd_m2 < range.display_white_cd_m2)) {
    return fail(ErrorCode::invalid_argument, "the display's black must be 0 or more and below its white, found " +
                                                 number_text(range.display_black_cd_m2) + " cd/m2");
  }
  return {};
}

}  // namespace

double luminance_curve_cost(const LuminanceCurve& curve) {
  double sum = 0;
  for (std::size_t i = 0; i + 1 < nodes; ++i) {
    sum += segment_cost(middle_log(curve, i), curve.shown_log[i], curve.shown_log[i + 1]);
  }
  return sum;
}

Result<LuminanceCurve> luminance_curve(const LuminanceRange& range) {
  if (const auto good = check(range); !good) return tl::make_unexpected(good.error());
  LuminanceCurve curve;
  curve.first_log = std::log10(range.source_white_cd_m2) - LuminanceCurve::decades;
  curve.display_black_cd_m2 = range.display_black_cd_m2;
  Bounds bounds;
  bounds.high = std::log10(range.display_white_cd_m2);
  const double darkest = std::min(curve.first_log, bounds.high) - 2 * LuminanceCurve::decades;
  bounds.low = range.display_black_cd_m2 > 0 ? std::log10(range.display_black_cd_m2) : darkest;
  for (std::size_t i = 0; i < nodes; ++i) {
    const double own = curve.first_log + static_cast<double>(i) * LuminanceCurve::spacing();
    curve.shown_log[i] = std::clamp(own, bounds.low, bounds.high);
  }
  double step = first_step;
  while (step > last_step) {
    if (!improve(curve, step, bounds)) step /= 2;
  }
  return curve;
}

double retargeted_luminance(const LuminanceCurve& curve, double source_cd_m2) {
  const double first = std::pow(10.0, curve.first_log);
  if (!(source_cd_m2 > first)) {
    const double black = curve.display_black_cd_m2, lowest = std::pow(10.0, curve.shown_log.front());
    return black + (lowest - black) * std::max(0.0, source_cd_m2) / first;
  }
  const double place = (std::log10(source_cd_m2) - curve.first_log) / LuminanceCurve::spacing();
  if (place >= LuminanceCurve::segments) return std::pow(10.0, curve.shown_log.back());
  const auto segment = static_cast<std::size_t>(place);
  const double t = place - static_cast<double>(segment);
  return std::pow(10.0, std::lerp(curve.shown_log[segment], curve.shown_log[segment + 1], t));
}

}  // namespace lowlux::isp
