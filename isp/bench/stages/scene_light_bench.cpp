#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <memory>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "isp/base/look_grid.h"
#include "isp/bench/stages/developing_stages.h"
#include "isp/model/colour/camera_matrix.h"
#include "isp/model/spectrum/cie_data.h"
#include "isp/model/spectrum/spectral_data.h"
#include "isp/model/vision/mesopic.h"
#include "isp/model/vision/scene_light.h"
#include "isp/pipeline/plan/plan_look.h"
#include "isp/pipeline/plan/rendering.h"

namespace lowlux::isp {
namespace {

constexpr double missing = std::numeric_limits<double>::quiet_NaN();
constexpr const char* usual_name = "Nikon D5100";

/// Holds a patch under a light: white-balanced camera RGB, and the exact scotopic luminance over the photopic one of
/// white.
struct SeenPatch {
  Vector3 balanced;
  double scotopic = 0;
};

const std::array<Spectrum, 3>& sensitivity() {
  static const std::array<Spectrum, 3> camera = camera_sensitivity(known_camera(usual_name).value()).value();
  return camera;
}

std::vector<SeenPatch> patches_under(const Spectrum& light) {
  const Vector3 white = camera_response(sensitivity(), light);
  const double luminance = luminance_of(light).photopic;
  std::vector<SeenPatch> out;
  for (const NamedSpectrum& patch : spectra_of(SpectrumSet::colorchecker)) {
    const Vector3 rgb = camera_response(sensitivity(), light, patch.spectrum);
    out.push_back({{rgb[0] / white[0], rgb[1] / white[1], rgb[2] / white[2]},
                   luminance_of(reflected(light, patch.spectrum)).scotopic / luminance});
  }
  return out;
}

/// Returns a frame of the camera under a light, balanced for it, with matrices for A and D65.
RawFrame frame_under(const Spectrum& light, const char* model) {
  RawFrame frame;
  frame.raw.info.model = model;
  frame.raw.default_crop = frame.raw.active = {0, 0, 8, 8};
  for (const char* name : {"A", "D65"}) {
    frame.colour.calibrations.push_back(
        fit_calibration(sensitivity(), light_named(name).value(), ForwardMatrix::fit).value());
  }
  const Vector3 white = camera_response(sensitivity(), light);
  const double largest = *std::ranges::max_element(white);
  frame.colour.as_shot_neutral = Vector3{white[0] / largest, white[1] / largest, white[2] / largest};
  frame.colour.source = CameraColour::Source::file_tags;
  return frame;
}

/// Errors of the rods' luminance as the look of the eye computes it.
struct RodErrors {
  double ratio = missing;  // S/P of the white
  double rms = missing;    // relative, over the patches
};

Result<RodErrors> errors_of(const RawFrame& frame, const std::vector<SeenPatch>& patches,
                            std::shared_ptr<const SceneLight> light) {
  DevelopOptions options{.space = OutputSpace::linear_rec2020};
  options.look.look = Look::eye;
  options.look.scene_luminance_cd_m2 = 0.1;
  options.look.adaptation_degree = 1;
  options.look.light = std::move(light);
  const Result<WhiteBalance> balance = as_shot_white_balance(frame.colour);
  if (!balance) return tl::make_unexpected(balance.error());
  const Result<Matrix3> balanced = balanced_to_output(frame, options, *balance);
  if (!balanced) return tl::make_unexpected(balanced.error());
  constexpr std::array mid_grey{0.18f};
  const auto plan = plan_look(frame, {mid_grey, 0, balance->white, 0, *balanced}, options);
  if (!plan) return tl::make_unexpected(plan.error());
  const NightLook& look = (*plan)->look;
  const auto weighted = [](const std::array<float, 3>& weights, const Vector3& v) {
    return static_cast<double>(weights[0]) * v[0] + static_cast<double>(weights[1]) * v[1] +
           static_cast<double>(weights[2]) * v[2];
  };
  double sum = 0;
  for (const SeenPatch& patch : patches) {
    const Vector3 rgb = *balanced * patch.balanced;
    const double y = weighted(look.luminance, rgb);
    const double rods = std::max(weighted(look.rods, rgb), std::min(LookGrid::min_rods * y, y));
    sum += std::pow(look.scotopic_ratio_of_white * rods / patch.scotopic - 1, 2);
  }
  return RodErrors{look.scotopic_ratio_of_white, std::sqrt(sum / static_cast<double>(patches.size()))};
}

Result<std::vector<BenchCell>> row_of(std::string_view name) {
  auto light = light_of_lamp(name);
  if (!light) return tl::make_unexpected(light.error());
  const auto stated = std::make_shared<const SceneLight>(*std::move(light));
  const Spectrum& spectrum = stated->spectrum.value();
  const std::vector<SeenPatch> patches = patches_under(spectrum);
  const RawFrame unnamed = frame_under(spectrum, ""), named = frame_under(spectrum, usual_name);
  const auto before = errors_of(unnamed, patches, nullptr);
  if (!before) return tl::make_unexpected(before.error());
  const auto with_light = errors_of(unnamed, patches, stated);
  if (!with_light) return tl::make_unexpected(with_light.error());
  const auto with_camera = errors_of(named, patches, stated);
  if (!with_camera) return tl::make_unexpected(with_camera.error());
  const Xy white = stated->white.value();
  const double by_white = scotopic_luminance(xyz_of(white).value()) / stated->scotopic_ratio - 1;
  return std::vector<BenchCell>{std::string(name),
                                stated->scotopic_ratio,
                                before->ratio,
                                100 * by_white,
                                100 * (before->ratio / stated->scotopic_ratio - 1),
                                100 * before->rms,
                                100 * with_light->rms,
                                100 * with_camera->rms};
}

/// Draws the three rms errors of the table over the S/P of the lights.
Plot errors_over_ratio(const BenchTable& table) {
  Plot out{.id = "rods",
           .title = "Error of the rods' luminance",
           .x_label = "S/P of the light",
           .y_label = "rms error [%]",
           .caption = "Each point is a lamp."};
  constexpr std::array names{"light unknown", "--light", "--light and camera"};
  for (std::size_t i = 0; i < names.size(); ++i) {
    Series series{.name = names[i], .mark = Mark::points};
    for (const std::vector<BenchCell>& row : table.rows) {
      series.x.push_back(std::get<double>(row[1]));
      series.y.push_back(std::get<double>(row[5 + i]));
    }
    out.series.push_back(std::move(series));
  }
  return out;
}

}  // namespace

Result<BenchOutcome> run_scene_light_bench(const BenchOptions& options) {
  BenchOutcome out;
  out.table.columns = {"light",
                       "S/P",
                       "S/P from the camera's white",
                       "error of S/P from the exact xy [%]",
                       "error of S/P from the camera's white [%]",
                       "rms error, light unknown [%]",
                       "rms error, --light [%]",
                       "rms error, --light and camera [%]"};
  const std::vector<std::string_view> names = lamp_names();
  for (const std::string_view name : names) {
    auto row = row_of(name);
    if (!row) return fail(row.error().code, row.error().message, std::string(name));
    out.table.rows.push_back(*std::move(row));
    options.advance(1 / static_cast<double>(names.size()), std::string(name));
  }
  out.plots = {errors_over_ratio(out.table)};
  out.remarks.push_back(fmt::format(
      "scotopic luminance of the 24 patches of the ColorChecker, relative error; a {} whose matrices are "
      "those for A and D65, balanced for the light. Weights of the camera are fitted on Munsell chips and on an older "
      "chart of the same pigments",
      usual_name));
  return out;
}

}  // namespace lowlux::isp
