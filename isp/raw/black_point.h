#pragma once

#include <optional>

#include "isp/base/frame.h"
#include "isp/base/result.h"
#include "isp/raw/measure/masked_black.h"

namespace lowlux::isp {

/// Names the source of the black point.
enum class BlackChoice {
  automatic,  // masked pixels where there are enough, else BlackRequest::measured, else the tag, else the default of
              // the format; instead of masked pixels a tag finer than one figure per site, or, if there is one,
              // BlackRequest::measured
  metadata,   // the tag only
  masked,     // the masked pixels only
  given,      // figures given by the user
  measured,   // only BlackRequest::measured, which must be set
};

/// Holds the request for a black level.
struct BlackRequest {
  BlackChoice choice = BlackChoice::automatic;
  PerSite<double> given_dn{};  // for BlackChoice::given
  /// States the known dark charge of the frame, system gain times dark current times exposure time [DN]; 0 if unknown.
  /// It is added to a pedestal that is tagged or given. Masked pixels include theirs, and `measured` includes this one.
  PerSite<double> dark_dn{};
  std::optional<BlackPoint> measured;  // measured earlier and stored in a camera's profile
  bool use_format_default = true;  // for BlackChoice::automatic; false where a wrong level would spoil a calibration
};

/// Returns measure_masked_black with the gain that the noise profile of the frame states, if it states one.
MaskedBlack masked_black_of(const RawFrame& frame);

/// Returns the black point as requested. Errors: insufficient when the source has neither masked pixels nor a tag, and
/// its format no default (black is not guessed), malformed when white is not above black, invalid_argument for
/// BlackChoice::measured without BlackRequest::measured.
Result<BlackPoint> choose_black(const RawDn& raw, const BlackRequest& request);

/// Returns the white level of the site's colour [DN]; for SensorLayout::linear_rgb sites 0 to 3 are R, G, B and B.
double white_at(const RawDn& raw, int site);

/// Returns the white level above black [DN], as the mean of the four sites.
double mean_range_dn(const RawDn& raw, const BlackPoint& black);

}  // namespace lowlux::isp
