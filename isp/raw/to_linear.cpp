#include "isp/raw/to_linear.h"

#include <array>
#include <cassert>
#include <utility>

#include "isp/base/cfa.h"
#include "isp/raw/black_point.h"

namespace lowlux::isp {
namespace {

struct SiteScale {
  PerSite<float> black;
  PerSite<float> gain;
};

SiteScale site_scale(const RawDn& raw, const BlackPoint& black) {
  SiteScale scale{};
  for (int site = 0; site < 4; ++site) {
    scale.black[site] = static_cast<float>(black.pedestal_dn[site]);
    scale.gain[site] = static_cast<float>(1.0 / (white_at(raw, site) - black.pedestal_dn[site]));
  }
  return scale;
}

Rect whole_of(const RawDn& raw) { return {0, 0, raw.active.width, raw.active.height}; }

[[maybe_unused]] bool keeps_sites(const RawDn& raw, const Rect& part, PlaneView<float> out) {
  return part.x % 2 == 0 && part.y % 2 == 0 && part.x >= 0 && part.y >= 0 && part.x + part.width <= raw.active.width &&
         part.y + part.height <= raw.active.height && out.width == part.width && out.height == part.height;
}

// Scales a sample above a black level of its own by the range of its plane, since photosites have one gain whatever
// their black is (DNG 1.7, chapter 5). A saturated sample has lost its black level.
float scaled(double dn, double black_dn, double mean_black_dn, double white_dn) {
  return static_cast<float>((dn - (dn >= white_dn ? mean_black_dn : black_dn)) / (white_dn - mean_black_dn));
}

// Subtracts the pattern of a tag that four figures cannot express.
template <class Sample>
void row_by_pattern(const RawDn& raw, const Sample* dn, const BlackPoint& black, const Rect& part, int y, float* out) {
  const double mean_black_dn = mean_of_sites(black.pedestal_dn);
  for (int x = 0; x < part.width; ++x)
    out[x] = scaled(dn[x], black.pattern->at(part.x + x, part.y + y), mean_black_dn, white_at(raw, site_of(x, y)));
}

template <class Sample>
void row_by_site(const Sample* dn, const SiteScale& scale, int width, int y, float* out) {
  const int left = site_of(0, y);
  const float black[2] = {scale.black[left], scale.black[left + 1]};
  const float gain[2] = {scale.gain[left], scale.gain[left + 1]};
  int x = 0;
  for (; x + 1 < width; x += 2) {  // complete pairs, which compilers vectorise
    out[x] = (static_cast<float>(dn[x]) - black[0]) * gain[0];
    out[x + 1] = (static_cast<float>(dn[x + 1]) - black[1]) * gain[1];
  }
  if (x < width) out[x] = (static_cast<float>(dn[x]) - black[0]) * gain[0];
}

// Subtracts the black point from row y of a region of the active area.
void row_of(const RawDn& raw, const BlackPoint& black, const SiteScale& scale, const Rect& part, int y, float* out) {
  with_samples(raw, [&](const auto& samples) {
    const auto* const dn = samples.row(raw.active.y + part.y + y) + raw.active.x + part.x;
    if (black.pattern) {
      row_by_pattern(raw, dn, black, part, y, out);
    } else {
      row_by_site(dn, scale, part.width, y, out);
    }
  });
}

// Calls `apply` (which multiplies or shifts) on each pixel with the index of its site.
template <class Apply>
void for_each_site(PlaneView<float> plane, Executor& executor, const Apply& apply) {
  for_each_band(executor, plane.height, [&](RowBand band, int) {
    for (int y = band.first; y < band.last; ++y) {
      float* row = plane.row(y);
      for (int x = 0; x < plane.width; ++x) row[x] = apply(row[x], site_of(x, y));
    }
  });
}

}  // namespace

void to_fraction(const RawDn& raw, const BlackPoint& black, const Rect& part, PlaneView<float> out,
                 Executor& executor) {
  assert(keeps_sites(raw, part, out));
  const SiteScale scale = site_scale(raw, black);
  for_each_band(executor, part.height, [&](RowBand band, int) {
    for (int y = band.first; y < band.last; ++y) row_of(raw, black, scale, part, y, out.row(y));
  });
}

void to_fraction(const RawDn& raw, const BlackPoint& black, PlaneView<float> out, Executor& executor) {
  to_fraction(raw, black, whole_of(raw), out, executor);
}

RawFraction to_fraction(const RawDn& raw, const BlackPoint& black, Executor& executor) {
  RawFraction out{Plane<float>(raw.active.width, raw.active.height), raw.phase};
  to_fraction(raw, black, out.value.view(), executor);
  return out;
}

void to_fraction_rgb(const RawDn& raw, const BlackPoint& black, RgbView<float> out, Executor& executor) {
  to_fraction_rgb(raw, black, whole_of(raw), out, executor);
}

void to_fraction_rgb(const RawDn& raw, const BlackPoint& black, const Rect& part, RgbView<float> out,
                     Executor& executor) {
  const auto subtract = [&](const auto* dn, int y, int c) {
    float* row = out[c].row(y);
    for (int x = 0; x < part.width; ++x) {
      const double level = black.pattern ? black.pattern->at(part.x + x, part.y + y, c) : black.pedestal_dn[c];
      row[x] = scaled(dn[3 * x + c], level, black.pedestal_dn[c], raw.white_dn[c]);
    }
  };
  for_each_band(executor, part.height, [&](RowBand band, int) {
    for (int y = band.first; y < band.last; ++y) {
      with_samples(raw, [&](const auto& samples) {
        const auto* const dn = samples.row(raw.active.y + part.y + y) + std::ptrdiff_t{3} * (raw.active.x + part.x);
        for (int c = 0; c < 3; ++c) subtract(dn, y, c);
      });
    }
  });
}

std::optional<PerSite<double>> electrons_at_white(const RawDn& raw, const NoiseProfile& noise) {
  PerSite<double> electrons{};
  for (int site = 0; site < 4; ++site) {
    const bool bayer = raw.layout == SensorLayout::bayer;
    const int colour = bayer ? static_cast<int>(colour_at(raw.phase, site & 1, site >> 1)) : 0;
    electrons[site] = 1.0 / noise.scale[colour];
    if (!(electrons[site] >= 1 && electrons[site] <= max_electrons_at_white)) return std::nullopt;
  }
  return electrons;
}

void count_electrons(PlaneView<float> fraction, const PerSite<double>& electrons_at_white, Executor& executor) {
  for_each_site(fraction, executor,
                [&](float v, int site) { return v * static_cast<float>(electrons_at_white[site]); });
}

RawElectrons to_electrons(RawFraction fraction, const PerSite<double>& electrons_at_white, Executor& executor) {
  count_electrons(fraction.value.view(), electrons_at_white, executor);
  return {std::move(fraction.value), fraction.phase};
}

void to_electrons(const RawDn& raw, const BlackPoint& black, const PerSite<double>& electrons_at_white,
                  PlaneView<float> out, Executor& executor) {
  to_electrons(raw, black, electrons_at_white, whole_of(raw), out, executor);
}

void to_electrons(const RawDn& raw, const BlackPoint& black, const PerSite<double>& electrons_at_white,
                  const Rect& part, PlaneView<float> out, Executor& executor) {
  assert(keeps_sites(raw, part, out));
  const SiteScale scale = site_scale(raw, black);
  for_each_band(executor, part.height, [&](RowBand band, int) {
    for (int y = band.first; y < band.last; ++y) {
      float* const row = out.row(y);
      row_of(raw, black, scale, part, y, row);
      const int left = site_of(0, y);
      const std::array electrons{static_cast<float>(electrons_at_white[left]),
                                 static_cast<float>(electrons_at_white[left + 1])};
      int x = 0;
      for (; x + 1 < part.width; x += 2) {
        row[x] *= electrons[0];
        row[x + 1] *= electrons[1];
      }
      if (x < part.width) row[x] *= electrons[0];
    }
  });
}

void subtract_dark(PlaneView<float> raw_e, const PerSite<double>& dark_mean_e, Executor& executor) {
  if (dark_mean_e == PerSite<double>{}) return;
  for_each_site(raw_e, executor, [&](float v, int site) { return v - static_cast<float>(dark_mean_e[site]); });
}

SignalElectrons subtract_dark(RawElectrons raw, const BlackPoint& black, Executor& executor) {
  subtract_dark(raw.value.view(), black.dark_mean_e, executor);
  return {std::move(raw.value), raw.phase};
}

SignalFraction subtract_dark(RawFraction raw) { return {std::move(raw.value), raw.phase}; }

}  // namespace lowlux::isp
