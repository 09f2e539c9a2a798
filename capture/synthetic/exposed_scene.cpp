#include "capture/synthetic/exposed_scene.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <numbers>
#include <span>
#include <vector>

#include "capture/synthetic/optics/lens_blur.h"
#include "isp/model/spectrum/cie_data.h"
#include "isp/model/spectrum/spectral_response.h"

namespace lowlux::capture {
namespace {

/// Returns whether a chromaticity is inside the triangle of the Rec.709 primaries: it can then always be lifted; others
/// need a closer test.
bool inside_rec709(float x, float y) {
  // Edges blue-red, red-green, green-blue of (0.15, 0.06), (0.64, 0.33), (0.30, 0.60).
  return 0.49f * (y - 0.06f) - 0.27f * (x - 0.15f) >= 0 && -0.34f * (y - 0.33f) - 0.27f * (x - 0.64f) >= 0 &&
         -0.15f * (y - 0.60f) + 0.54f * (x - 0.30f) >= 0;
}

struct LiftPlace {
  float sum, x, y;  // X + Y + Z and a liftable chromaticity
  bool moved;
};

LiftPlace place_of(float x, float y, float z) {
  const float sum = x + y + z;
  if (!(sum > 0)) return {0, 1 / 3.0f, 1 / 3.0f, false};
  const float cx = x / sum, cy = y / sum;
  if (inside_rec709(cx, cy)) return {sum, cx, cy, false};
  const isp::Xy near = isp::liftable({cx, cy});
  const bool moved = std::hypot(near.x - cx, near.y - cy) > 1e-6;
  return {sum, static_cast<float>(near.x), static_cast<float>(near.y), moved};
}

std::vector<Vector3> patch_rates(const Scene& scene, const SpectralResponse& response) {
  std::vector<Vector3> rates;
  rates.reserve(scene.radiances.size());
  for (const Spectrum& radiance : scene.radiances) rates.push_back(isp::electron_rate(response, radiance));
  return rates;
}

/// Returns the fraction of a Gaussian of standard deviation `spread` that falls on the pixel `offset` away from its
/// centre.
double share_of(double offset, double spread) {
  const double unit = spread * std::numbers::sqrt2;
  return 0.5 * (std::erf((offset + 0.5) / unit) - std::erf((offset - 0.5) / unit));
}

/// Calls add(x, y, fraction) for the pixels a point falls on.
template <class Add>
void spread_point(const PointSource& point, int width, int height, const Add& add) {
  const int reach = static_cast<int>(std::ceil(6 * point.spread_px)) + 1;
  const int cx = static_cast<int>(std::lround(point.x_px)), cy = static_cast<int>(std::lround(point.y_px));
  const int left = std::max(0, cx - reach), right = std::min(width - 1, cx + reach);
  std::vector<double> column_fraction;
  for (int x = left; x <= right; ++x) column_fraction.push_back(share_of(x - point.x_px, point.spread_px));
  for (int y = std::max(0, cy - reach); y <= std::min(height - 1, cy + reach); ++y) {
    const double row_fraction = share_of(y - point.y_px, point.spread_px);
    for (int x = left; x <= right; ++x) add(x, y, row_fraction * column_fraction[static_cast<std::size_t>(x - left)]);
  }
}

/// Returns the rates of each light at 1 cd/m2.
std::vector<Vector3> light_rates(std::span<const Spectrum> lights, const SpectralResponse& response) {
  std::vector<Vector3> rates;
  rates.reserve(lights.size());
  for (const Spectrum& light : lights) rates.push_back(isp::electron_rate(response, light));
  return rates;
}

/// Adds points to three planes, `colours` being the channels of each light at 1 cd/m2.
template <class Planes>
void add_to_planes(std::span<const PointSource> points, std::span<const Vector3> colours, Planes& out) {
  for (const PointSource& point : points) {
    const Vector3& colour = colours[static_cast<std::size_t>(point.light)];
    spread_point(point, out.width(), out.height(), [&](int x, int y, double share) {
      for (int k = 0; k < 3; ++k)
        out.plane[k].at(x, y) += static_cast<float>(point.luminance_cd_m2 * share * colour[k]);
    });
  }
}

/// Calls put(x, y, rates) for every pixel, where rates(k) gives channel k without the points.
/// @return the number of colours that had to be moved
template <class Put>
std::int64_t for_each_pixel(const Scene& scene, const SpectralResponse& response, const isp::LiftTable* table,
                            Executor& executor, const Put& put) {
  const std::vector<Vector3> patches = patch_rates(scene, response);
  const int width = scene.xyz_cd_m2.width();
  std::atomic<std::int64_t> moved{0};
  for_each_band(executor, scene.xyz_cd_m2.height(), [&](RowBand band, int) {
    std::int64_t moved_here = 0;
    for (int y = band.first; y < band.last; ++y) {
      const float* row[3] = {scene.xyz_cd_m2.plane[0].row(y), scene.xyz_cd_m2.plane[1].row(y),
                             scene.xyz_cd_m2.plane[2].row(y)};
      const std::uint16_t* patch = scene.patch.empty() ? nullptr : scene.patch.row(y);
      for (int x = 0; x < width; ++x) {
        if (patch != nullptr) {
          put(x, y, [&](int k) { return static_cast<float>(patches[patch[x]][k]); });
        } else {
          const LiftPlace p = place_of(row[0][x], row[1][x], row[2][x]);
          moved_here += p.moved;
          put(x, y, [&](int k) { return p.sum * table->response(k, p.x, p.y); });
        }
      }
    }
    moved += moved_here;
  });
  return moved;
}

/// Returns the samples of a mosaic.
Plane<float> mosaic_of(const CameraRgb& colours, BayerPhase phase, Executor& executor) {
  Plane<float> out(colours.width(), colours.height());
  for_each_band(executor, out.height(), [&](RowBand band, int) {
    for (int y = band.first; y < band.last; ++y) {
      for (int x = 0; x < out.width(); ++x) {
        out.row(y)[x] = colours.plane[static_cast<std::size_t>(colour_at(phase, x, y))].row(y)[x];
      }
    }
  });
  return out;
}

}  // namespace

SensorLight light_through_lens(CameraRgb e_per_s, BayerPhase phase, double blur_px, Executor& executor) {
  SensorLight out{mosaic_of(e_per_s, phase, executor), {}};
  const LensBlur lens(blur_px);
  for (Plane<float>& plane : e_per_s.plane) lens.apply(plane, executor);
  out.blurred_e_per_s = mosaic_of(e_per_s, phase, executor);
  return out;
}

ChargeRate charge_rate(const Scene& scene, const SpectralResponse& response, const isp::LiftTable* table,
                       BayerPhase phase, Executor& executor) {
  const int width = scene.xyz_cd_m2.width(), height = scene.xyz_cd_m2.height();
  ChargeRate out{Plane<float>(width, height), 0};
  out.moved_pixels = for_each_pixel(scene, response, table, executor, [&](int x, int y, const auto& rate) {
    out.e_per_s.row(y)[x] = rate(static_cast<int>(colour_at(phase, x, y)));
  });
  add_points(scene.points, scene.point_lights, response, phase, out.e_per_s);
  return out;
}

CameraRgb charge_rate_rgb(const Scene& scene, const SpectralResponse& response, const isp::LiftTable* table,
                          Executor& executor, std::int64_t* moved_pixels) {
  const int width = scene.xyz_cd_m2.width(), height = scene.xyz_cd_m2.height();
  CameraRgb out(width, height);
  const std::int64_t moved = for_each_pixel(scene, response, table, executor, [&](int x, int y, const auto& rate) {
    for (int k = 0; k < 3; ++k) out.plane[k].row(y)[x] = rate(k);
  });
  if (moved_pixels != nullptr) *moved_pixels = moved;
  add_points(scene.points, scene.point_lights, response, out);
  return out;
}

void add_points(std::span<const PointSource> points, std::span<const Spectrum> lights, const SpectralResponse& response,
                BayerPhase phase, Plane<float>& e_per_s) {
  const std::vector<Vector3> rates = light_rates(lights, response);
  for (const PointSource& point : points) {
    const Vector3& rate = rates[static_cast<std::size_t>(point.light)];
    spread_point(point, e_per_s.width(), e_per_s.height(), [&](int x, int y, double share) {
      e_per_s.at(x, y) +=
          static_cast<float>(point.luminance_cd_m2 * share * rate[static_cast<int>(colour_at(phase, x, y))]);
    });
  }
}

void add_points(std::span<const PointSource> points, std::span<const Spectrum> lights, const SpectralResponse& response,
                CameraRgb& e_per_s) {
  add_to_planes(points, light_rates(lights, response), e_per_s);
}

void add_points(std::span<const PointSource> points, std::span<const Spectrum> lights, SceneLinear& xyz_cd_m2) {
  std::vector<Vector3> colours;
  colours.reserve(lights.size());
  for (const Spectrum& light : lights) colours.push_back(isp::vector_of(isp::xyz_cd_m2(light)));
  add_to_planes(points, colours, xyz_cd_m2);
}

}  // namespace lowlux::capture
