#pragma once

#include <array>
#include <cstdint>
#include <variant>

#include "isp/base/cfa.h"
#include "isp/base/image.h"
#include "isp/base/plane.h"
#include "isp/raw/kernel/demosaic.h"

namespace lowlux::isp {

/// Defines value = (dn - black[site]) * gain[site], with sites as in site_of(). The gain holds 1 / (white - black) and
/// the white balance.
struct SiteLevels {
  PerSite<float> black{};  // [DN]
  PerSite<float> gain{1, 1, 1, 1};
};

/// Views a Bayer mosaic as read out. The rows are read front to back, and once but for those that bands have in common,
/// so they may lie in uncached memory.
struct DnMosaic {
  PlaneView<const std::uint16_t> dn;
  BayerPhase phase = BayerPhase::rggb;
  SiteLevels levels;
  Demosaic demosaic;
};

/// Views a signed linear Bayer mosaic, black already subtracted; value = sample * gain[site].
/// A sample that is not a number counts as 0, one beyond +-1e9 as +-1e9.
struct SignedMosaic {
  PlaneView<const float> value;
  BayerPhase phase = BayerPhase::rggb;
  PerSite<float> gain{1, 1, 1, 1};
  Demosaic demosaic;
};

/// Views camera RGB that needs no demosaicing; samples as in SignedMosaic. Monochrome data may use one plane for all
/// three.
struct CameraPlanes {
  RgbView<const float> rgb;
  std::array<float, 3> gain{1, 1, 1};
};

using RgbInput = std::variant<DnMosaic, SignedMosaic, CameraPlanes>;

}  // namespace lowlux::isp
