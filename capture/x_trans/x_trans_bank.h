#pragma once

#include <array>

#include "capture/x_trans/x_trans_filters.h"
#include "capture/x_trans/x_trans_pattern.h"

namespace lowlux::capture::x_trans {

inline constexpr int period = x_trans_period;
inline constexpr int lanes = 8;                                             // taps in a row of a filter, the last is 0
inline constexpr std::array<float, 3> luma_weights{0.25F, 0.5F, 0.25F};     // of R, G, B
inline constexpr std::array<float, 9> triangle{1, 2, 3, 4, 5, 4, 3, 2, 1};  // weights of local means, along each axis

/// A filter in the orientation of its site: `side` rows of `lanes`.
using PlacedFilter = std::array<float, static_cast<std::size_t>(side) * lanes>;

/// Holds the filters of one of the 36 sites of the pattern.
struct SiteFilters {
  CfaColour own{};
  std::array<int, 2> target{};                              // the two colours that are not measured there
  std::array<std::array<PlacedFilter, terms>, 2> colour{};  // of each target, for each term of the second pass
  PlacedFilter luma{};                                      // of the first pass
  std::array<PlacedFilter, 3> is_colour{};                  // 1 at sites of R, G, B, else 0
  std::array<float, 3> mean_scale{};                        // 1 / sum of the triangle's weights at sites of R, G, B
};

/// Returns the filters of all sites of phase (0, 0), row after row. They are placed once.
const std::array<SiteFilters, period * period>& filter_bank();

}  // namespace lowlux::capture::x_trans
