#include "isp/pipeline/render/electron_mosaic.h"

#include "isp/raw/subtract_dark_frame.h"
#include "isp/raw/to_linear.h"

namespace lowlux::isp {
void subtract_black(const RawDn& raw, const RawLevels& levels, const Rect& part, PlaneView<float> out,
                    Executor& executor) {
  if (levels.dark_frame) {
    to_fraction(raw, *levels.dark_frame, levels.black, part, out, executor);
  } else {
    to_fraction(raw, levels.black, part, out, executor);
  }
}

RawElectrons raw_electrons(const RawFrame& frame, const RawLevels& levels, Executor& executor) {
  const int width = frame.raw.active.width, height = frame.raw.active.height;
  RawElectrons out{Plane<float>(width, height), frame.raw.phase};
  raw_electrons(frame, levels, {0, 0, width, height}, out.value.view(), executor);
  return out;
}

void raw_electrons(const RawFrame& frame, const RawLevels& levels, const Rect& part, PlaneView<float> out,
                   Executor& executor) {
  if (levels.dark_frame) {
    subtract_black(frame.raw, levels, part, out, executor);
    count_electrons(out, *levels.electrons_at_white, executor);
  } else {
    to_electrons(frame.raw, levels.black, *levels.electrons_at_white, part, out, executor);
  }
  repair(out, {part.x, part.y}, levels.defects, 2);
}

void subtract_lines(std::span<const denoise::LineOffsets> lines, const Rect& part, PlaneView<float> raw_e) {
  for (const denoise::LineOffsets& offsets : lines) {
    denoise::subtract_lines(offsets, raw_e, offsets.lines == denoise::Lines::rows ? part.y : part.x);
  }
}

PerSite<float> of_crop(const PerSite<double>& active, const Rect& crop) {
  PerSite<float> out{};
  for (int site = 0; site < 4; ++site) {
    out[site] = static_cast<float>(active[site_of(crop.x + (site & 1), crop.y + (site >> 1))]);
  }
  return out;
}

PerSite<float> site_gains(const RawDn& raw, const std::array<float, 3>& white_gain, const PerSite<double>& at_white,
                          const Rect& crop) {
  PerSite<double> gain{};
  for (int site = 0; site < 4; ++site) {
    const int colour = static_cast<int>(colour_at(raw.phase, site & 1, site >> 1));
    gain[site] = white_gain[colour] / at_white[site];
  }
  return of_crop(gain, crop);
}

}  // namespace lowlux::isp
