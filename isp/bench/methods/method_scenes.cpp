#include "isp/bench/methods/method_scenes.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "isp/base/matrix3.h"
#include "isp/base/random/random.h"

namespace lowlux::isp {
namespace {

/// Streams of random numbers of one seed: `frame` of the generator.
enum class SceneStream : std::uint32_t { place, leaf_shape, leaf_colour, star_place, star_light };

/// Returns four numbers in (0, 1).
std::array<double, 4> uniform(std::uint64_t seed, SceneStream stream, std::size_t index) {
  const DrawStream draws{.seed = seed, .frame = static_cast<std::uint32_t>(stream), .purpose = draw_purpose::scene};
  std::array<double, 4> out{};
  const PhiloxWords words = words_at(draws, static_cast<std::uint32_t>(index), 0);
  for (std::size_t i = 0; i < out.size(); ++i) out[i] = (words[i] + 0.5) / 4294967296.0;
  return out;
}

/// Returns a u + b v.
Vector3 sum_of(double a, const Vector3& u, double b, const Vector3& v) {
  return {a * u[0] + b * v[0], a * u[1] + b * v[1], a * u[2] + b * v[2]};
}

void set_pixel(SceneLinear& image, int x, int y, const Vector3& rgb) {
  for (std::size_t c = 0; c < 3; ++c) image.plane[c].at(x, y) = static_cast<float>(rgb[c]);
}

void fill_disc(SceneLinear& image, const StarPlace& centre, double radius, const Vector3& rgb) {
  const int top = std::max(0, static_cast<int>(std::ceil(centre.y_px - radius)));
  const int bottom = std::min(image.height() - 1, static_cast<int>(std::floor(centre.y_px + radius)));
  for (int y = top; y <= bottom; ++y) {
    const double half = std::sqrt(std::max(0.0, radius * radius - (y - centre.y_px) * (y - centre.y_px)));
    const int left = std::max(0, static_cast<int>(std::ceil(centre.x_px - half)));
    const int right = std::min(image.width() - 1, static_cast<int>(std::floor(centre.x_px + half)));
    for (int x = left; x <= right; ++x) set_pixel(image, x, y, rgb);
  }
}

void add_star(SceneLinear& image, const StarPlace& centre, const Vector3& peak, double lens_px, float limit) {
  const int reach = static_cast<int>(std::ceil(6 * lens_px));
  const int x0 = static_cast<int>(std::lround(centre.x_px)), y0 = static_cast<int>(std::lround(centre.y_px));
  for (int y = std::max(0, y0 - reach); y <= std::min(image.height() - 1, y0 + reach); ++y) {
    for (int x = std::max(0, x0 - reach); x <= std::min(image.width() - 1, x0 + reach); ++x) {
      const double r2 = std::pow(x - centre.x_px, 2) + std::pow(y - centre.y_px, 2);
      const double spread = std::exp(-r2 / (2 * lens_px * lens_px));
      for (std::size_t c = 0; c < 3; ++c) {
        float& value = image.plane[c].at(x, y);
        value = std::min(limit, value + static_cast<float>(spread * peak[c]));
      }
    }
  }
}

/// Returns a part of an image at a place that the seed draws; even sizes.
BenchPicture part_of(const BenchPicture& picture, const SceneSize& size, std::uint64_t seed, std::size_t index) {
  const int width = std::min(size.width, picture.linear.width() & ~1);
  const int height = std::min(size.height, picture.linear.height() & ~1);
  const auto at = uniform(seed, SceneStream::place, index);
  const int x0 = static_cast<int>(at[0] * (picture.linear.width() - width + 1));
  const int y0 = static_cast<int>(at[1] * (picture.linear.height() - height + 1));
  BenchPicture out{picture.name, SceneLinear(width, height)};
  for (std::size_t c = 0; c < 3; ++c) {
    const auto part = picture.linear.plane[c].view().crop(x0, y0, width, height);
    for (int y = 0; y < height; ++y) std::copy_n(part.row(y), width, out.linear.plane[c].row(y));
  }
  return out;
}

}  // namespace

MethodScene leaves_scene(const SceneSize& size, std::uint64_t seed, const Leaves& how) {
  constexpr double darkest = 0.02, brightest = 0.95;
  MethodScene out{{"leaves", SceneLinear(size.width, size.height)}, {}};
  SceneLinear& image = out.picture.linear;
  for (Plane<float>& plane : image.plane) std::fill_n(plane.data(), plane.size(), 0.2F);
  const double min_radius = how.min_radius_px;
  const double max_radius = std::max(2 * min_radius, how.max_radius_px > 0 ? how.max_radius_px : size.height / 4.0);
  const auto leaves = static_cast<std::size_t>(size.width * size.height / how.pixels_per_leaf);
  for (std::size_t i = 0; i < leaves; ++i) {
    const auto shape = uniform(seed, SceneStream::leaf_shape, i), colour = uniform(seed, SceneStream::leaf_colour, i);
    const double narrow = std::pow(min_radius, -2), wide = std::pow(max_radius, -2);
    const double radius = 1 / std::sqrt(wide + shape[0] * (narrow - wide));  // inverse of the distribution of r^-3
    Vector3 rgb{};
    for (std::size_t c = 0; c < 3; ++c) {
      const double power = how.shared * colour[0] + (1 - how.shared) * colour[c + 1];
      rgb[c] = darkest * std::pow(brightest / darkest, power) * (1 - how.chroma * colour[c + 1]);
    }
    fill_disc(image, {shape[1] * size.width, shape[2] * size.height}, radius, rgb);
  }
  for (Plane<float>& plane : image.plane) plane = lens_blurred(plane.view(), how.lens_px);
  return out;
}

MethodScene stars_scene(const SceneSize& size, std::uint64_t seed, const StarField& field) {
  constexpr double pixels_per_star = 600, sky = 0.02, glow = 0.04, border_px = 8;
  constexpr Vector3 sky_rgb{0.8, 0.95, 1.1}, glow_rgb{1.2, 1, 0.7}, warm{1, 0.8, 0.55}, cold{0.75, 0.88, 1};
  MethodScene out{{"stars", SceneLinear(size.width, size.height)}, {}};
  SceneLinear& image = out.picture.linear;
  for (int y = 0; y < size.height; ++y) {
    const double low = glow * std::pow(static_cast<double>(y) / size.height, 2);
    for (int x = 0; x < size.width; ++x) set_pixel(image, x, y, sum_of(sky, sky_rgb, low, glow_rgb));
  }
  const auto stars = static_cast<std::size_t>(size.width * size.height / pixels_per_star);
  for (std::size_t i = 0; i < stars; ++i) {
    const auto place = uniform(seed, SceneStream::star_place, i), light = uniform(seed, SceneStream::star_light, i);
    const StarPlace centre{border_px + place[0] * (size.width - 1 - 2 * border_px),
                           border_px + place[1] * (size.height - 1 - 2 * border_px)};
    const double peak = field.law == StarLaw::power
                            ? std::min(field.brightest, field.faintest / std::pow(light[0], 1 / 0.5))
                            : field.faintest * std::pow(field.brightest / field.faintest, light[0]);
    const double lens_px = std::lerp(field.min_lens_px, field.max_lens_px, light[2]);
    add_star(image, centre, sum_of(peak * light[1], warm, peak * (1 - light[1]), cold), lens_px, field.limit);
    out.stars.push_back(centre);
  }
  return out;
}

Result<std::vector<MethodScene>> method_scenes(const std::string& folder, std::span<const std::string_view> pictures,
                                               const SceneSize& size, std::uint64_t seed, Executor& executor) {
  const auto whole = read_bench_pictures(folder, pictures, {}, executor);
  if (!whole) return tl::make_unexpected(whole.error());
  std::vector<MethodScene> out;
  out.reserve(whole->size() + 2);
  for (std::size_t i = 0; i < whole->size(); ++i) out.push_back({part_of((*whole)[i], size, seed, i), {}});
  out.push_back(leaves_scene(size, seed));
  out.push_back(stars_scene(size, seed));
  return out;
}

}  // namespace lowlux::isp
