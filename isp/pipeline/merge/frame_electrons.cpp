#include "isp/pipeline/merge/frame_electrons.h"

#include <algorithm>
#include <limits>
#include <utility>

#include "denoise/lines/line_noise.h"
#include "isp/pipeline/plan/plan_develop.h"
#include "isp/pipeline/plan/plan_noise.h"
#include "isp/pipeline/render/electron_mosaic.h"
#include "isp/pipeline/render/pixel_cells.h"
#include "isp/raw/black_point.h"
#include "isp/raw/corrections.h"
#include "isp/raw/to_linear.h"

namespace lowlux::isp {
namespace {

void describe_noise(const RawFrame& frame, const DevelopPlan& plan, FrameElectrons& out) {
  const denoise::RawNoise& noise = plan.noise_reduction.noise;
  out.light_at_white_e = light_at_white_e(plan.levels);
  out.saturation_e.fill(std::numeric_limits<double>::infinity());
  for (int site = 0; site < 4; ++site) {
    const auto colour = static_cast<std::size_t>(colour_at(out.phase, site & 1, site >> 1));
    // The plan states the noise of a monochrome pixel as that of a site of its cell.
    const double part = is_mosaic(frame.raw) ? 1 : parts_of(frame.raw)[colour];
    const double electrons = (*plan.levels.electrons_at_white)[site];
    if (plan.levels.dark_frame) {
      const double e_per_dn = electrons / (white_at(frame.raw, site) - plan.levels.black.pedestal_dn[site]);
      out.common_variance_e2[site] = plan.levels.dark_frame->added_variance_dn2[site] * e_per_dn * e_per_dn;
    }
    out.dark_charge_e[site] = noise.dark_mean_e[site] / part;
    const double variance_e2 = noise.variance_e2[colour] / part + out.dark_charge_e[site];
    out.variance_e2[site] = std::max(variance_e2 - out.common_variance_e2[site], 0.0);
    out.saturation_e[colour] =
        std::min(out.saturation_e[colour], noise.saturation_e[colour] / part - plan.levels.black.dark_mean_e[site]);
  }
}

}  // namespace

ColourLevels colour_levels(const FrameElectrons& frame) {
  ColourLevels out;
  for (int site = 0; site < 4; ++site) {
    const auto colour = static_cast<std::size_t>(colour_at(frame.phase, site & 1, site >> 1));
    const double share = colour == 1 ? 0.5 : 1;
    out.white_e[colour] += share * frame.light_at_white_e[site];
    out.variance_e2[colour] += share * (frame.variance_e2[site] + frame.common_variance_e2[site]);
  }
  out.white_e[3] = out.white_e[2];
  return out;
}

DevelopOptions options_of_signal(const DevelopOptions& options, denoise::Level level) {
  DevelopOptions out{.exposure_ev = 0,
                     .tone = ToneCurve::none,
                     .space = OutputSpace::camera,
                     .samples = SampleType::f32,
                     .demosaic = options.demosaic,
                     .black = options.black,
                     .estimate_dark = options.estimate_dark,
                     .series_dark_e = options.series_dark_e,
                     .find_saturation = options.find_saturation,
                     .series_saturation = options.series_saturation,
                     .find_defects = options.find_defects,
                     .dark_frame = options.dark_frame,
                     .denoise = options.denoise};
  out.denoise.mode = DenoiseChoice::Mode::level;
  out.denoise.level = level;
  out.denoise.maps = false;
  return out;
}

Plane<float> shading_gain(const RawCorrections& corrections, int width, int height, Executor& executor) {
  if (corrections.gain_maps.empty() && corrections.radial_gains.empty()) return {};
  Plane<float> out(width, height);
  std::fill_n(out.data(), out.size(), 1.0F);
  apply_gains(corrections, out.view(), executor);
  return out;
}

Result<FrameElectrons> frame_electrons(const RawFrame& frame, const DevelopOptions& options, Executor& executor,
                                       bool with_gain) {
  if (frame.raw.layout == SensorLayout::linear_rgb) {
    return fail(ErrorCode::unsupported,
                frame.raw.from_x_trans
                    ? "X-Trans is not merged: frames are aligned and averaged by the 2 x 2 sites of a Bayer mosaic"
                    : "the frame is already demosaiced: frames are aligned and averaged by the sites of their mosaic");
  }
  RawElectrons charge;
  Result<DevelopPlan> plan = plan_develop(frame, options_of_signal(options, denoise::Level::draft), executor, &charge);
  if (!plan) return tl::make_unexpected(std::move(plan.error()));
  FrameElectrons out{.phase = frame.raw.phase,
                     .dark_is_estimated = plan->dark.state == DarkCharge::State::estimated,
                     .warnings = std::move(plan->warnings)};
  describe_noise(frame, *plan, out);
  out.saturation = plan->levels.saturation;
  const std::vector<Pixel> defects = std::exchange(plan->levels.defects, {});
  if (charge.value.empty()) charge = raw_electrons(frame, plan->levels, executor);
  out.signal_e = subtract_dark(std::move(charge), plan->levels.black, executor).value;
  if (with_gain) {
    out.gain = shading_gain(frame.corrections, out.signal_e.width(), out.signal_e.height(), executor);
  }
  for (const Pixel& defect : defects) out.signal_e.at(defect.x, defect.y) = std::numeric_limits<float>::quiet_NaN();
  return out;
}

}  // namespace lowlux::isp
