#include "isp/pipeline/finished/raw_codes.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <utility>
#include <vector>

#include "isp/base/random/random.h"

namespace lowlux::isp {
namespace {

constexpr double max_dn = 65535;

std::uint16_t rounded(double dn, std::uint32_t word) {
  const double up = (static_cast<double>(word) + 0.5) / 4294967296.0;
  return static_cast<std::uint16_t>(std::clamp(std::floor(dn + up), 0.0, max_dn));
}

/// Says which figures belong to a sample.
struct SampleIndex {
  int site;
  std::size_t colour;
};

SampleIndex index_of(const RawDn& like, int x, int y) {
  if (like.layout == SensorLayout::linear_rgb) return {x % 3, static_cast<std::size_t>(x % 3)};
  return {site_of(x, y), static_cast<std::size_t>(colour_at(like.phase, x, y))};
}

bool is_saturated(const SignalToEncode& signal, const SampleIndex& index, int x, int y) {
  return static_cast<double>(signal.charge_e.at(x, y)) >= signal.saturation_e[index.colour];
}

Plane<std::uint16_t> coded(const SignalToEncode& signal, const RawDn& like, const SampleLevels& levels,
                           Executor& executor) {
  Plane<std::uint16_t> out(signal.signal_e.width, signal.signal_e.height);
  PerSite<double> dn_per_e = signal.signal_at_white_e;
  for (double& per_e : dn_per_e) per_e = levels.range_dn / per_e;
  for_each_band(executor, out.height(), [&](RowBand band, int) {
    std::vector<std::uint32_t> words(static_cast<std::size_t>(out.width()));
    for (int y = band.first; y < band.last; ++y) {
      words_row({.purpose = draw_purpose::code_dither}, 0, y, 0, words);
      for (int x = 0; x < out.width(); ++x) {
        const SampleIndex index = index_of(like, x, y);
        const double dn = levels.black_dn + signal.signal_e.at(x, y) * dn_per_e[index.site];
        out.at(x, y) = is_saturated(signal, index, x, y) ? static_cast<std::uint16_t>(max_dn) : rounded(dn, words[x]);
      }
    }
  });
  return out;
}

Plane<float> fractions(const SignalToEncode& signal, const RawDn& like, Executor& executor) {
  Plane<float> out(signal.signal_e.width, signal.signal_e.height);
  for_each_band(executor, out.height(), [&](RowBand band, int) {
    for (int y = band.first; y < band.last; ++y) {
      for (int x = 0; x < out.width(); ++x) {
        const SampleIndex index = index_of(like, x, y);
        const double stored = signal.charge_e.at(x, y) / signal.charge_at_white_e[index.site];
        const double fraction = signal.signal_e.at(x, y) / signal.signal_at_white_e[index.site];
        out.at(x, y) = static_cast<float>(is_saturated(signal, index, x, y) ? std::max(1.0, stored) : fraction);
      }
    }
  });
  return out;
}

}  // namespace

SampleLevels code_levels(double dark_noise) {
  const double wanted = 8 * dark_noise / (1 + 8 * dark_noise) * max_dn;
  const double black_dn = std::clamp(256 * std::ceil(wanted / 256), 1024.0, 16384.0);
  return {.black_dn = black_dn, .range_dn = max_dn - black_dn};
}

SampleLevels rgb_code_levels(double dark_noise, double min_sample) {
  const double below = std::clamp(-min_sample, 0.0, 1.0);
  const double wanted = below / (1 + below) * max_dn;
  const double black_dn = std::clamp(16 * std::ceil(wanted / 16), 16.0, code_levels(dark_noise).black_dn);
  return {.black_dn = black_dn, .range_dn = max_dn - black_dn};
}

double min_sample(const Plane<float>& samples_e, const PerSite<double>& at_white_e) {
  std::array<float, 3> least{};
  for (int y = 0; y < samples_e.height(); ++y) {
    const float* const row = samples_e.row(y);
    for (int x = 0; x + 2 < samples_e.width(); x += 3) {
      for (int c = 0; c < 3; ++c) least[c] = std::min(least[c], row[x + c]);
    }
  }
  double out = 0;
  for (std::size_t c = 0; c < 3; ++c) out = std::min(out, static_cast<double>(least[c]) / at_white_e[c]);
  return out;
}

RawDn encode_signal(const SignalToEncode& signal, const RawDn& like, const SampleLevels& levels, Executor& executor) {
  RawDn out;
  const int samples = like.layout == SensorLayout::linear_rgb ? 3 : 1;
  out.active = {0, 0, signal.signal_e.width / samples, signal.signal_e.height};
  if (levels.is_float) {
    out.dn_float = fractions(signal, like, executor);
  } else {
    out.dn = coded(signal, like, levels, executor);
  }
  out.layout = like.layout;
  out.phase = like.phase;
  out.default_crop = like.default_crop;
  out.black_tag = BlackLevel{.samples = samples,
                             .pattern_dn = std::vector<double>(static_cast<std::size_t>(samples), levels.black_dn)};
  out.white_dn.fill(levels.black_dn + levels.range_dn);
  out.info = like.info;
  return out;
}

}  // namespace lowlux::isp
