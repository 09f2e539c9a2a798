#include "isp/render/tone.h"

#include <algorithm>
#include <bit>
#include <cassert>
#include <cmath>

#include "isp/render/output_space.h"

namespace lowlux::isp {
namespace {

constexpr double mid_grey = 0.18;
constexpr double black_slope = 0.7;
constexpr double mid_slope = 2 - black_slope;

/// Returns x to the power of the shoulder's p = 1.5; root() is its inverse.
double to_power(double x) { return x * std::sqrt(x); }
double root(double x) { return std::cbrt(x * x); }

/// Holds the slopes of a curve before brightness, and the factor of brightness.
struct Slopes {
  double mid = mid_slope;
  double black = black_slope;
  double gain = 1;
};

Slopes slopes_of(const ToneShape& shape) {
  if (shape == ToneShape{}) return {};
  const double mid = mid_slope * shape.contrast;
  return {mid, 2 - mid, std::exp2(shape.brightness_ev)};
}

double toe(double x, const Slopes& s) {
  return s.gain * (x <= 0 ? s.black * x : x * (s.black + (1 - s.black) * x / mid_grey));
}

double shoulder(double x, double limit, const Slopes& s) {
  const double range = limit - mid_grey, middle = s.gain * mid_grey, slope = s.gain * s.mid;
  const double needed = to_power(slope * range / (1 - middle)) - 1;
  const double t = x - mid_grey;
  const double bend = needed * to_power(t / range);
  return middle + slope * t / root(1 + bend);
}

constexpr int mantissa_bits = 23;

/// Returns the bins in use for 2^log2 bins per octave: the octaves from offset = 2^-octaves to 1, and the rest up to
/// 1 + offset.
constexpr int bins_in_use(int octaves, int log2) { return (octaves << log2) + ((1 << log2) >> octaves) + 1; }

/// Returns the maximum number of bins per octave, as a power of two, that fits the table.
constexpr int bins_per_octave_log2(int octaves) {
  int log2 = 0;
  while (bins_in_use(octaves, log2 + 1) <= ToneTable::capacity) ++log2;
  return log2;
}

float lower_edge_of(const ToneTable& table, int bin) {
  const std::uint32_t bits = table.base_bits() + (static_cast<std::uint32_t>(bin) << table.shift);
  return std::bit_cast<float>(bits) - table.offset;
}

/// Moves the edge above v = 1 so that the last bin's line passes through 1 at v = 1.
void meet_white(ToneTable& table) {
  const int last = table.bins - 1;
  const double low = lower_edge_of(table, last), high = lower_edge_of(table, table.bins);
  const double t = (1.0 - low) / (high - low);
  if (t > 0) {
    table.edge[table.bins] = static_cast<float>(table.edge[last] + (1.0 - table.edge[last]) / t);
  } else {
    table.edge[last] = 1;
  }
  table.code8[last] = 255;
}

}  // namespace

double tone_limit(ToneCurve curve, double exposure_ev) {
  return curve == ToneCurve::none ? 1 : std::clamp(std::exp2(exposure_ev), 1.0, max_tone_limit);
}

double apply_tone(ToneCurve curve, double scene_linear, double limit, const ToneShape& shape) {
  if (scene_linear >= limit) return 1;
  if (curve == ToneCurve::none) return scene_linear;
  const Slopes slopes = slopes_of(shape);
  return scene_linear <= mid_grey ? toe(scene_linear, slopes) : shoulder(scene_linear, limit, slopes);
}

ToneTable make_tone_table(ToneCurve curve, OutputSpace space, double limit, const ToneShape& shape) {
  assert(limit >= 1 && limit <= max_tone_limit && (curve == ToneCurve::standard || limit == 1));
  const auto exact = [&](double v) {
    return encode_transfer(space, apply_tone(curve, std::clamp(v, 0.0, 1.0) * limit, limit, shape));
  };
  const int octaves = 6 + static_cast<int>(std::lround(std::log2(limit)));
  ToneTable table;
  table.offset = std::ldexp(1.0f, -octaves);
  table.shift = mantissa_bits - bins_per_octave_log2(octaves);
  table.bins = table.bin_of(1.0f) + 1;
  for (int bin = 0; bin <= table.bins; ++bin) table.edge[bin] = static_cast<float>(exact(lower_edge_of(table, bin)));
  for (int bin = 0; bin < table.bins; ++bin) {
    const double middle = 0.5 * (static_cast<double>(lower_edge_of(table, bin)) + lower_edge_of(table, bin + 1));
    table.code8[bin] = static_cast<std::int32_t>(std::lround(255 * exact(middle)));
  }
  meet_white(table);
  return table;
}

}  // namespace lowlux::isp
