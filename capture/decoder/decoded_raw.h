#pragma once

#include <cstdint>
#include <type_traits>

#include "isp/base/plane.h"

namespace lowlux::capture {

/// Lists how decoding in the separate program ends.
enum class DecodeOutcome : std::uint32_t {
  crashed = 0,  // zero, the value of fresh memory: nothing was written
  decoded,
  unsupported,   // `reason` states why
  not_raw,       // unknown to the decoder
  damaged,       // `reason` is the decoder's message
  too_large,     // `raw_width` x `raw_height` x `samples` is over the limit
  out_of_memory  // within the limits set for the decoder
};

/// Header that the decoder reports for a file: fixed-size fields only, because it comes from another process as bytes.
/// None of it is trusted: every value came from the file, through a library that may have errors.
struct DecodedHeader {
  DecodeOutcome outcome;
  char reason[192];

  std::int32_t raw_width, raw_height, samples;  // size of the readout; samples per pixel, 1 or 3
  std::int32_t left, top, width, height;        // the visible area
  std::int32_t masks[8][4];                     // top, left, bottom, right in the readout, ends excluded
  std::int32_t flip;                            // bit 0 mirrors x, bit 1 mirrors y, bit 2 then transposes
  std::uint32_t filters;                        // 0: none; 9: X-Trans; else dcraw's pattern, 2 bits a site, 8 x 2 sites
  std::uint8_t x_trans[36];                     // colours of 6 x 6 sites from the corner of the visible area
  std::uint32_t black, channel_black[4];        // to be added, see decoder_black()
  std::int32_t pattern_rows, pattern_columns;
  std::uint32_t pattern_black[4098];
  std::uint32_t maximum;
  float camera_multiplier[4];  // R, G, B, second G; 0 or less where unknown
  float xyz_to_camera[3][3];   // all 0 where unknown
  float camera_to_srgb[3][3];  // matrix of white-balanced camera RGB; all 0 if unknown or given by xyz_to_camera
  std::uint32_t dng_version;
  std::uint32_t is_guessed_by_size;  // 1: the file has no header that the decoder knows
  double pixel_aspect;
  float iso, exposure_s, f_number, focal_length_mm;  // 0 where unknown
  float sensor_temperature_c, camera_temperature_c;  // below -273 where unknown
  std::int64_t timestamp;                            // seconds since 1970; 0 where unknown
  char make[64], model[64], software[64];
};
static_assert(std::is_trivially_copyable_v<DecodedHeader>);

inline constexpr std::uint32_t x_trans_filters = 9;  // LibRaw's value for X-Trans mosaics

/// Holds the samples that the separate program decoded, and their header.
struct DecodedRaw {
  DecodedHeader header{};
  Plane<std::uint16_t> samples;  // raw_height x (raw_width * samples)
};

/// Limits for reading one file. Each is checked before the memory is allocated or the time is spent.
struct ReadLimits {
  std::uint64_t max_file_bytes = std::uint64_t{2} << 30;
  std::int64_t max_pixels = 400'000'000;  // pixels of the readout, borders included
  double max_decode_cpu_s = 120;          // rounded up to whole seconds; the wall clock gets five times as much
};

}  // namespace lowlux::capture
