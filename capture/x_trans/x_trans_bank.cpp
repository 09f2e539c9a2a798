#include "capture/x_trans/x_trans_bank.h"

#include <algorithm>
#include <cassert>
#include <cstddef>

namespace lowlux::capture::x_trans {
namespace {

/// Maps the offset of a site in the orientation of a kind to that in the image: a rotation, with or without a mirror.
struct Mirror {
  int xx, xy, yx, yy;
  int x(int dx, int dy) const { return xx * dx + xy * dy; }
  int y(int dx, int dy) const { return yx * dx + yy * dy; }
};

constexpr Mirror mirrors[] = {{1, 0, 0, 1}, {-1, 0, 0, 1}, {1, 0, 0, -1}, {-1, 0, 0, -1},
                              {0, 1, 1, 0}, {0, -1, 1, 0}, {0, 1, -1, 0}, {0, -1, -1, 0}};

/// The site and target colour in whose orientation the filters of a kind are stored (KINDS of scripts/train-x-trans).
struct Kind {
  int x, y, target;
};
constexpr Kind stored[kinds] = {{0, 0, 0}, {2, 0, 1}, {2, 0, 2}, {2, 2, 0}};

constexpr XTransPhase origin{};

int colour_of(int x, int y) { return static_cast<int>(colour_at(origin, x, y)); }

/// Returns what a colour is to a filter: 0 for that of its site, 1 for its target, 2 for the third.
int role_of(int colour, int own, int target) { return colour == own ? 0 : colour == target ? 1 : 2; }

/// Returns whether the sites around (x, y) have the roles of those around the stored site.
bool is_alike(int x, int y, int target, const Kind& kind, const Mirror& mirror) {
  const int own = colour_of(x, y), stored_own = colour_of(kind.x, kind.y);
  for (int dy = -reach; dy <= reach; ++dy) {
    for (int dx = -reach; dx <= reach; ++dx) {
      const int here = colour_of(x + mirror.x(dx, dy), y + mirror.y(dx, dy));
      if (role_of(here, own, target) != role_of(colour_of(kind.x + dx, kind.y + dy), stored_own, kind.target))
        return false;
    }
  }
  return true;
}

/// Adds a multiple of a stored filter in the orientation of a site.
void add(const Filter& filter, const Mirror& mirror, float factor, PlacedFilter& to) {
  for (int dy = -reach; dy <= reach; ++dy) {
    for (int dx = -reach; dx <= reach; ++dx) {
      const int at = (mirror.y(dx, dy) + reach) * lanes + mirror.x(dx, dy) + reach;
      to[static_cast<std::size_t>(at)] += factor * unit * static_cast<float>(filter[(dy + reach) * side + dx + reach]);
    }
  }
}

void place(int x, int y, std::size_t slot, SiteFilters& site) {
  const int target = site.target[slot];
  for (int k = 0; k < kinds; ++k) {
    if ((site.own == CfaColour::green) != (colour_of(stored[k].x, stored[k].y) == 1)) continue;
    const auto* const m = std::find_if(std::begin(mirrors), std::end(mirrors),
                                       [&](const Mirror& mirror) { return is_alike(x, y, target, stored[k], mirror); });
    if (m == std::end(mirrors)) continue;
    const auto kind = static_cast<std::size_t>(k);
    // How the terms 1, cos 2a, sin 2a, cos 4a, sin 4a and noise change with the mirror.
    const auto cosine = static_cast<float>(m->xx != 0 ? 1 : -1),
               sine = static_cast<float>(m->xx * m->yy + m->xy * m->yx);
    const std::array<float, terms> sign{1, cosine, sine, 1, cosine * sine, 1};
    for (std::size_t t = 0; t < terms; ++t) add(second_pass[kind][t], *m, sign[t], site.colour[slot][t]);
    add(first_pass[kind], *m, luma_weights[static_cast<std::size_t>(target)], site.luma);
    return;
  }
  assert(false && "every site is like a stored one");
}

SiteFilters filters_of(int x, int y) {
  SiteFilters site;
  site.own = colour_at(origin, x, y);
  const int own = static_cast<int>(site.own);
  site.target = {own == 0 ? 1 : 0, own == 2 ? 1 : 2};
  site.luma[reach * lanes + reach] = luma_weights[static_cast<std::size_t>(own)];
  place(x, y, 0, site);
  place(x, y, 1, site);
  for (int i = 0; i < side * side; ++i) {
    const int dx = i % side - reach, dy = i / side - reach;
    site.is_colour[static_cast<std::size_t>(colour_of(x + dx, y + dy))][(dy + reach) * lanes + dx + reach] = 1;
  }
  const int half = static_cast<int>(triangle.size()) / 2;
  for (int dy = -half; dy <= half; ++dy) {
    for (int dx = -half; dx <= half; ++dx) {
      site.mean_scale[static_cast<std::size_t>(colour_of(x + dx, y + dy))] += triangle[dy + half] * triangle[dx + half];
    }
  }
  for (float& scale : site.mean_scale) scale = 1 / scale;
  return site;
}

}  // namespace

const std::array<SiteFilters, period * period>& filter_bank() {
  static const auto bank = [] {
    std::array<SiteFilters, period * period> all;
    for (int i = 0; i < period * period; ++i) all[static_cast<std::size_t>(i)] = filters_of(i % period, i / period);
    return all;
  }();
  return bank;
}

}  // namespace lowlux::capture::x_trans
