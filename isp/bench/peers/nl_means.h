#pragma once

#include <cstdint>

#include "isp/base/image.h"
#include "isp/metrics/picture_metrics.h"

namespace lowlux::isp {

/// An image of interleaved R G B codes, `rows` of 3 `columns` bytes, without padding.
struct NlMeansPicture {
  std::uint8_t* rgb = nullptr;
  int columns = 0;
  int rows = 0;
};

/// Strengths of non-local means for lightness and for colour.
struct NlMeansStrength {
  double lightness = 0;
  double colour = 0;
};

/// Functions of liblowlux_nlm.so: OpenCV's fastNlMeansDenoisingColored and its steps, so that a search need not repeat
/// them. Templates of 7, windows of 21 pixels, OpenCV's defaults; on the calling thread alone, so that its CPU time
/// covers all work. Each function returns whether it succeeded.
struct NlMeans {
  bool (*denoise)(const NlMeansPicture& from, const NlMeansPicture& to, double lightness, double colour) noexcept;
  /// Converts to 8-bit CIELAB: L* into `lightness`, a* and b* interleaved into `colour`.
  bool (*split)(const NlMeansPicture& from, std::uint8_t* lightness, std::uint8_t* colour) noexcept;
  /// Filters one of the two; `channels` is 1 or 2.
  bool (*filter)(const std::uint8_t* from, std::uint8_t* to, int columns, int rows, int channels,
                 double strength) noexcept;
  bool (*join)(const std::uint8_t* lightness, const std::uint8_t* colour, const NlMeansPicture& to) noexcept;
};

/// Name of the functions' symbol in the module.
inline constexpr const char* nl_means_name = "lowlux_nl_means";

extern "C" const NlMeans* lowlux_nl_means() noexcept;
using GetNlMeans = const NlMeans*() noexcept;

/// Returns interleaved 8-bit sRGB codes of display values, rounded.
Encoded8 codes_of(const RgbView<const float>& display);

/// Returns the input of non-local means: codes with each channel clipped separately, which gives better results in the
/// dark than moving noise into the gamut, by some 2 dB at 4 e- over 200 e-.
Encoded8 nl_means_input(const RenderedPicture& picture);

/// Converts codes back to linear display values.
SceneLinear linear_of(const Encoded8& codes);

/// Result and cost of a search.
struct StrengthSearch {
  NlMeansStrength best;
  double psnr_db = 0;  // with these strengths, on the searched tiles
  int runs = 0;        // number of filter runs, on either plane; 0: it failed
};

/// A search uses tiles of a larger image, spread evenly over it and joined to an image of this size. A search on
/// complete images took more than half of the time of `bench`.
inline constexpr int search_columns = 512, search_rows = 288;

/// Finds the two strengths whose result is closest to the truth in PSNR. It uses the truth itself, which is not
/// available in practice. Of powers of 2^(1/3) from 1/2 to 256 it takes first the best of all pairs of every second
/// octave, then climbs by octaves and by single steps, all on tiles of the image.
StrengthSearch search_strength(const NlMeans& filter, const Encoded8& noisy, const PictureTruth& truth);

}  // namespace lowlux::isp
