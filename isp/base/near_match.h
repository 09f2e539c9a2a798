#pragma once

#include <span>
#include <string_view>
#include <vector>

namespace lowlux {

/// The names somebody may have meant by one that is unknown: for the cure in an error message.
/// A name is near if `wanted` begins it, or if at most a third of the wanted letters (at least one) have to be
/// inserted, dropped, replaced or swapped with their neighbour: the Damerau-Levenshtein distance in its restricted form
/// (optimal string alignment), where no piece of the text is edited twice. Case does not count (ASCII).
/// @return at most 3, nearest first; at equal distance the longer common beginning, then the order of `known`. They
/// view the text of `known`. Empty if nothing is near, if `wanted` is empty or longer than 64 bytes.
std::vector<std::string_view> near_matches(std::string_view wanted, std::span<const std::string_view> known);

}  // namespace lowlux
