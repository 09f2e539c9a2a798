#include "calib/dark/dark_dose.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include <fmt/format.h>

#include "calib/dark/dark_stack.h"

namespace lowlux::calib {
namespace {

constexpr double same_time = 0.01;       // relative
constexpr double max_extrapolation = 4;  // of the charge: two doublings
constexpr double min_ratio = 2;          // of charges that give a line
constexpr double min_doubling_c = 2, max_doubling_c = 30;
constexpr double certain_chi2 = 25;             // square of five standard deviations
constexpr double systematic_dn2 = 0.01 * 0.01;  // of a level: its drift from frame to frame

struct Dose {
  std::size_t level;
  double charge;  // time at the image's temperature [s]
  double weight;
};

double degrees_off(const DarkExposure& a, const DarkExposure& b) {
  return a.temperature_c && b.temperature_c ? *a.temperature_c - *b.temperature_c : 0;
}

}  // namespace

bool is_same_exposure(const DarkExposure& a, const DarkExposure& b) {
  if (std::fabs(a.time_s - b.time_s) > same_time * std::max(a.time_s, b.time_s)) return false;
  return std::fabs(degrees_off(a, b)) <= same_temperature_c;
}

namespace {

std::optional<DarkWeights> plain_mean(std::span<const DarkLevel> levels, const DarkExposure& picture) {
  DarkWeights out{.of_level = std::vector<double>(levels.size())};
  double frames = 0;
  for (std::size_t i = 0; i < levels.size(); ++i) {
    if (!is_same_exposure(levels[i].exposure, picture)) continue;
    out.of_level[i] = levels[i].frames;
    frames += levels[i].frames;
  }
  if (frames == 0) return std::nullopt;
  for (double& w : out.of_level) w /= frames;
  out.same_setting = true;
  return out;
}

// Returns the doses of all levels if the temperature law is known, else of those at the image's temperature.
std::vector<Dose> doses_of(std::span<const DarkLevel> levels, const DarkExposure& picture,
                           const std::optional<double>& doubling_c) {
  std::vector<Dose> out;
  out.reserve(levels.size());
  for (std::size_t i = 0; i < levels.size(); ++i) {
    const double off_c = degrees_off(levels[i].exposure, picture);
    if (!doubling_c && std::fabs(off_c) > same_temperature_c) continue;
    const double current = doubling_c ? std::exp2(off_c / *doubling_c) : 1;
    out.push_back({i, levels[i].exposure.time_s * current, levels[i].frames});
  }
  return out;
}

void weigh_line(const std::vector<Dose>& doses, double charge, DarkWeights& out) {
  double sum = 0, mean = 0, spread = 0;
  for (const Dose& d : doses) sum += d.weight;
  for (const Dose& d : doses) mean += d.weight * d.charge / sum;
  for (const Dose& d : doses) spread += d.weight * (d.charge - mean) * (d.charge - mean);
  for (const Dose& d : doses) {
    out.of_level[d.level] = d.weight * (1 / sum + (charge - mean) * (d.charge - mean) / spread);
  }
}

void weigh_above_pedestal(const std::vector<Dose>& doses, double charge, DarkWeights& out) {
  double squares = 0;
  out.of_pedestal = 1;
  for (const Dose& d : doses) squares += d.weight * d.charge * d.charge;
  for (const Dose& d : doses) {
    out.of_level[d.level] = charge * d.weight * d.charge / squares;
    out.of_pedestal -= out.of_level[d.level];
  }
}

void warn_of_temperatures(std::span<const DarkLevel> levels, const DarkExposure& picture, DarkWeights& out) {
  double low = std::numeric_limits<double>::infinity(), high = -low;
  for (const DarkLevel& level : levels) {
    if (!level.exposure.temperature_c || !picture.temperature_c) {
      out.warnings.emplace_back(
          "the image or the darks do not state their temperature: equal temperatures are assumed");
      return;
    }
    low = std::min(low, *level.exposure.temperature_c);
    high = std::max(high, *level.exposure.temperature_c);
  }
  if (*picture.temperature_c < low - same_temperature_c || *picture.temperature_c > high + same_temperature_c) {
    out.warnings.push_back(fmt::format("the image was taken at {:g} C, the darks at {:g} to {:g} C: extrapolated",
                                       *picture.temperature_c, low, high));
  }
}

Result<void> check_range(double charge_s, double low_s, double high_s, bool line, DarkWeights& out) {
  if (charge_s > max_extrapolation * high_s) {
    return fail(ErrorCode::insufficient,
                fmt::format("the image has {:.3g} times the dark charge of the longest and warmest darks, more than "
                            "the limit of {:g} times; take darks as long and as warm as the image",
                            charge_s / high_s, max_extrapolation));
  }
  if (charge_s > (1 + same_time) * high_s || (line && charge_s < (1 - same_time) * low_s)) {
    out.warnings.push_back(
        fmt::format("dark charge is extrapolated: that of the image corresponds to {:.3g} s, those of the darks to "
                    "{:.3g} to {:.3g} s at the same temperature",
                    charge_s, low_s, high_s));
  }
  return {};
}

struct LevelPoint {
  double charge;
  double level_dn;
  double weight;
};

// Returns the weighted sum of squares about the best line, which passes through the pedestal where that is known.
double misfit(const std::vector<LevelPoint>& points, std::optional<double> pedestal_dn) {
  double w = 0, x = 0, y = 0, xx = 0, xy = 0, out = 0;
  for (const LevelPoint& p : points) w += p.weight, x += p.weight * p.charge, y += p.weight * p.level_dn;
  const double x0 = pedestal_dn ? 0 : x / w, y0 = pedestal_dn.value_or(y / w);
  for (const LevelPoint& p : points) {
    xx += p.weight * (p.charge - x0) * (p.charge - x0);
    xy += p.weight * (p.charge - x0) * (p.level_dn - y0);
  }
  const double slope = xx > 0 ? std::max(0.0, xy / xx) : 0;
  for (const LevelPoint& p : points) out += p.weight * std::pow(p.level_dn - y0 - slope * (p.charge - x0), 2);
  return out;
}

Result<std::optional<double>> doubling_for(std::span<const DarkLevel> levels, const DarkExposure& picture,
                                           const DarkScaling& known) {
  const auto near = [&](const DarkLevel& level) {
    return std::fabs(degrees_off(level.exposure, picture)) <= same_temperature_c;
  };
  if (std::ranges::all_of(levels, near)) return std::optional<double>{};
  if (known.doubling_c) return known.doubling_c;
  if (const auto fitted = fitted_doubling_c(levels, known.pedestal_dn)) return fitted;
  if (std::ranges::any_of(levels, near)) return std::optional<double>{};
  return fail(
      ErrorCode::insufficient,
      fmt::format(
          "the image was taken at {:g} C and no dark within {:g} degree of that; take darks as warm as the image, or "
          "give the doubling temperature of the dark current with --dark-doubling (sensors: 6 to 10 degrees)",
          *picture.temperature_c, same_temperature_c));
}

}  // namespace

std::optional<double> fitted_doubling_c(std::span<const DarkLevel> levels, std::optional<double> pedestal_dn) {
  const bool stated =
      std::ranges::all_of(levels, [](const DarkLevel& l) { return l.exposure.temperature_c.has_value(); });
  if (levels.size() + (pedestal_dn ? 1 : 0) < 3 || !stated) return std::nullopt;
  const auto misfit_at = [&](double doubling_c) {
    std::vector<LevelPoint> points;
    points.reserve(levels.size());
    for (const DarkLevel& l : levels) {
      const double off_c = *l.exposure.temperature_c - *levels.front().exposure.temperature_c;
      points.push_back(
          {l.exposure.time_s * std::exp2(off_c / doubling_c), l.level_dn, 1 / (l.variance_dn2 + systematic_dn2)});
    }
    return misfit(points, pedestal_dn);
  };
  // The misfit is smooth in 1 / doubling and has one minimum: 2000 even steps come within 0.2 % of a doubling of 8.
  constexpr int steps = 2000;
  double best = max_doubling_c, least = std::numeric_limits<double>::infinity();
  for (int i = 0; i <= steps; ++i) {
    const double rate = 1 / max_doubling_c + (1 / min_doubling_c - 1 / max_doubling_c) * i / steps;
    if (const double now = misfit_at(1 / rate); now < least) least = now, best = 1 / rate;
  }
  if (std::min(misfit_at(min_doubling_c), misfit_at(max_doubling_c)) < least + certain_chi2) return std::nullopt;
  return best;
}

Result<DarkWeights> compute_dark_weights(std::span<const DarkLevel> levels, const DarkExposure& picture,
                                         const DarkScaling& known) {
  if (levels.empty()) return fail(ErrorCode::insufficient, "there are no dark frames");
  auto out = plain_mean(levels, picture);
  if (!out) {
    const auto doubling = doubling_for(levels, picture, known);
    if (!doubling) return tl::make_unexpected(doubling.error());
    out = DarkWeights{.of_level = std::vector<double>(levels.size()), .doubling_c = *doubling};
    const std::vector<Dose> doses = doses_of(levels, picture, *doubling);
    const auto [low, high] = std::ranges::minmax(doses, {}, &Dose::charge);
    const bool line = high.charge > min_ratio * low.charge;
    if (auto good = check_range(picture.time_s, low.charge, high.charge, line, *out); !good) {
      return tl::make_unexpected(good.error());
    }
    if (!line && !known.pedestal_dn && !known.pedestal_from_picture) {
      return fail(ErrorCode::insufficient, fmt::format("darks of {:g} s cannot be scaled to {:g} s, because the "
                                                       "pedestal is not known; add darks of the shortest exposure time",
                                                       levels[high.level].exposure.time_s, picture.time_s));
    }
    out->scale = high.charge > 0 ? picture.time_s / high.charge : 1;
    line ? weigh_line(doses, picture.time_s, *out) : weigh_above_pedestal(doses, picture.time_s, *out);
  }
  warn_of_temperatures(levels, picture, *out);
  return *std::move(out);
}

}  // namespace lowlux::calib
