#include "isp/pipeline/merge/bracket_scene.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <optional>
#include <vector>

#include "isp/merge/exposure.h"
#include "isp/pipeline/merge/frame_electrons.h"

namespace lowlux::isp {
namespace {

constexpr int block = 16;
constexpr double darkest_fraction = 0.1;
constexpr double min_deviations = 3;  // of the darkest tenth above black, in standard errors of a block
constexpr double tail_from = 0.25;    // of the limit of saturation: where the power law begins

/// Returns the charge up to which a merge uses a pixel of R, G and B fully, and the mean dark charge of each.
struct Charges {
  std::array<double, 3> limit_e{};
  std::array<double, 3> dark_e{};
};

Charges charges_of(const FrameElectrons& frame) {
  Charges out;
  for (int site = 0; site < 4; ++site) {
    const auto c = static_cast<std::size_t>(colour_at(frame.phase, site & 1, site >> 1));
    out.dark_e[c] += frame.dark_charge_e[site] * (c == 1 ? 0.5 : 1);
  }
  for (std::size_t c = 0; c < 3; ++c) {
    out.limit_e[c] = merge::full_weight_fraction * (frame.saturation_e[c] + out.dark_e[c]);
  }
  return out;
}

double green_variance(const FrameElectrons& frame) {
  double sum = 0;
  for (int site = 0; site < 4; ++site) {
    if (colour_at(frame.phase, site & 1, site >> 1) == CfaColour::green) sum += frame.variance_e2[site] / 2;
  }
  return sum;
}

/// Returns the charge of each pixel over the limit of saturation of its colour.
std::vector<float> charge_fractions(const FrameElectrons& frame, const Charges& charges) {
  std::vector<float> out;
  out.reserve(frame.signal_e.size());
  for (int y = 0; y < frame.signal_e.height(); ++y) {
    for (int x = 0; x < frame.signal_e.width(); ++x) {
      const auto value = static_cast<double>(frame.signal_e.at(x, y));
      if (std::isnan(value)) continue;
      const auto c = static_cast<std::size_t>(colour_at(frame.phase, x, y));
      out.push_back(static_cast<float>((value + charges.dark_e[c]) / charges.limit_e[c]));
    }
  }
  return out;
}

double fraction_from(const std::vector<float>& values, double limit) {
  const auto count = std::ranges::count_if(values, [&](float v) { return static_cast<double>(v) >= limit; });
  return static_cast<double>(count) / static_cast<double>(values.size());
}

/// Returns the value that the given fraction of the values exceed.
double exceeded_by(std::vector<float>& values, double fraction) {
  const auto last = static_cast<double>(values.size() - 1);
  const auto place = values.begin() + static_cast<std::ptrdiff_t>((1 - fraction) * last);
  std::ranges::nth_element(values, place);
  return static_cast<double>(*place);
}

double highlight_fraction(std::vector<float>& values, double saturated, double clipped_fraction) {
  const double allowed = std::max(clipped_fraction, 1.0 / static_cast<double>(values.size()));
  if (saturated <= allowed) return exceeded_by(values, clipped_fraction);
  const double exponent = std::log(fraction_from(values, tail_from) / saturated) / std::log(1 / tail_from);
  const double excess = std::pow(saturated / allowed, 1 / exponent);  // infinite for an exponent of 0
  return std::min(excess, max_highlight_fraction);
}

/// Returns the means of green over blocks without a NaN pixel.
std::vector<float> green_means(const FrameElectrons& frame) {
  std::vector<float> out;
  const int width = frame.signal_e.width(), height = frame.signal_e.height();
  for (int y0 = 0; y0 < height; y0 += block) {
    for (int x0 = 0; x0 < width; x0 += block) {
      double sum = 0, count = 0;
      for (int y = y0; y < std::min(y0 + block, height); ++y) {
        for (int x = x0; x < std::min(x0 + block, width); ++x) {
          const auto value = static_cast<double>(frame.signal_e.at(x, y));
          if (colour_at(frame.phase, x, y) != CfaColour::green || std::isnan(value)) continue;
          sum += value;
          count += 1;
        }
      }
      if (count > 0) out.push_back(static_cast<float>(sum / count));
    }
  }
  return out;
}

}  // namespace

Result<BracketScene> measure_bracket_scene(const RawFrame& frame, const DevelopOptions& options,
                                           double clipped_fraction, Executor& executor) {
  const std::optional<double> exposure_s = frame.raw.info.exposure_s;
  if (!exposure_s || !(*exposure_s > 0)) {
    return fail(ErrorCode::insufficient, "the file does not state its exposure time, which a bracket needs");
  }
  const Result<FrameElectrons> electrons = frame_electrons(frame, options, executor);
  if (!electrons) return tl::make_unexpected(electrons.error());
  const Charges charges = charges_of(*electrons);
  std::vector<float> fractions = charge_fractions(*electrons, charges), means = green_means(*electrons);
  if (means.empty()) return fail(ErrorCode::insufficient, "the file has no green pixels to measure");
  BracketScene out;
  out.exposure_s = *exposure_s;
  out.dark_charge_e = charges.dark_e[1];
  out.noise_variance_e2 = std::max(green_variance(*electrons) - charges.dark_e[1], 0.0);
  out.saturation_e = charges.limit_e[1];
  out.saturated_fraction = fraction_from(fractions, 1);
  out.highlight_fraction = highlight_fraction(fractions, out.saturated_fraction, clipped_fraction);
  out.darkest_e = exceeded_by(means, 1 - darkest_fraction);
  const double error_e = std::sqrt((std::max(out.darkest_e, 0.0) + green_variance(*electrons)) / (block * block / 2.0));
  out.darkest_is_black = out.darkest_e < min_deviations * error_e;
  if (out.darkest_is_black) out.darkest_e = min_deviations * error_e;
  return out;
}

}  // namespace lowlux::isp
