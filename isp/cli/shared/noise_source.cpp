#include "isp/cli/shared/noise_source.h"

#include <cmath>
#include <utility>

#include <fmt/format.h>

#include "calib/picture/picture_noise.h"
#include "isp/raw/black_point.h"
#include "isp/raw/subtract_dark_frame.h"
#include "isp/raw/to_linear.h"

namespace lowlux::cli {
namespace {

NoiseProfile profile_of(const calib::PictureNoise& noise, const RawDn& raw, const BlackPoint& black) {
  NoiseProfile out;
  out.source = NoiseProfile::Source::picture;
  for (int site = 0; site < 4; ++site) {
    const auto colour = static_cast<int>(colour_at(raw.phase, site & 1, site >> 1));
    const double range_dn = isp::white_at(raw, site) - black.pedestal_dn[site];
    out.scale[colour] = noise.gain_dn_per_e.value / range_dn;
    out.offset[colour] = noise.offset_dn2.value / (range_dn * range_dn);
  }
  return out;
}

std::string found_text(const calib::PictureNoise& noise) {
  const double gain = noise.gain_dn_per_e.value;
  std::string text = fmt::format(
      "neither a profile nor the file states usable noise: measured on the picture itself, {:.3g} DN/e-, "
      "{:.2g} e- without light",
      gain, std::sqrt(std::max(noise.offset_dn2.value, 0.0)) / gain);
  for (const std::string& doubt : noise.reasons) text += "; " + doubt;
  return text;
}

}  // namespace

Result<void> find_noise(const isp::DevelopOptions& options, RawFrame& frame, Executor& executor) {
  using Mode = isp::DenoiseChoice::Mode;
  if (options.denoise.mode == Mode::off || frame.raw.layout != SensorLayout::bayer) return {};
  if (frame.noise && isp::electrons_at_white(frame.raw, *frame.noise)) return {};
  const auto black =
      options.dark_frame ? isp::black_of(frame.raw, *options.dark_frame) : isp::choose_black(frame.raw, options.black);
  if (!black) return tl::make_unexpected(black.error());
  const auto noise = calib::fit_picture_noise(frame.raw, black->pedestal_dn, {}, executor);
  if (noise) {
    frame.noise = profile_of(*noise, frame.raw, *black);
    frame.warnings.push_back(found_text(*noise));
    return {};
  }
  const std::string why =
      "neither a profile nor the file states usable noise, and it cannot be estimated from this picture: " +
      noise.error().message;
  if (options.denoise.mode == Mode::level || options.denoise.always) {
    return fail(noise.error().code, why + "; give a profile (--profile)");
  }
  frame.warnings.push_back(why + "; it is left as it is");
  return {};
}

}  // namespace lowlux::cli
