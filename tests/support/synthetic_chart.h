#pragma once

#include <array>
#include <string>
#include <vector>

#include "isp/base/frame.h"
#include "isp/base/matrix3.h"
#include "isp/base/result.h"
#include "isp/model/colour/colorimetry.h"

namespace lowlux::test {

/// States what is photographed with what. Names are those of isp::camera_names and isp::light_named.
struct ChartSetup {
  std::string camera = "Nikon_D5100";
  std::string light = "D65";
  std::vector<std::string> calibration_lights = {"D65"};  // by ascending temperature, one or two
  bool with_forward_matrix = false;
};

/// Holds a noise-free photograph of a ColorChecker, as colours: what the scene is, what the camera measures, and what a
/// raw file would state of the camera's colour.
struct SyntheticChart {
  static constexpr int patches = 24;
  std::array<isp::Xyz, patches> scene_xyz;  // under the light, Y = 1 for a perfect diffuser
  std::array<Vector3, patches> camera_rgb;  // largest channel of a perfect diffuser 1
  isp::Xyz scene_white;                     // of a perfect diffuser, Y = 1
  CameraColour colour;                      // as_shot_neutral is the camera RGB of a perfect diffuser
};

/// Photographs the 24 patches from Ohta's reflectances. Camera RGB and XYZ are integrals over the light's nodes.
/// ColorMatrix (and ForwardMatrix) come from least squares on isp::training_reflectances(), which contain no patch of a
/// chart.
Result<SyntheticChart> photograph_chart(const ChartSetup& setup);

/// Photographs each training reflectance under the setup's light: for scenes that are not the chart.
Result<std::vector<Vector3>> photograph_training_set(const ChartSetup& setup);

/// Returns all available still cameras. (The thesis' video camera is a rough instrument: its fitted curves have flat
/// floors.)
std::vector<std::string> chart_cameras();

}  // namespace lowlux::test
