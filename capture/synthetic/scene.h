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

/// A light without extent: a star, a distant lamp. The lens spreads it to a Gaussian.
struct PointSource {
  double x_px = 0;  // in the image; integers are centres of pixels
  double y_px = 0;
  int light = 0;               // index in Scene::point_lights
  double luminance_cd_m2 = 0;  // luminance of a pixel that it fills uniformly: the light of one pixel's area
  double spread_px = 0.7;      // standard deviation
  bool is_star = false;        // moves with the sky, see BurstOptions
};

/// Stars that continue in all directions, in cells of the image's size. Cell (0, 0) is the image itself.
struct StarField {
  int count = 0;              // in each cell
  double faintest_cd_m2 = 0;  // see add_stars
  std::uint64_t seed = 0;
  int width_px = 0;  // width of a cell
  int height_px = 0;
  int first_light = 0;  // index in Scene::point_lights of the first of their four lights
};

/// Returns the stars of a cell: a pure function of the field and the cell.
std::vector<PointSource> stars_of_cell(const StarField& field, int column, int row);

/// A scene in front of the camera: one radiance for each pixel, as a colour or as a spectrum.
struct Scene {
  SceneLinear xyz_cd_m2;            // CIE 1931 XYZ of each pixel, without the point sources
  Plane<std::uint16_t> patch;       // index of each pixel's radiance; empty: spectra are lifted from colours
  std::vector<Spectrum> radiances;  // radiances of patches [W m-2 sr-1 nm-1]
  std::vector<PointSource> points;
  std::vector<Spectrum> point_lights;  // radiance at 1 cd/m2
  Spectrum white;                      // radiance of a white diffuser in the scene: the camera's white balance
  std::string description;
  std::vector<StarField> star_fields;  // cell (0, 0) of each is in `points`
};

/// Size and light of a generated scene.
struct SceneSetup {
  int width = 1200;
  int height = 800;
  Spectrum light;  // relative power
  std::string light_name;
  double luminance_cd_m2 = 1;  // luminance of a perfect white diffuser under it
};

/// Largest number of pixels of a scene.
inline constexpr double max_scene_pixels = 268435456;  // 2^28

/// The functions below fail for a size below 1 or above max_scene_pixels, a light without luminance or with negative
/// power, a luminance that is negative, not finite or above 1e12 cd/m2.

/// Returns a scene without light, for dark frames.
Result<Scene> dark_scene(const SceneSetup& setup);

/// Returns a perfect white diffuser under the light, for flat fields.
Result<Scene> flat_scene(const SceneSetup& setup);

/// Returns reflectances under the light as a chart of patches, as square as their number allows, separated by a black
/// frame.
/// Errors: none or more than 4096, a reflectance below 0, a patch above 1e12 cd/m2.
Result<Scene> chart_scene(const SceneSetup& setup, const std::vector<isp::NamedSpectrum>& reflectances);

/// Returns an image as a scene, with a given luminance of Y = 1. Its spectra are lifted from its colours
/// (isp/model/spectrum/spectral_lift.h).
Result<Scene> picture_scene(SceneLinear xyz, double luminance_cd_m2);

/// Adds a distant lamp. Errors: a light without luminance.
Result<void> add_lamp(Scene& scene, double x_px, double y_px, const Spectrum& light, double luminance_cd_m2);

/// Adds stars: uniformly distributed positions, fluxes distributed as their power -1.5 above the faintest, lights
/// between A and D75.
/// @param faintest_cd_m2 luminance of the faintest star's light spread over one pixel
/// @param reduction      samples of the scene for each pixel of the image and axis, see BurstOptions
Result<void> add_stars(Scene& scene, int count, double faintest_cd_m2, std::uint64_t seed, int reduction = 1);

/// Checks points that were not made by the functions above. Error: a point without a light, farther away than a million
/// pixels, or with a spread that is not above 0 or exceeds 1000 pixels.
Result<void> check_points(const Scene& scene);

}  // namespace lowlux::capture
