#include "isp/pipeline/plan/pixel_noise.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "denoise/check/noise_check.h"
#include "isp/base/cfa.h"
#include "isp/base/noise_ratio.h"
#include "isp/pipeline/budget/frame_sample.h"
#include "isp/pipeline/render/pixel_cells.h"
#include "isp/raw/to_linear.h"

namespace lowlux::isp {
namespace {

constexpr int max_sample_px = 2048;

/// Returns the black level of a colour [DN]; that of a monochrome frame is the mean over its sites.
double black_dn_of(const RawFrame& frame, const RawLevels& levels, std::size_t colour) {
  const PerSite<double>& black = levels.black.pedestal_dn;
  return planes_of(frame.raw) == 3 ? black[colour] : mean_of_sites(black);
}

/// Returns the gains that make a neutral equal in all sites.
std::array<double, 3> balance_of(const RawFrame& frame, const CellNoise& cell, const NoiseRequest& request) {
  if (planes_of(frame.raw) == 1) return {1, 1, 1};
  std::array<double, 3> gain{};
  const bool by_camera = request.space == OutputSpace::camera && frame.colour.as_shot_neutral;
  for (std::size_t c = 0; c < 3; ++c) {
    gain[c] = (by_camera ? 1 / (*frame.colour.as_shot_neutral)[c] : static_cast<double>(request.white_gain[c])) /
              cell.cell_e[c];
  }
  const double green = gain[1];
  for (double& g : gain) g = std::clamp(g / green, 1e-3, 1e3);
  return gain;
}

/// Returns the parts of the frame that its noise is checked on.
std::vector<Rect> checked_parts(const RawFrame& frame, const RawLevels& levels) {
  std::vector<Rect> squares = sample_squares(frame, levels);
  if (!squares.empty()) return squares;
  const Rect& active = frame.raw.active;
  const int width = std::min(active.width, max_sample_px), height = std::min(active.height, max_sample_px);
  return {{(active.width - width) / 2 & ~1, (active.height - height) / 2 & ~1, width, height}};
}

/// Compares the noise with its model. Also monochrome pixels are checked as if they had three colours: each colour has
/// the noise of its model then, whether or not it differs from the others.
denoise::NoiseCheck check_pixels(const RawFrame& frame, const RawLevels& levels, const CellNoise& cell,
                                 Executor& executor) {
  const std::vector<Rect> parts = checked_parts(frame, levels);
  const int width = parts[0].width, height = parts[0].height, count = static_cast<int>(parts.size());
  Plane<float> cells(2 * width, 2 * height * count);
  std::array<Plane<float>, 3> planes;
  const auto used = static_cast<std::size_t>(planes_of(frame.raw));
  for (std::size_t c = 0; c < used; ++c) planes[c] = Plane<float>(width, height);
  const NoiseRatioView of_frame = view_of(frame.noise_ratio.get());
  for (int i = 0; i < count; ++i) {
    const std::array<PlaneView<float>, 3> views{planes[0].view(), planes[1].view(), planes[2].view()};
    const std::array<PlaneView<const float>, 3> pixels{views[0], views[1], views[2]};
    const Rect& part = parts[static_cast<std::size_t>(i)];
    read_pixels(frame, levels, part, std::span(views).first(used), executor);
    make_cells(std::span(pixels).first(used),
               {cell.cell_e, cell.noise.variance_e2[1], of_frame.from(part.x, part.y), 0, height * i},
               cells.view().crop(0, 2 * height * i, 2 * width, 2 * height), executor);
  }
  NoiseRatio of_sample;
  NoiseRatioView ratio = of_frame;
  if (frame.noise_ratio && count > 1) {
    of_sample = sample_ratio(ratio, parts);
    ratio = view_of(&of_sample);
  } else {
    ratio = ratio.from(parts[0].x, parts[0].y);
  }
  ratio = {ratio.ratio, 2 * ratio.block_px, 2 * ratio.x_px, 2 * ratio.y_px};
  return denoise::check_noise({std::as_const(cells).view(), BayerPhase::rggb, ratio}, cell.noise, executor);
}

}  // namespace

std::optional<CellNoise> cell_noise(const RawFrame& frame, const RawLevels& levels, const std::array<double, 3>& part) {
  CellNoise out;
  const bool coloured = planes_of(frame.raw) == 3;
  for (std::size_t c = 0; c < 3; ++c) {
    const std::size_t plane = coloured ? c : 0;
    const double electrons = 1 / frame.noise->scale[plane];
    if (!(electrons >= 1 && electrons <= max_electrons_at_white)) return std::nullopt;
    const double e_per_dn = electrons / (frame.raw.white_dn[plane] - black_dn_of(frame, levels, plane));
    const int channel = static_cast<int>(plane);
    const double variance_e2 = black_variance_e2(frame, levels, channel, channel, electrons, e_per_dn);
    out.cell_e[c] = part[c] * electrons;
    out.noise.variance_e2[c] = std::min(part[c] * variance_e2, denoise::largest_e);
    out.noise.saturation_e[c] = saturated_fraction_of_white * out.cell_e[c];
  }
  return out;
}

double checked_fraction(const RawFrame& frame, const RawLevels& levels) {
  const Rect& active = frame.raw.active;
  double pixels = 0;
  for (const Rect& part : checked_parts(frame, levels)) pixels += static_cast<double>(part.width) * part.height;
  return pixels / (static_cast<double>(active.width) * active.height);
}

Result<NoiseReduction> plan_pixel_noise(const RawFrame& frame, const Thumbnail& thumbnail, const RawLevels& levels,
                                        const NoiseRequest& request, Executor& executor) {
  const std::optional<CellNoise> whole = cell_noise(frame, levels, {1, 1, 1});
  if (!whole) return fail(ErrorCode::insufficient, "the noise of a colour is unknown: its NoiseProfile is not usable");
  const CellNoise checked = *cell_noise(frame, levels, parts_of_colours);
  const CellNoise cell = *cell_noise(frame, levels, parts_of(frame.raw));
  NoiseReduction out;
  out.source = frame.noise->source;
  out.noise = cell.noise;
  out.cell_e = cell.cell_e;
  out.site_part = parts_of(frame.raw);
  out.noise_ratio = frame.noise_ratio;
  out.options.white_gain = balance_of(frame, cell, request);
  std::vector<double> memory;
  out.snr = middle_snr(frame, thumbnail, whole->cell_e, whole->noise, memory);
  choose_level(request, out);
  if (!out.level) return out;
  out.options.level = *out.level;
  if (request.choice.unbiased_chroma) {
    out.options.rho = std::numeric_limits<double>::infinity();
    out.options.keep_means = true;
  }
  const denoise::NoiseCheck check = check_pixels(frame, levels, checked, executor);
  out.options.variance_scale = denoise::variance_scale_of(check);
  NoiseProfile model = *frame.noise;
  // Interpolated and drizzled samples have less noise on fine scales than NoiseProfile states for larger areas.
  model.reduced = model.reduced || frame.raw.layout == SensorLayout::linear_rgb;
  add_remarks(check, model, out.warnings);
  return out;
}

}  // namespace lowlux::isp
