#pragma once

/// Demosaicing works on encoded values: see demosaic.h. Kernel sources, which are compiled for several instruction
/// sets, share these plain types.
namespace lowlux::isp::rows {

/// Holds the constants of u = cbrt(x + offset): the offset, limited to 1e-6..1, and the slope at x = 0.
struct Encoding {
  float offset;
  float slope;
};

/// These are the limits of values that are encoded.
inline constexpr float encoding_min = -1;
inline constexpr float encoding_max = 1e9f;

}  // namespace lowlux::isp::rows
