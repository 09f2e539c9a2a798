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

/// Which of the pictures of testdata/pictures.
enum class PictureSet : std::uint8_t { held_out, tuning, all };

/// "held-out", "tuning" or "all".
std::string_view name_of(PictureSet set);

/// Parameters are chosen on the tuning set: kodim05, kodim08, Carrots, StillLife; what is told of them is measured on
/// the held-out set: kodim15, kodim19, kodim23, GoldenGate.
std::span<const std::string_view> files_of(PictureSet set);

/// The two of a set that quick measurements take: those before its last, which has more pixels.
std::span<const std::string_view> quick_files_of(PictureSet set);

/// Standard deviation of the Gaussian over which the lens spreads every point [px].
inline constexpr double bench_lens_px = 0.9;

/// A clean picture behind the lens.
struct BenchPicture {
  std::string name;    // of the file
  SceneLinear linear;  // Rec. 709, 0..1
};

/// Reads a picture as what a display shows of it, and blurs it. Of scene-linear pictures the 99th percentile of the
/// largest component is brought to display white, and colours are moved into the gamut as the product does it.
/// @param crop_width, crop_height  the part from the middle that is used; 0: all. Where smaller, the picture's own size
/// Errors: those of reading the file; too small for a metric's patch or the denoiser.
Result<BenchPicture> read_bench_picture(const std::string& path, int crop_width, int crop_height, Executor& executor);

/// The middle of a picture, in pixels; 0: all of it.
struct PicturePart {
  int width = 0;
  int height = 0;
};

/// Several from one folder. Errors: those of read_bench_picture.
Result<std::vector<BenchPicture>> read_bench_pictures(const std::string& folder,
                                                      std::span<const std::string_view> names, const PicturePart& part,
                                                      Executor& executor);

/// The width of the widest and the height of the highest; 0 of none.
PicturePart largest_of(std::span<const BenchPicture> pictures);

/// A plane behind a lens; the ends of rows and columns are repeated. @param sigma_px  0..100; 0: as it is
Plane<float> lens_blurred(const PlaneView<const float>& plane, double sigma_px);

}  // namespace lowlux::isp
