#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "isp/base/executor.h"
#include "isp/base/image.h"
#include "isp/base/result.h"

namespace lowlux::isp {

/// Selects images of testdata/pictures.
enum class PictureSet : std::uint8_t { held_out, tuning, all };

/// Returns "held-out", "tuning" or "all".
std::string_view name_of(PictureSet set);

/// Returns the files of a set. Parameters are chosen on the tuning set: kodim05, kodim08, Carrots, StillLife; reported
/// results are measured on the held-out set: kodim15, kodim19, kodim23, GoldenGate.
std::span<const std::string_view> files_of(PictureSet set);

/// Returns the two files of a set that quick measurements use: those before its last, which has more pixels.
std::span<const std::string_view> quick_files_of(PictureSet set);

/// Standard deviation of the lens's Gaussian point spread function [px].
inline constexpr double bench_lens_px = 0.9;

/// A clean image blurred by the lens.
struct BenchPicture {
  std::string name;    // name of the file
  SceneLinear linear;  // Rec. 709, 0..1
};

/// Reads an image as a display shows it, and blurs it. For scene-linear images the 99th percentile of the largest
/// component is scaled to display white, and colours are moved into the gamut as in developing.
/// @param crop_width, crop_height  size of the central crop that is used; 0: all; limited to the image's own size
/// Errors: those of reading the file; too small for a metric's patch or the denoiser.
Result<BenchPicture> read_bench_picture(const std::string& path, int crop_width, int crop_height, Executor& executor);

/// Size of the central crop of an image, in pixels; 0: all of it.
struct PicturePart {
  int width = 0;
  int height = 0;
};

/// Reads several images from one folder. Errors: those of read_bench_picture.
Result<std::vector<BenchPicture>> read_bench_pictures(const std::string& folder,
                                                      std::span<const std::string_view> names, const PicturePart& part,
                                                      Executor& executor);

/// Returns the width of the widest and the height of the highest image; 0 without images.
PicturePart largest_of(std::span<const BenchPicture> pictures);

/// Blurs a plane by a lens; the ends of rows and columns are repeated. @param sigma_px  0..100; 0: unchanged
Plane<float> lens_blurred(const PlaneView<const float>& plane, double sigma_px);

}  // namespace lowlux::isp
