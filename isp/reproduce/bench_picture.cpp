#include "isp/reproduce/bench_picture.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <limits>
#include <utility>
#include <variant>
#include <vector>

#include "capture/file/picture_colour.h"
#include "capture/file/picture_light.h"
#include "capture/file/picture_source.h"
#include "isp/base/file_extension.h"
#include "isp/codec/exr.h"
#include "isp/metrics/picture_metrics.h"
#include "isp/raw/kernel/raw_to_rgb.h"
#include "isp/render/output_space.h"

namespace lowlux::isp {
namespace {

// The tuning set comes first.
constexpr std::array<std::string_view, 8> files{"kodim05.png", "kodim08.png", "Carrots.exr", "StillLife.exr",
                                                "kodim15.png", "kodim19.png", "kodim23.png", "GoldenGate.exr"};
constexpr std::size_t tuning_files = 4;

constexpr double white_percentile = 0.99;

Plane<float> middle_of(const PlaneView<const float>& plane, int width, int height) {
  const auto part = plane.crop((plane.width - width) / 2, (plane.height - height) / 2, width, height);
  Plane<float> out(width, height);
  for (int y = 0; y < height; ++y) std::copy_n(part.row(y), width, out.row(y));
  return out;
}

/// Returns XYZ of an OpenEXR image whose primaries lie outside the spectral locus, so that light may be negative in
/// them: negative values become 0 here, while capture::read_picture refuses them. Carrots.exr is in ACES AP0.
Result<SceneLinear> wide_light(DecodedPicture& decoded, Executor& executor) {
  auto& linear = std::get<SceneLinear>(decoded.picture);
  for (Plane<float>& plane : linear.plane) {
    std::for_each(plane.data(), plane.data() + plane.size(), [](float& v) { v = std::max(v, 0.0f); });
  }
  const auto to_xyz = capture::primaries_to_xyz(*decoded.metadata.chromaticities);
  if (!to_xyz) return tl::make_unexpected(to_xyz.error());
  std::vector<std::string> warnings;
  return capture::light_of(linear, *to_xyz, Orientation::normal, executor, warnings);
}

Result<SceneLinear> picture_xyz(const std::string& path, Executor& executor) {
  if (has_extension(path, ".exr")) {
    std::ifstream file(path, std::ios::binary);
    const std::string bytes((std::istreambuf_iterator<char>(file)), {});
    auto decoded = decode_exr(std::as_bytes(std::span(bytes)));
    if (decoded && decoded->metadata.chromaticities) return wide_light(*decoded, executor);
  }
  auto picture = capture::read_picture(path, executor);
  if (!picture) return tl::make_unexpected(picture.error());
  return std::move(picture->xyz);
}

/// Returns the factor that scales the percentile of the largest component of linear Rec. 709 to 1.
double white_scale(const SceneLinear& xyz, const Matrix3& to_rgb) {
  std::vector<float> largest;
  largest.reserve(xyz.plane[0].size());
  for (std::size_t i = 0; i < xyz.plane[0].size(); ++i) {
    const Vector3 rgb = to_rgb * Vector3{xyz.plane[0].data()[i], xyz.plane[1].data()[i], xyz.plane[2].data()[i]};
    largest.push_back(static_cast<float>(*std::max_element(rgb.begin(), rgb.end())));
  }
  const auto at = largest.begin() + static_cast<std::ptrdiff_t>(white_percentile * (largest.size() - 1.0));
  std::nth_element(largest.begin(), at, largest.end());
  return *at > 0 ? 1.0 / static_cast<double>(*at) : 1.0;
}

/// Returns the light that a Rec. 709 display shows of an image.
SceneLinear shown(const SceneLinear& xyz, bool scene_linear, Executor& executor) {
  const Matrix3 to_rgb = xyz_to_output(OutputSpace::linear_srgb).value();  // cannot fail for a space with primaries
  const Matrix3 matrix = (scene_linear ? white_scale(xyz, to_rgb) : 1.0) * to_rgb;
  const Vector3 weights = luminance_weights(OutputSpace::linear_srgb).value();
  RgbTransform transform{.clip = std::numeric_limits<float>::infinity()};
  for (std::size_t i = 0; i < 9; ++i) transform.matrix[i] = static_cast<float>(matrix[i / 3][i % 3]);
  for (std::size_t i = 0; i < 3; ++i) transform.luminance[i] = static_cast<float>(weights[i]);
  SceneLinear out(xyz.width(), xyz.height());
  RawToRgb(xyz.width(), executor.width()).linear(CameraPlanes{.rgb = xyz.view()}, transform, out.view(), executor);
  return out;
}

}  // namespace

std::string_view name_of(PictureSet set) {
  switch (set) {
    case PictureSet::held_out:
      return "held-out";
    case PictureSet::tuning:
      return "tuning";
    case PictureSet::all:
      break;
  }
  return "all";
}

std::span<const std::string_view> files_of(PictureSet set) {
  const std::span<const std::string_view> all(files);
  if (set == PictureSet::tuning) return all.first(tuning_files);
  return set == PictureSet::held_out ? all.subspan(tuning_files) : all;
}

std::span<const std::string_view> quick_files_of(PictureSet set) {
  const std::span<const std::string_view> all = files_of(set);
  return all.subspan(all.size() - 3, 2);
}

Plane<float> lens_blurred(const PlaneView<const float>& plane, double sigma_px) {
  assert(sigma_px >= 0 && sigma_px <= 100);
  const int reach = static_cast<int>(std::ceil(5 * sigma_px));
  std::vector<double> weight(static_cast<std::size_t>(2 * reach) + 1, 1.0);
  double sum = 0;
  for (std::size_t k = 0; k < weight.size(); ++k) {
    const double i = static_cast<double>(k) - reach, z = i == 0 ? 0 : i / sigma_px;
    sum += weight[k] = std::exp(-z * z / 2);
  }
  // Blurring along the rows also transposes; after two passes the image is upright again.
  const auto along_rows = [&](const PlaneView<const float>& in) {
    Plane<float> out(in.height, in.width);
    for (int y = 0; y < in.height; ++y) {
      for (int x = 0; x < in.width; ++x) {
        double value = 0;
        for (std::size_t k = 0; k < weight.size(); ++k) {
          value += weight[k] * in.at(std::clamp(x + static_cast<int>(k) - reach, 0, in.width - 1), y);
        }
        out.at(y, x) = static_cast<float>(value / sum);
      }
    }
    return out;
  };
  return along_rows(along_rows(plane).view());
}

Result<BenchPicture> read_bench_picture(const std::string& path, int crop_width, int crop_height, Executor& executor) {
  const auto xyz = picture_xyz(path, executor);
  if (!xyz) {
    Error error = xyz.error();
    if (error.where.empty()) error.where = path;
    return tl::make_unexpected(std::move(error));
  }
  if (std::min(xyz->width(), xyz->height()) < metric_patch_px) {
    return fail(ErrorCode::insufficient,
                "the image is smaller than " + std::to_string(metric_patch_px) + " pixels, the side of a patch", path);
  }
  const SceneLinear display = shown(*xyz, has_extension(path, ".exr") || has_extension(path, ".pfm"), executor);
  const int width = crop_width > 0 ? std::min(crop_width, display.width()) : display.width();
  const int height = crop_height > 0 ? std::min(crop_height, display.height()) : display.height();
  BenchPicture out{std::filesystem::path(path).filename().string(), SceneLinear(width, height)};
  for (std::size_t c = 0; c < 3; ++c) {
    out.linear.plane[c] = lens_blurred(middle_of(display.plane[c].view(), width, height).view(), bench_lens_px);
  }
  return out;
}

Result<std::vector<BenchPicture>> read_bench_pictures(const std::string& folder,
                                                      std::span<const std::string_view> names, const PicturePart& part,
                                                      Executor& executor) {
  std::vector<BenchPicture> out;
  out.reserve(names.size());
  for (const std::string_view name : names) {
    auto picture =
        read_bench_picture((std::filesystem::path(folder) / name).string(), part.width, part.height, executor);
    if (!picture) return tl::make_unexpected(picture.error());
    out.push_back(*std::move(picture));
  }
  return out;
}

PicturePart largest_of(std::span<const BenchPicture> pictures) {
  PicturePart out;
  for (const BenchPicture& picture : pictures) {
    out.width = std::max(out.width, picture.linear.width());
    out.height = std::max(out.height, picture.linear.height());
  }
  return out;
}

}  // namespace lowlux::isp
