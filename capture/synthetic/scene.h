#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "isp/base/image.h"
#include "isp/base/plane.h"
#include "isp/base/result.h"
#include "isp/base/spectrum.h"
#include "isp/model/spectrum/spectral_data.h"

namespace lowlux::capture {

/// A light without extent: a star, a distant lamp. The lens spreads it over a Gaussian.
struct PointSource {
  double x_px = 0;  // in the picture; whole numbers are centres of pixels
  double y_px = 0;
  int light = 0;               // index in Scene::point_lights
  double luminance_cd_m2 = 0;  // of a pixel it would fill evenly: the light of one pixel's area
  double spread_px = 0.7;      // standard deviation
};

/// What is in front of the camera: one radiance for each pixel, as a colour or as a spectrum.
struct Scene {
  SceneLinear xyz_cd_m2;            // CIE 1931 XYZ of each pixel, without the point sources
  Plane<std::uint16_t> patch;       // index of each pixel's radiance; empty: spectra are lifted from the colours
  std::vector<Spectrum> radiances;  // of patches [W m-2 sr-1 nm-1]
  std::vector<PointSource> points;
  std::vector<Spectrum> point_lights;  // radiance at 1 cd/m2
  Spectrum white;                      // radiance of a white diffuser in the scene: what the camera balances to
  std::string description;
};

/// Size and light of a scene that is made, not read.
struct SceneSetup {
  int width = 1200;
  int height = 800;
  Spectrum light;  // relative power
  std::string light_name;
  double luminance_cd_m2 = 1;  // of a perfect white diffuser under it
};

/// Errors of all: a size below 1 or above 2^28 pixels, a light without luminance or with negative power, a luminance
/// that is negative, not finite or above 1e12 cd/m2.

/// Nothing, for dark frames.
Result<Scene> dark_scene(const SceneSetup& setup);

/// A perfect white diffuser under the light, for flat fields.
Result<Scene> flat_scene(const SceneSetup& setup);

/// Reflectances under the light as a chart of patches, as square as their number allows, parted by a black frame.
/// Errors: none or more than 4096, a reflectance below 0, a patch above 1e12 cd/m2.
Result<Scene> chart_scene(const SceneSetup& setup, const std::vector<isp::NamedSpectrum>& reflectances);

/// A picture whose Y = 1 is given a luminance. Its spectra are lifted from its colours
/// (isp/model/spectrum/spectral_lift.h).
Result<Scene> picture_scene(SceneLinear xyz, double luminance_cd_m2);

/// Adds a distant lamp. Errors: a light without luminance.
Result<void> add_lamp(Scene& scene, double x_px, double y_px, const Spectrum& light, double luminance_cd_m2);

/// Adds stars: evenly spread places, fluxes falling as their power -1.5 above the faintest, lights between A and D75.
/// @param faintest luminance of the faintest star's light spread over one pixel [cd/m2]
Result<void> add_stars(Scene& scene, int count, double faintest_cd_m2, std::uint64_t seed);

}  // namespace lowlux::capture
