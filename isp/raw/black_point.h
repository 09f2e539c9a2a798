#pragma once

#include "isp/base/frame.h"
#include "isp/base/result.h"

namespace lowlux::isp {

/// Where the black point may come from.
enum class BlackChoice {
  automatic,  // masked pixels where there are enough of them, else the tag, else an error
  metadata,   // the tag only
  masked,     // the masked pixels only
  given,      // figures of the user's
  measured,   // a black point measured before, as a camera's profile holds it
};

struct BlackRequest {
  BlackChoice choice = BlackChoice::automatic;
  PerSite<double> given_dn{};  // for BlackChoice::given
  BlackPoint measured;         // for BlackChoice::measured
};

/// The black point as requested. Errors: insufficient when the source has neither masked pixels nor a tag (black is
/// not guessed), malformed when white is not above black.
Result<BlackPoint> choose_black(const RawDn& raw, const BlackRequest& request);

/// White level of the site's colour [DN]; for SensorLayout::linear_rgb sites 0 to 3 are R, G, B and B.
double white_at(const RawDn& raw, int site);

/// White level above black [DN], mean of the four sites.
double mean_range_dn(const RawDn& raw, const BlackPoint& black);

}  // namespace lowlux::isp
