#include "isp/pipeline/site_gains.h"

namespace lowlux::isp {

PerSite<float> of_crop(const PerSite<double>& active, const Rect& crop) {
  PerSite<float> out{};
  for (int site = 0; site < 4; ++site) {
    out[site] = static_cast<float>(active[site_of(crop.x + (site & 1), crop.y + (site >> 1))]);
  }
  return out;
}

PerSite<float> site_gains(const RawDn& raw, const DevelopPlan& plan, const PerSite<double>& units_at_white,
                          const Rect& crop) {
  PerSite<double> gain{};
  for (int site = 0; site < 4; ++site) {
    const int colour = static_cast<int>(colour_at(raw.phase, site & 1, site >> 1));
    gain[site] = plan.white_gain[colour] / units_at_white[site];
  }
  return of_crop(gain, crop);
}

PerSite<float> site_gains(const RawDn& raw, const DevelopPlan& plan, const Rect& crop) {
  return site_gains(raw, plan, plan.electrons_at_white.value_or(PerSite<double>{1, 1, 1, 1}), crop);
}

}  // namespace lowlux::isp
