#include "capture/synthetic/scene.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>

#include "isp/base/random/random.h"
#include "isp/base/text.h"
#include "isp/model/spectrum/cie_data.h"
#include "isp/model/spectrum/spectral_lift.h"
#include "isp/model/spectrum/spectral_response.h"

namespace lowlux::capture {
namespace {

constexpr double brightest_cd_m2 = 1e12;
constexpr double gap = 0.08;  // fraction of a patch's pitch: the frame around it

tl::unexpected<Error> wrong(const std::string& what, const std::string& where = {}) {
  return fail(ErrorCode::invalid_argument, what, where);
}

Result<void> check_luminance(double luminance_cd_m2, const char* of_what = "a scene") {
  if (luminance_cd_m2 >= 0 && luminance_cd_m2 <= brightest_cd_m2) return {};
  return wrong(std::string("the luminance of ") + of_what + " must lie between 0 and 1e12 cd/m2, found " +
               number_text(luminance_cd_m2));
}

/// Returns a scene of one size without light, and the radiance of its white.
Result<Scene> empty_scene(const SceneSetup& setup) {
  if (setup.width < 1 || setup.height < 1 || static_cast<double>(setup.width) * setup.height > max_scene_pixels) {
    return wrong("a scene has 1 to 2^28 pixels, found " + std::to_string(setup.width) + " x " +
                 std::to_string(setup.height));
  }
  if (const auto good = check_luminance(setup.luminance_cd_m2); !good) return tl::make_unexpected(good.error());
  if (*std::min_element(setup.light.values().begin(), setup.light.values().end()) < 0) {
    return wrong("the power of a light must not be negative", setup.light_name);
  }
  auto white = isp::radiance_of(setup.light, setup.luminance_cd_m2);
  if (!white)
    return wrong("a light needs power between 380 and 780 nm that adds up to a finite number", setup.light_name);
  Scene scene{.xyz_cd_m2 = SceneLinear(setup.width, setup.height), .white = *std::move(white)};
  for (Plane<float>& plane : scene.xyz_cd_m2.plane) std::fill_n(plane.data(), plane.size(), 0.0f);
  return scene;
}

void fill(Scene& scene, int x0, int y0, int x1, int y1, int radiance) {
  const isp::Xyz xyz = isp::xyz_cd_m2(scene.radiances[radiance]);
  const float colour[3] = {static_cast<float>(xyz.x), static_cast<float>(xyz.y), static_cast<float>(xyz.z)};
  for (int y = y0; y < y1; ++y) {
    std::fill(scene.patch.row(y) + x0, scene.patch.row(y) + x1, static_cast<std::uint16_t>(radiance));
    for (int c = 0; c < 3; ++c) {
      float* row = scene.xyz_cd_m2.plane[c].row(y);
      std::fill(row + x0, row + x1, colour[c]);
    }
  }
}

/// Returns the radiance of a patch of a reflectance. Errors: it is brighter than a scene may be.
Result<Spectrum> patch_radiance(const Spectrum& white, const isp::NamedSpectrum& patch) {
  bool finite = true;
  Spectrum radiance = white.mapped([&](double nm, double power) {
    const double value = power * patch.spectrum.at(nm);
    finite = finite && std::isfinite(value);
    return finite ? value : 0;
  });
  if (!finite || !(isp::xyz_cd_m2(radiance).y <= brightest_cd_m2)) {
    return wrong("a patch is brighter than 1e12 cd/m2: reflectances are ratios, 1 is white", std::string(patch.name));
  }
  return radiance;
}

double unit_of(std::uint32_t word) { return (word + 0.5) * 0x1p-32; }

}  // namespace

Result<Scene> dark_scene(const SceneSetup& setup) {
  auto scene = empty_scene(setup);
  if (!scene) return scene;
  scene->patch = Plane<std::uint16_t>(setup.width, setup.height);
  scene->radiances.push_back(scene->white.mapped([](double, double) { return 0.0; }));
  fill(*scene, 0, 0, setup.width, setup.height, 0);
  scene->description = "dark";
  return scene;
}

Result<Scene> flat_scene(const SceneSetup& setup) {
  auto scene = empty_scene(setup);
  if (!scene) return scene;
  scene->patch = Plane<std::uint16_t>(setup.width, setup.height);
  scene->radiances.push_back(scene->white);
  fill(*scene, 0, 0, setup.width, setup.height, 0);
  scene->description = "a white diffuser under " + setup.light_name;
  return scene;
}

Result<Scene> chart_scene(const SceneSetup& setup, const std::vector<isp::NamedSpectrum>& reflectances) {
  const int count = static_cast<int>(reflectances.size());
  if (count < 1 || count > 4096) return wrong("a chart has 1 to 4096 patches, found " + std::to_string(count));
  for (const isp::NamedSpectrum& patch : reflectances) {
    for (const double value : patch.spectrum.values()) {
      if (value < 0)
        return wrong("a reflectance is never negative, found " + number_text(value), std::string(patch.name));
    }
  }
  auto scene = empty_scene(setup);
  if (!scene) return scene;
  scene->patch = Plane<std::uint16_t>(setup.width, setup.height);
  for (const isp::NamedSpectrum& patch : reflectances) {
    auto radiance = patch_radiance(scene->white, patch);
    if (!radiance) return tl::make_unexpected(radiance.error());
    scene->radiances.push_back(*std::move(radiance));
  }
  scene->radiances.push_back(scene->white.mapped([](double, double) { return 0.0; }));
  fill(*scene, 0, 0, setup.width, setup.height, count);
  int columns = 1;
  while (columns * ((static_cast<long>(columns) * setup.height + setup.width - 1) / setup.width) < count) ++columns;
  const int rows = (count + columns - 1) / columns;
  const auto edge = [](int index, int of, int size, double inset) {
    return std::clamp(static_cast<int>(std::lround((index + inset) * size / of)), 0, size);
  };
  for (int i = 0; i < count; ++i) {
    const int column = i % columns, row = i / columns;
    fill(*scene, edge(column, columns, setup.width, gap), edge(row, rows, setup.height, gap),
         edge(column, columns, setup.width, 1 - gap), edge(row, rows, setup.height, 1 - gap), i);
  }
  scene->description = std::to_string(count) + " patches under " + setup.light_name;
  return scene;
}

Result<Scene> picture_scene(SceneLinear xyz, double luminance_cd_m2) {
  if (xyz.width() < 1 || xyz.height() < 1) return wrong("a scene has at least one pixel");
  if (const auto good = check_luminance(luminance_cd_m2); !good) return tl::make_unexpected(good.error());
  const auto factor = static_cast<float>(luminance_cd_m2);
  for (Plane<float>& plane : xyz.plane) {
    for (std::size_t i = 0; i < plane.size(); ++i) {
      float& value = plane.data()[i];
      value *= factor;
      if (!(value >= 0) || !(value <= brightest_cd_m2)) {
        const auto at = static_cast<int>(i);
        return wrong("pixel (" + std::to_string(at % xyz.width()) + ", " + std::to_string(at / xyz.width()) +
                     ") is negative, not a number or brighter than 1e12 cd/m2");
      }
    }
  }
  const isp::Xyz d65 = *isp::xyz_of(isp::white_d65, luminance_cd_m2 > 0 ? luminance_cd_m2 : 1);
  return Scene{.xyz_cd_m2 = std::move(xyz), .white = *isp::lift(d65), .description = "a picture"};
}

Result<void> add_lamp(Scene& scene, double x_px, double y_px, const Spectrum& light, double luminance_cd_m2) {
  if (auto good = check_luminance(luminance_cd_m2, "a lamp"); !good) return good;
  auto unit = isp::radiance_of(light, 1);
  if (!unit) return wrong("the lamp's light has no luminance");
  scene.points.push_back({.x_px = x_px,
                          .y_px = y_px,
                          .light = static_cast<int>(scene.point_lights.size()),
                          .luminance_cd_m2 = luminance_cd_m2});
  scene.point_lights.push_back(*std::move(unit));
  return {};
}

std::vector<PointSource> stars_of_cell(const StarField& field, int column, int row) {
  constexpr double brightest = 1e6;  // in units of the faintest
  const DrawStream stream{field.seed, static_cast<std::uint32_t>(column), draw_purpose::scene};
  std::vector<PointSource> stars;
  stars.reserve(static_cast<std::size_t>(field.count));
  for (int i = 0; i < field.count; ++i) {
    const PhiloxWords w = words_at(stream, static_cast<std::uint32_t>(i), static_cast<std::uint32_t>(row));
    const double flux = field.faintest_cd_m2 * std::min(brightest, std::pow(unit_of(w[2]), -2.0 / 3));
    const double x = unit_of(w[0]) * field.width_px - 0.5, y = unit_of(w[1]) * field.height_px - 0.5;
    stars.push_back({.x_px = x + static_cast<double>(column) * field.width_px,
                     .y_px = y + static_cast<double>(row) * field.height_px,
                     .light = field.first_light + static_cast<int>(w[3] >> 30),
                     .luminance_cd_m2 = flux,
                     .is_star = true});
  }
  return stars;
}

Result<void> add_stars(Scene& scene, int count, double faintest_cd_m2, std::uint64_t seed, int reduction) {
  if (count < 0 || count > 1000000) return wrong("there are 0 to 1000000 stars, found " + std::to_string(count));
  if (auto good = check_luminance(faintest_cd_m2, "the faintest star"); !good) return good;
  const StarField field{count,
                        faintest_cd_m2,
                        seed,
                        scene.xyz_cd_m2.width() / reduction,
                        scene.xyz_cd_m2.height() / reduction,
                        static_cast<int>(scene.point_lights.size())};
  for (const char* light : {"A", "D50", "D65", "D75"}) {
    scene.point_lights.push_back(*isp::radiance_of(*isp::light_named(light), 1));
  }
  const std::vector<PointSource> stars = stars_of_cell(field, 0, 0);
  scene.points.insert(scene.points.end(), stars.begin(), stars.end());
  if (count > 0) scene.star_fields.push_back(field);
  return {};
}

Result<void> check_points(const Scene& scene) {
  for (const PointSource& p : scene.points) {
    const bool near = std::fabs(p.x_px) <= 1e6 && std::fabs(p.y_px) <= 1e6;
    const bool lit = p.light >= 0 && p.light < static_cast<int>(scene.point_lights.size()) && p.luminance_cd_m2 >= 0;
    if (!near || !lit || !(p.spread_px > 0) || !(p.spread_px <= 1000)) {
      return wrong("a point source lies within a million pixels and spreads over more than 0 and at most 1000");
    }
  }
  return {};
}

}  // namespace lowlux::capture
