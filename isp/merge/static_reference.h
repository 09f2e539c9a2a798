#pragma once

#include <cstdint>
#include <vector>

#include "isp/base/executor.h"
#include "isp/base/plane.h"
#include "isp/merge/block_test.h"

namespace lowlux::merge {

/// Holds the mosaic that the frames of a camera at rest are compared with.
struct StaticReference {
  Plane<float> mosaic;
  Plane<std::uint8_t> is_single;  // like Comparison::block_matches: 1 where the mosaic is the reference frame alone
};

/// Lists which scene counts where the reference frame shows another one than the others.
enum class Scene : std::uint8_t {
  majority,   // content on which more than half of all frames agree, else that of the reference frame
  reference,  // content of the reference frame
};

/// Returns the mean of the reference frame and of the robust mean of other frames where both show the same scene, and
/// the reference frame alone where they do not, so that other frames are compared with the scene of the reference. With
/// Scene::majority, blocks hold the robust mean alone where more than half of all frames match it.
///
/// The reference frame is compared with the robust mean (compare_mosaics) in blocks at four positions, half a block
/// apart, so that one of them covers most of a small object. Blocks that differ at a false alarm of 0.5 % count if they
/// touch one that differs at the stated rate, directly or by others. Up to a quarter of the sites of a block may be
/// outliers that are brighter than the scene (cosmic rays, a satellite); they do not count in the mean. A block with
/// more of them, or with two darker ones, shows an object of the reference frame.
/// @param reference  height x width; NaN: no value
/// @param others     1..16 mosaics of the same size and light
/// @param noise      that of one frame
/// @param options    false alarms of the comparison: up to four times the fraction of blocks of a static scene become
///                   those of the reference alone, each with the blocks around it
StaticReference make_static_reference(Plane<float> reference, std::vector<Plane<float>> others,
                                      const MosaicNoise& noise, const ComparisonOptions& options, Scene scene,
                                      Executor& executor);

}  // namespace lowlux::merge
