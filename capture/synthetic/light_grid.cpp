#include "capture/synthetic/light_grid.h"

#include <algorithm>
#include <cassert>
#include <vector>

namespace lowlux::capture {
namespace {

int mirrored(int sample, int count) {
  const int period = 2 * count, at = ((sample % period) + period) % period;
  return at < count ? at : period - 1 - at;
}

/// Returns std::floor, which is a function call where the instruction set has none for it.
long long floor_of(double value) {
  const auto towards_zero = static_cast<long long>(value);
  return towards_zero - (static_cast<double>(towards_zero) > value ? 1 : 0);
}

/// Returns the weights of the five quartic B-splines around a position that is `offset` from the middle one, -0.5..0.5.
std::array<float, 5> quartic_weights(float offset) {
  const auto outer = [](float to_end) { return to_end * to_end * to_end * to_end / 24; };
  const auto inner = [](float x) {  // 0.5..1.5 from its knot
    return 55.0F / 96 + x * (5.0F / 24 + x * (-5.0F / 4 + x * (5.0F / 6 - x / 6)));
  };
  const float square = offset * offset;
  return {outer(0.5F - offset), inner(1 + offset), 115.0F / 192 + square * (-5.0F / 8 + square / 4), inner(1 - offset),
          outer(0.5F + offset)};
}

}  // namespace

// Mirrored samples make the means symmetric about (reduction - 2) / 2 and, `samples` farther, about the other end:
// those between the two are stored.
LightGrid::Axis::Axis(int samples_, int reduction_)
    : samples(samples_),
      reduction(reduction_),
      first((reduction_ - 1) / 2),
      stored(reduction_ % 2 == 0 ? samples_ + 1 : samples_) {}

int LightGrid::Axis::sample(int index, int i) const { return mirrored(first + index - reduction + 1 + i, samples); }

/// The five stored means that a pixel at any position sees, with their weights: a quartic B-spline.
struct LightGrid::Taps {
  std::array<int, 5> index;
  std::array<float, 5> weight;
  bool successive;  // the indices are
};

inline LightGrid::Taps LightGrid::taps(const Axis& axis, double position_px) {
  const double mean = axis.reduction * position_px + (axis.reduction - 1);
  const long long middle = floor_of(mean + 0.5), first = middle - 2 - axis.first;
  Taps out{{},
           quartic_weights(static_cast<float>(mean - static_cast<double>(middle))),
           first >= 0 && first + 4 < axis.stored};
  if (out.successive) {
    for (int i = 0; i < 5; ++i) out.index[i] = static_cast<int>(first) + i;
    return out;
  }
  const long long period = 4LL * axis.samples;  // in halves of a sample, from the first axis of symmetry
  for (int i = 0; i < 5; ++i) {
    long long at = (2 * (first + i + axis.first) - (axis.reduction - 2)) % period;
    if (at < 0) at += period;
    if (at > period / 2) at = period - at;
    out.index[i] = static_cast<int>((at + axis.reduction - 2) / 2) - axis.first;
  }
  return out;
}

LightGrid::LightGrid(const RgbView<const float>& samples, int reduction, int top_px, Executor& executor)
    : columns_(samples[0].width, reduction), rows_(samples[0].height, reduction), top_px_(top_px) {
  assert(samples[0].width > 0 && samples[0].height > 0 && reduction >= 1);
  const float scale = 1.0F / static_cast<float>(reduction * reduction);
  for (int k = 0; k < 3; ++k) means_[k] = Plane<float>(columns_.stored, rows_.stored);
  for_each_band(executor, rows_.stored, [&](RowBand band, int) {
    std::vector<float> sums(static_cast<std::size_t>(samples[0].width));
    for (int k = 0; k < 3; ++k) {
      for (int y = band.first; y < band.last; ++y) {
        std::fill(sums.begin(), sums.end(), 0.0F);
        for (int i = 0; i < reduction; ++i) {
          const float* row = samples[k].row(rows_.sample(y, i));
          for (std::size_t x = 0; x < sums.size(); ++x) sums[x] += row[x];
        }
        float* out = means_[k].row(y);
        for (int x = 0; x < columns_.stored; ++x) {
          float sum = 0;
          for (int i = 0; i < reduction; ++i) sum += sums[static_cast<std::size_t>(columns_.sample(x, i))];
          out[x] = scale * sum;
        }
      }
    }
  });
}

float LightGrid::at(int channel, ImagePoint centre) const {
  const Taps across = taps(columns_, centre.x_px), down = taps(rows_, centre.y_px - top_px_);
  const Plane<float>& means = means_[channel];
  std::array<float, 5> columns{};  // sums down the rows, so that a row is added in vectors
  for (int j = 0; j < 5; ++j) {
    const float* row = means.row(down.index[j]);
    const float weight = down.weight[j];
    if (across.successive) {
      row += across.index[0];
      for (int i = 0; i < 5; ++i) columns[i] += weight * row[i];
    } else {
      for (int i = 0; i < 5; ++i) columns[i] += weight * row[across.index[i]];
    }
  }
  float sum = 0;
  for (int i = 0; i < 5; ++i) sum += across.weight[i] * columns[i];
  return sum;
}

}  // namespace lowlux::capture
