#pragma once

#include <cstdint>

/// The kernels under TemporalMean, with plain types only, as in rows.h. They work on strips of 16 blocks of 8 x 8
/// sites.
namespace lowlux::denoise::rows {

inline constexpr int motion_block = 8;      // sites, each way
inline constexpr int blocks_of_strip = 16;  // number of lanes of the longest vector
inline constexpr int sites_of_strip = motion_block * blocks_of_strip;

/// Noise parameters of R, G, B.
struct SiteNoise {
  float dark_e[3];
  float variance_e2[3];
  float min_e2[3];        // floor of the variance estimated from a mean
  float saturation_e[3];  // without dark charge; at most 1e9, the limit of values

  bool operator==(const SiteNoise&) const = default;
};

/// Plain-type copy of MotionThreshold.
struct Threshold {
  float z;
  float few;
};

/// Input of one strip: its rows, in each pair the row with red first. All may be read over the full length of a strip.
struct MotionStrip {
  const float* raw[motion_block];
  const float* mean_e[motion_block];  // mean of the previous frames, in the light of this one, without dark charge
  bool inside[motion_block];          // whether the frame has the row
  int width;                          // sites of the strip that the frame has
  bool red_is_odd;
  float min_weight;    // smallest weight of the newest frame
  const float* share;  // variance ratio of each block, before this frame
  SiteNoise noise;
  Threshold alone;
  Threshold beside;
};
/// For each block and R, G, B: the sum of the differences from the mean, each over its variance, the variance of that
/// sum, and the number of sites that count over 1 + share; 0 for a block that moved.
struct BlockSteps {
  float sum[3][blocks_of_strip];
  float variance[3][blocks_of_strip];
  float count[3][blocks_of_strip];
};
/// Compares a strip with the mean.
/// @param moved  for each block: 2 if it moved, 1 if it counts as moved next to a block that moved, else 0
void find_motion(const MotionStrip& in, std::uint8_t* moved, BlockSteps& steps);

/// The rows of a strip to be scaled, in their order.
struct ScaleStrip {
  float* mean_e[motion_block];
  int rows;
  float light;
  float saturation_e[4];  // without dark charge, of sites as in site_of()
};
/// Scales a mean to a change of light.
/// @param sums  sums of the columns, over even rows and over odd ones, after scaling
void scale_mean(const ScaleStrip& in, float (*sums)[sites_of_strip]);

/// The rows of a strip to be updated, in their order.
struct UpdateStrip {
  const float* raw[motion_block];
  const float* before_e[motion_block];  // the mean of the previous frames, as in MotionStrip
  float* mean_e[motion_block];          // the new mean; may be before_e
  float* out[motion_block];             // the new mean, with dark charge
  int rows;
  float dark_e[4];        // dark charge of the sites, in the order of site_of()
  float saturation_e[4];  // without dark charge
  const float* weight;    // weights of the newest frame, for each block; 1 if it moved
};
void update_mean(const UpdateStrip& in);

}  // namespace lowlux::denoise::rows
