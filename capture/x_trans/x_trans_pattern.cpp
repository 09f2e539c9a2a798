#include "capture/x_trans/x_trans_pattern.h"

#include <cstddef>

namespace lowlux::capture {
namespace {

constexpr int period = x_trans_period;
// Blocks of 3 x 3 sites with green in the centre and the corners, as on a chessboard: in one half of them red is left
// and right of the centre and blue above and below it, in the other half the reverse.
constexpr std::uint8_t colours[period][period] = {{1, 1, 0, 1, 1, 2}, {1, 1, 2, 1, 1, 0}, {2, 0, 1, 0, 2, 1},
                                                  {1, 1, 2, 1, 1, 0}, {1, 1, 0, 1, 1, 2}, {0, 2, 1, 2, 0, 1}};

int wrapped(int i) { return (i % period + period) % period; }

bool is_phase(std::span<const std::uint8_t> pattern, const XTransPhase& phase) {
  for (int i = 0; i < period * period; ++i) {
    if (pattern[static_cast<std::size_t>(i)] != static_cast<int>(colour_at(phase, i % period, i / period)))
      return false;
  }
  return true;
}

}  // namespace

CfaColour colour_at(const XTransPhase& phase, int x, int y) {
  return static_cast<CfaColour>(colours[wrapped(phase.y + wrapped(y))][wrapped(phase.x + wrapped(x))]);
}

XTransPhase phase_of_crop(const XTransPhase& phase, int x, int y) {
  return {wrapped(phase.x + wrapped(x)), wrapped(phase.y + wrapped(y))};
}

std::optional<XTransPhase> x_trans_phase(std::span<const std::uint8_t> pattern) {
  if (pattern.size() != std::size_t{period} * period) return std::nullopt;
  for (int i = 0; i < period * period; ++i) {
    const XTransPhase phase{i % period, i / period};
    if (is_phase(pattern, phase)) return phase;
  }
  return std::nullopt;
}

}  // namespace lowlux::capture
