#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "capture/camera/camera.h"

namespace lowlux::capture {

/// Metadata of one frame from libcamera, in its units; each control may be absent from any frame.
struct LibcameraValues {
  std::optional<std::int32_t> exposure_us;                  // ExposureTime
  std::optional<float> analogue_gain;                       // AnalogueGain
  std::optional<float> digital_gain;                        // DigitalGain
  std::optional<std::array<std::int32_t, 4>> black_levels;  // SensorBlackLevels: R, Gr, Gb, B of a range of 16 bits
  std::optional<std::array<float, 2>> colour_gains;         // ColourGains: R, B
  std::optional<std::array<float, 9>> colour_matrix;        // ColourCorrectionMatrix, row by row
  std::optional<std::int32_t> colour_temperature_k;         // ColourTemperature
  std::optional<float> lux;                                 // Lux
  std::optional<float> temperature_c;                       // SensorTemperature
};

/// Converts metadata to lowlux's units, for a stream of `bits` per sample.
///     black_level_dn = black_level * 2^bits / 65536
/// (libcamera control_ids: black levels are numbers out of a 16-bit range; fractions are kept.)
/// Each invalid value is left out: exposures, gains and colour temperatures not above 0, black levels outside 0 to
/// 65535, negative lux, temperatures below absolute zero, a colour matrix of zeros, values that are not finite.
FrameFacts frame_facts(const LibcameraValues& values, int bits);

}  // namespace lowlux::capture
