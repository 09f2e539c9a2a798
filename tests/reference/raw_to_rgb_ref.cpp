#include "tests/reference/raw_to_rgb_ref.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>

namespace lowlux::reference {
namespace {

int mirrored(int i, int n) {
  if (n == 1) return 0;
  while (i < 0 || i >= n) i = i < 0 ? -i : 2 * (n - 1) - i;
  return i;
}

double defined(float sample) { return std::isnan(sample) ? 0.0 : std::clamp(static_cast<double>(sample), -1e9, 1e9); }

}  // namespace

double LinearisedMosaic::at(int x, int y) const {
  return value[static_cast<std::size_t>(mirrored(y, height)) * width + mirrored(x, width)];
}

LinearisedMosaic linearised(const isp::DnMosaic& in) {
  LinearisedMosaic out{in.dn.width, in.dn.height, in.phase, {}};
  for (int y = 0; y < out.height; ++y) {
    for (int x = 0; x < out.width; ++x) {
      const int site = site_of(x, y);
      out.value.push_back((in.dn.at(x, y) - static_cast<double>(in.levels.black[site])) * in.levels.gain[site]);
    }
  }
  return out;
}

LinearisedMosaic linearised(const isp::SignedMosaic& in) {
  LinearisedMosaic out{in.value.width, in.value.height, in.phase, {}};
  for (int y = 0; y < out.height; ++y) {
    for (int x = 0; x < out.width; ++x) out.value.push_back(defined(in.value.at(x, y)) * in.gain[site_of(x, y)]);
  }
  return out;
}

Rgb malvar(const LinearisedMosaic& mosaic, int x, int y) {
  const auto m = [&](int dx, int dy) { return mosaic.at(x + dx, y + dy); };
  const double centre = m(0, 0);
  const double near_h = m(-1, 0) + m(1, 0), near_v = m(0, -1) + m(0, 1);
  const double far_h = m(-2, 0) + m(2, 0), far_v = m(0, -2) + m(0, 2);
  const double diagonal = m(-1, -1) + m(1, -1) + m(-1, 1) + m(1, 1);

  // Red or blue at green: its neighbours lie in the row (h) or in the column (v).
  const double in_row = (5 * centre + 4 * near_h - diagonal - far_h + 0.5 * far_v) / 8;
  const double in_column = (5 * centre + 4 * near_v - diagonal - far_v + 0.5 * far_h) / 8;
  const double green = (4 * centre + 2 * (near_h + near_v) - (far_h + far_v)) / 8;
  const double opposite = (6 * centre + 2 * diagonal - 1.5 * (far_h + far_v)) / 8;

  switch (colour_at(mosaic.phase, x, y)) {
    case CfaColour::red:
      return {centre, green, opposite};
    case CfaColour::blue:
      return {opposite, green, centre};
    case CfaColour::green:
      break;
  }
  const bool red_in_row = (y & 1) == red_row(mosaic.phase);
  return {red_in_row ? in_row : in_column, centre, red_in_row ? in_column : in_row};
}

Rgb camera_rgb(const isp::CameraPlanes& in, int x, int y) {
  Rgb out{};
  for (int c = 0; c < 3; ++c) out[c] = defined(in.rgb[c].at(x, y)) * in.gain[c];
  return out;
}

Rgb moved_into_gamut(const Rgb& v, const std::array<float, 3>& luminance) {
  const double y = luminance[0] * v[0] + luminance[1] * v[1] + luminance[2] * v[2];
  Rgb out = v;
  if (const double least = std::min({v[0], v[1], v[2]}); least < 0) {
    if (y <= 0) return {0, 0, 0};
    for (double& c : out) c = y + y / (y - least) * (c - y);
  }
  const auto [least, greatest] = std::minmax({out[0], out[1], out[2]});
  if (greatest <= 1) return out;
  if (least >= 1) return {1, 1, 1};
  for (double& c : out) c = least + (1 - least) / (greatest - least) * (c - least);
  return out;
}

Rgb seen(const Rgb& v, const LookGrid& look, int x, int y) {
  const auto interpolated = [&](LookGrid::Part part) {
    const PlaneView<const float>& cells = look.part[part];
    const auto at = [&](int column, int row) -> double {
      return cells.at(std::clamp(column, 0, cells.width - 1), std::clamp(row, 0, cells.height - 1));
    };
    const double u = (x + 0.5) / LookGrid::cell - 0.5, w = (y + 0.5) / LookGrid::cell - 0.5;
    const int column = static_cast<int>(std::floor(u)), row = static_cast<int>(std::floor(w));
    const double right = u - column, down = w - row;
    return (1 - down) * ((1 - right) * at(column, row) + right * at(column + 1, row)) +
           down * ((1 - right) * at(column, row + 1) + right * at(column + 1, row + 1));
  };
  double light = 0, rods = 0;
  for (int c = 0; c < 3; ++c) {
    light += look.luminance[c] * v[c];
    rods += look.rods[c] * v[c];
  }
  rods = std::max(rods, std::min(LookGrid::min_rods * light, light));
  const double perceived = light + interpolated(LookGrid::rod_fraction) * (rods - light);
  const double chroma =
      interpolated(LookGrid::chroma) * (std::max(perceived, 0.0) + look.dark) / (std::max(light, 0.0) + look.dark);
  Rgb out{};
  for (int c = 0; c < 3; ++c) {
    out[c] = (interpolated(LookGrid::base) + interpolated(LookGrid::detail) * perceived) *
                 (1 + interpolated(LookGrid::blue) * look.tint[c]) +
             chroma * (v[c] - light);
  }
  return out;
}

Rgb transformed(const Rgb& camera, const isp::RgbTransform& transform) {
  Rgb out{};
  for (int j = 0; j < 3; ++j) {
    for (int c = 0; c < 3; ++c) {
      out[j] += transform.matrix[3 * j + c] * std::min(camera[c], static_cast<double>(transform.clip));
    }
  }
  return transform.move_into_gamut ? moved_into_gamut(out, transform.luminance) : out;
}

double srgb_encoded(double v) {
  const double clamped = std::clamp(v, 0.0, 1.0);
  return clamped <= 0.0031308 ? 12.92 * clamped : 1.055 * std::pow(clamped, 1 / 2.4) - 0.055;
}

ToneTable srgb_tone_table() {
  ToneTable table;
  table.offset = 0x1p-7f;
  table.shift = 14;  // 512 bins per octave, the lowest of 2^-16: 3584 and the one of v = 1
  table.bins = table.bin_of(1.0f) + 1;
  const auto lower_edge = [&](int bin) {
    const auto bits = table.base_bits() + (static_cast<std::uint32_t>(bin) << table.shift);
    return static_cast<double>(std::bit_cast<float>(bits)) - table.offset;
  };
  for (int bin = 0; bin <= table.bins; ++bin) table.edge[bin] = static_cast<float>(srgb_encoded(lower_edge(bin)));
  for (int bin = 0; bin < table.bins; ++bin) {
    const double middle = 0.5 * (lower_edge(bin) + lower_edge(bin + 1));
    table.code8[bin] = static_cast<std::int32_t>(std::lround(255 * srgb_encoded(middle)));
  }
  return table;
}

}  // namespace lowlux::reference
