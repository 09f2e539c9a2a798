#pragma once

#include <array>
#include <memory>
#include <optional>
#include <vector>

#include "isp/base/dark_frame.h"
#include "isp/base/frame.h"
#include "isp/raw/black_point.h"
#include "isp/raw/repair.h"

namespace lowlux::isp {

/// What the raw values of a frame mean, and which of them are to be repaired.
struct RawLevels {
  BlackPoint black;
  std::shared_ptr<const DarkFrame> dark_frame;        // set: subtracted pixel by pixel in place of the pedestal
  std::optional<PerSite<double>> electrons_at_white;  // set where the mosaic is counted in electrons on its way
  std::vector<Pixel> defects;                         // ascending
};

/// Whether a frame can be rendered straight from its 16-bit codes: nothing has to be repaired, multiplied, reduced, or
/// subtracted pixel by pixel on the way.
bool renders_from_codes(const RawFrame& frame, const RawLevels& levels, bool reduces_noise);

/// Electrons at white of each colour; both greens have as many. Precondition: levels.electrons_at_white.
std::array<double, 3> electrons_by_colour(const RawDn& raw, const RawLevels& levels);

}  // namespace lowlux::isp
