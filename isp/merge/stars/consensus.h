#pragma once

#include <optional>
#include <vector>

#include "isp/merge/stars/star_transform.h"

namespace lowlux::merge {

/// The places of the stars of two frames, by decreasing brightness.
struct PointLists {
  std::vector<Point> reference;
  std::vector<Point> frame;
  double frame_width = 0;
  double frame_height = 0;
};

/// A similarity that is supported by more stars than chance explains.
struct Consensus {
  Similarity similarity;
  double radius_px = 0;  // within which stars agree
  int matched = 0;
  int in_view = 0;
  double log10_false_probability = 0;
  double log10_rival_probability = 0;  // probability of the best different solution; 0 if there is none
};

/// Indices of a point of the reference and the point of the frame that is the same.
struct IndexPair {
  int reference = 0;
  int frame = 0;
};

/// Pairs each point of the frame with at most one of the reference, the closest, within a radius of its place.
/// @param places  places of the points of the reference in the frame
/// @param radius_px  one for each place
std::vector<IndexPair> pair_nearest(const std::vector<Point>& places, const std::vector<double>& radius_px,
                                    const PointGrid& frame);

/// Finds the similarity that most stars agree with: steps 1 and 2 of match_stars.h. Of those found, the one with the
/// smallest false match probability is returned, whatever it is; nullopt if no triangles match. Fainter stars are used
/// until a third of those in view agrees, so that a few bright lamps do not decide.
std::optional<Consensus> find_consensus(const PointLists& lists, double max_scale_change,
                                        double log10_max_false_probability);

}  // namespace lowlux::merge
