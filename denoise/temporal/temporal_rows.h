#pragma once

#include <cstdint>

/// The kernels under TemporalMean: plain types only, as in rows.h. They work on strips of 16 blocks of 8 x 8 sites.
namespace lowlux::denoise::rows {

inline constexpr int motion_block = 8;      // sites, each way
inline constexpr int blocks_of_strip = 16;  // as many as the longest vector has lanes
inline constexpr int sites_of_strip = motion_block * blocks_of_strip;

/// Noise of R, G, B.
struct SiteNoise {
  float dark_e[3];
  float variance_e2[3];
  float least_e2[3];      // floor of the variance that a mean tells
  float saturation_e[3];  // without dark charge; at most 1e9, where values end

  bool operator==(const SiteNoise&) const = default;
};

/// As MotionThreshold.
struct Threshold {
  float z;
  float few;
};

/// The rows of a strip, of each pair first that with red. All may be read as far as the strip is long.
struct MotionStrip {
  const float* raw[motion_block];
  const float* mean_e[motion_block];  // of the frames before, in the light of this one, without dark charge
  bool inside[motion_block];          // whether the frame has the row
  int width;                          // sites of the strip that the frame has
  bool red_is_odd;
  float least_weight;  // of the newest frame
  const float* share;  // of each block, before this frame
  SiteNoise noise;
  Threshold alone;
  Threshold beside;
};
/// @param moved  of each block: 2 moved, 1 if one beside it has, 0
void find_motion(const MotionStrip& in, std::uint8_t* moved);

/// Rows of a strip in their order.
struct ScaleStrip {
  float* mean_e[motion_block];
  int rows;
  float light;
  float saturation_e[4];  // without dark charge, of sites as in site_of()
};
/// Brings a mean to other light.
/// @param sums  of the columns, over even rows and over odd ones, afterwards
void scale_mean(const ScaleStrip& in, float (*sums)[sites_of_strip]);

/// Rows of a strip in their order.
struct UpdateStrip {
  const float* raw[motion_block];
  float* mean_e[motion_block];
  float* out[motion_block];  // with dark charge
  int rows;
  float dark_e[4];        // of sites as in site_of()
  float saturation_e[4];  // without dark charge
  const float* weight;    // of the newest frame, for each block; 1: it moved
};
void update_mean(const UpdateStrip& in);

}  // namespace lowlux::denoise::rows
