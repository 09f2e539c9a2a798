#include "isp/raw/subtract_dark_frame.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstdint>

#include <fmt/format.h>

#include "isp/raw/black_point.h"
#include "isp/raw/repair.h"

namespace lowlux::isp {
namespace {

struct Site {
  float mean;
  float white;
};

PerSite<Site> sites_of(const RawDn& raw, const BlackPoint& black) {
  PerSite<Site> out{};
  for (int site = 0; site < 4; ++site) {
    out[site] = {static_cast<float>(black.pedestal_dn[site]), static_cast<float>(white_at(raw, site))};
  }
  return out;
}

// Returns the code minus its dark value [DN].
float light_dn(std::uint16_t code, float dark, const Site& site) {
  const auto dn = static_cast<float>(code);
  return dn - (dn >= site.white ? site.mean : dark);
}

Rect whole_of(const RawDn& raw) { return {0, 0, raw.active.width, raw.active.height}; }

template <class Put>
void for_each_pixel(const RawDn& raw, const DarkFrame& dark, const BlackPoint& black, const Rect& part,
                    Executor& executor, const Put& put) {
  const PerSite<Site> sites = sites_of(raw, black);
  for_each_band(executor, part.height, [&](RowBand band, int) {
    for (int y = band.first; y < band.last; ++y) {
      const std::uint16_t* codes = raw.dn.row(raw.active.y + part.y + y) + raw.active.x + part.x;
      const float* row = dark.dn.row(part.y + y) + part.x;
      for (int x = 0; x < part.width; ++x) {
        const Site& site = sites[site_of(x, y)];
        put(x, y, light_dn(codes[x], row[x], site), site);
      }
    }
  });
}

}  // namespace

Result<BlackPoint> black_of(const RawDn& raw, const DarkFrame& dark) {
  if (raw.layout == SensorLayout::linear_rgb) {
    return fail(ErrorCode::unsupported,
                "the image is already demosaiced; dark frames are subtracted from the mosaic of the sensor");
  }
  if (raw.is_float()) {
    return fail(ErrorCode::unsupported,
                "the image has floating-point samples; dark frames are subtracted from integer codes of the sensor");
  }
  if (dark.dn.width() != raw.active.width || dark.dn.height() != raw.active.height) {
    return fail(
        ErrorCode::invalid_argument,
        fmt::format("the dark frame has {} x {} pixels, the image {} x {}; take darks with its camera and settings",
                    dark.dn.width(), dark.dn.height(), raw.active.width, raw.active.height));
  }
  if (!named_defects(raw, dark.unknown)) {
    return fail(ErrorCode::malformed, "the dark frame has no value for a large part of its pixels");
  }
  BlackPoint black;
  black.pedestal_dn = dark.mean_dn;
  black.noise_std_dn = dark.noise_std_dn;
  if (dark.holds_dark) black.holds = BlackPoint::Holds::pedestal_and_dark;
  black.source = BlackPoint::Source::dark_frame;
  for (int site = 0; site < 4; ++site) {
    if (white_at(raw, site) > black.pedestal_dn[site]) continue;
    return fail(ErrorCode::malformed, fmt::format("the dark frame's level {:.1f} DN is not below white, {:.1f} DN",
                                                  black.pedestal_dn[site], white_at(raw, site)));
  }
  return black;
}

void to_fraction(const RawDn& raw, const DarkFrame& dark, const BlackPoint& black, PlaneView<float> out,
                 Executor& executor) {
  to_fraction(raw, dark, black, whole_of(raw), out, executor);
}

void to_fraction(const RawDn& raw, const DarkFrame& dark, const BlackPoint& black, const Rect& part,
                 PlaneView<float> out, Executor& executor) {
  assert(part.x % 2 == 0 && part.y % 2 == 0 && out.width == part.width && out.height == part.height);
  for_each_pixel(raw, dark, black, part, executor, [&](int x, int y, float light, const Site& site) {
    out.row(y)[x] = light / (site.white - site.mean);
  });
}

RawFrame measurable_without_dark(const RawFrame& frame, const DarkFrame& dark, const BlackPoint& black,
                                 Executor& executor) {
  RawFrame out;
  const RawDn& raw = frame.raw;
  out.raw.dn = Plane<std::uint16_t>(raw.active.width, raw.active.height);
  out.raw.layout = raw.layout;
  out.raw.phase = raw.phase;
  out.raw.active = {0, 0, raw.active.width, raw.active.height};
  out.raw.default_crop = raw.default_crop;
  out.raw.white_dn = raw.white_dn;
  out.noise = frame.noise;
  out.noise_ratio = frame.noise_ratio;
  for_each_pixel(raw, dark, black, whole_of(raw), executor, [&](int x, int y, float light, const Site& site) {
    const float code = std::clamp(light + site.mean, 0.0f, 65535.0f);
    out.raw.dn.row(y)[x] = static_cast<std::uint16_t>(std::lround(code));
  });
  return out;
}

}  // namespace lowlux::isp
