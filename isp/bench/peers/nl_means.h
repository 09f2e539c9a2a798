#pragma once

#include <cstdint>

#include "isp/base/image.h"
#include "isp/metrics/picture_metrics.h"

namespace lowlux::isp {

/// A picture of interleaved R G B codes, `rows` of 3 `columns` bytes, none between them.
struct NlMeansPicture {
  std::uint8_t* rgb = nullptr;
  int columns = 0;
  int rows = 0;
};

/// Strengths of non-local means: of lightness and of colour.
struct NlMeansStrength {
  double lightness = 0;
  double colour = 0;
};

/// What liblowlux_nlm.so gives: OpenCV's fastNlMeansDenoisingColored and the steps it is made of, so that a search need
/// not repeat them. Templates of 7, windows of 21 pixels, OpenCV's defaults; on the calling thread alone, so that its
/// CPU time is all of it. Each function returns whether it worked.
struct NlMeans {
  bool (*denoise)(const NlMeansPicture& from, const NlMeansPicture& to, double lightness, double colour) noexcept;
  /// 8-bit CIELAB: L* into `lightness`, a* and b* interleaved into `colour`.
  bool (*split)(const NlMeansPicture& from, std::uint8_t* lightness, std::uint8_t* colour) noexcept;
  /// Filters one of the two; `channels` is 1 or 2.
  bool (*filter)(const std::uint8_t* from, std::uint8_t* to, int columns, int rows, int channels,
                 double strength) noexcept;
  bool (*join)(const std::uint8_t* lightness, const std::uint8_t* colour, const NlMeansPicture& to) noexcept;
};

/// The name under which the module holds it.
inline constexpr const char* nl_means_name = "lowlux_nl_means";

extern "C" const NlMeans* lowlux_nl_means() noexcept;
using GetNlMeans = const NlMeans*() noexcept;

/// Interleaved 8-bit sRGB codes of display values, rounded.
Encoded8 codes_of(const RgbView<const float>& display);

/// What non-local means start from: codes with each channel clipped by itself, which serves them better in the dark
/// than moving noise into the gamut, by some 2 dB at 4 e- over 200 e-.
Encoded8 nl_means_input(const RenderedPicture& picture);

/// The way back: linear display values of codes.
SceneLinear linear_of(const Encoded8& codes);

/// What a search costs and finds.
struct StrengthSearch {
  NlMeansStrength best;
  double psnr_db = 0;  // with them, of what was looked at
  int runs = 0;        // of the filter, on either plane; 0: it failed
};

/// Of a larger picture, parts that are spread evenly over it and put together are looked at: so many pixels. Whole ones
/// took more than half of the time of `bench`.
inline constexpr int search_columns = 512, search_rows = 288;

/// The two strengths whose result is closest to the truth in PSNR, found on the truth itself, as nobody could who has
/// only the noisy picture: of powers of 2^(1/3) from 1/2 to 256 first the best of all pairs of every second octave,
/// then uphill by octaves and by single steps, all on parts of the picture.
StrengthSearch search_strength(const NlMeans& filter, const Encoded8& noisy, const PictureTruth& truth);

}  // namespace lowlux::isp
