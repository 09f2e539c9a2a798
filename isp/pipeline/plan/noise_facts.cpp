#include "isp/pipeline/plan/noise_facts.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>

#include <fmt/format.h>

#include "isp/base/cfa.h"
#include "isp/pipeline/plan/local_noise.h"
#include "isp/pipeline/render/cell_figures.h"

namespace lowlux::isp {

double middle_snr(const RawFrame& frame, const Thumbnail& thumbnail, const std::array<double, 3>& electrons,
                  const denoise::RawNoise& noise, std::vector<double>& snr) {
  const double dark = mean_of_sites(noise.dark_mean_e), variance = mean_of_colours(noise.variance_e2);
  snr.resize(thumbnail.mean.plane[0].size());
  for (std::size_t i = 0; i < snr.size(); ++i) {
    double charge = 0;
    for (int c = 0; c < 3; ++c) charge += fraction_of_sites[c] * electrons[c] * thumbnail.mean.plane[c].data()[i];
    const int column = static_cast<int>(i) % thumbnail.mean.width(), row = static_cast<int>(i) / thumbnail.mean.width();
    const double ratio = ratio_of_block(frame, thumbnail, column, row);
    snr[i] = std::max(charge - dark, 0.0) / std::sqrt(ratio * (std::max(charge, 0.0) + variance));
  }
  const auto middle = snr.begin() + static_cast<std::ptrdiff_t>(snr.size() / 2);
  std::nth_element(snr.begin(), middle, snr.end());
  return *middle;
}

std::optional<denoise::Level> level_by_ratio(const DenoiseChoice& choice, double snr) {
  if (choice.mode == DenoiseChoice::Mode::level) return choice.level;
  const std::optional<denoise::Level> level = level_for(snr);
  return !level && choice.always ? denoise::Level::draft : level;
}

void choose_level(const NoiseRequest& request, NoiseReduction& out) {
  const DenoiseChoice& choice = request.choice;
  if (choice.mode != DenoiseChoice::Mode::level && request.level) {
    out.level = request.level->level;
    out.regions = request.level->regions;
    out.reason = fmt::format("chosen by its visible effect, at a signal-to-noise ratio of {:.3g}", *out.snr);
    return;
  }
  out.level = level_by_ratio(choice, *out.snr);
  out.reason = choice.mode == DenoiseChoice::Mode::level
                   ? "given"
                   : fmt::format("signal-to-noise ratio {:.3g} of a pixel in the median block", *out.snr);
}

void add_remarks(const denoise::NoiseCheck& check, const NoiseProfile& model, std::vector<std::string>& warnings) {
  using denoise::NoiseFinding;
  const bool is_measured = model.source == NoiseProfile::Source::picture;
  for (denoise::NoiseRemark& remark : denoise::remarks_on(check)) {
    const bool is_below = remark.finding == NoiseFinding::noise_below_model;
    const bool is_above = remark.finding == NoiseFinding::noise_above_model;
    if ((is_measured && (is_below || is_above)) || (model.reduced && is_below)) continue;
    warnings.push_back(std::move(remark.text));
  }
}

}  // namespace lowlux::isp
