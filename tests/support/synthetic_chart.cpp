#include "tests/support/synthetic_chart.h"

#include <algorithm>
#include <string_view>
#include <utility>

#include "isp/base/spectrum.h"
#include "isp/model/colour/camera_matrix.h"
#include "isp/model/spectrum/cie_data.h"
#include "isp/model/spectrum/spectral_data.h"

namespace lowlux::test {
namespace {

/// Computes what a camera under a light measures of a reflectance; the largest channel of the perfect diffuser is 1.
class Photograph {
 public:
  static Result<Photograph> of(const std::string& camera, const std::string& light_name) {
    auto light = isp::light_named(light_name);
    if (!light) return fail(ErrorCode::not_found, "no such light", light_name);
    auto sensitivity = isp::camera_sensitivity(camera);
    if (!sensitivity) return fail(ErrorCode::not_found, "no such camera", camera);
    return Photograph(*std::move(light), *std::move(sensitivity));
  }

  Vector3 camera_rgb(const Spectrum& reflectance) const {
    return scale_ * isp::camera_response(sensitivity_, light_, reflectance);
  }
  Vector3 neutral() const { return scale_ * isp::camera_response(sensitivity_, light_); }
  isp::Xyz scene_xyz(const Spectrum& reflectance) const { return *isp::xyz_of_reflectance(reflectance, light_); }
  isp::Xyz scene_white() const {
    const isp::Xyz sum = isp::xyz_of(light_);
    return {sum.x / sum.y, 1, sum.z / sum.y};
  }

 private:
  Photograph(Spectrum light, std::array<Spectrum, 3> sensitivity)
      : light_(std::move(light)), sensitivity_(std::move(sensitivity)) {
    const Vector3 white = isp::camera_response(sensitivity_, light_);
    const double largest = *std::max_element(white.begin(), white.end());
    scale_ = diagonal3({1 / largest, 1 / largest, 1 / largest});
  }

  Spectrum light_;
  std::array<Spectrum, 3> sensitivity_;
  Matrix3 scale_ = identity3();
};

}  // namespace

Result<SyntheticChart> photograph_chart(const ChartSetup& setup) {
  const auto photograph = Photograph::of(setup.camera, setup.light);
  if (!photograph) return tl::make_unexpected(photograph.error());
  const auto reflectances = isp::spectra_of(isp::SpectrumSet::colorchecker);
  SyntheticChart chart;
  for (int i = 0; i < SyntheticChart::patches; ++i) {
    chart.scene_xyz[i] = photograph->scene_xyz(reflectances[i].spectrum);
    chart.camera_rgb[i] = photograph->camera_rgb(reflectances[i].spectrum);
  }
  chart.scene_white = photograph->scene_white();
  chart.colour.as_shot_neutral = photograph->neutral();
  chart.colour.source = CameraColour::Source::file_tags;
  for (const std::string& light : setup.calibration_lights) {
    const auto spectrum = isp::light_named(light);
    if (!spectrum) return fail(ErrorCode::not_found, "no such light", light);
    const auto calibration =
        isp::fit_calibration(*isp::camera_sensitivity(setup.camera), *spectrum,
                             setup.with_forward_matrix ? isp::ForwardMatrix::fit : isp::ForwardMatrix::leave_out);
    if (!calibration) return tl::make_unexpected(calibration.error());
    chart.colour.calibrations.push_back(*calibration);
  }
  return chart;
}

Result<std::vector<Vector3>> photograph_training_set(const ChartSetup& setup) {
  const auto photograph = Photograph::of(setup.camera, setup.light);
  if (!photograph) return tl::make_unexpected(photograph.error());
  std::vector<Vector3> rgb;
  for (const Spectrum& reflectance : isp::training_reflectances()) rgb.push_back(photograph->camera_rgb(reflectance));
  return rgb;
}

std::vector<std::string> chart_cameras() {
  std::vector<std::string> names;
  for (const std::string_view name : isp::camera_names()) {
    if (name != "Sony_DXC-930") names.emplace_back(name);
  }
  return names;
}

}  // namespace lowlux::test
