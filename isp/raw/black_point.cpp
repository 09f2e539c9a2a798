#include "isp/raw/black_point.h"

#include <algorithm>
#include <cstddef>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>

namespace lowlux::isp {
namespace {

// Returns the mean of the offsets of every other column or row, from `start`; 0 if there are none.
double mean_offset(const std::vector<double>& offsets, std::size_t start) {
  double sum = 0;
  int n = 0;
  for (std::size_t i = std::min(start, offsets.empty() ? 0 : offsets.size() - 1); i < offsets.size(); i += 2, ++n) {
    sum += offsets[i];
  }
  return n > 0 ? sum / n : 0;
}

// Returns the mean of a tag over all pixels of one site (R, G, B for demosaiced samples).
double site_mean(const BlackLevel& tag, int site) {
  const bool rgb = tag.samples > 1;
  const int step_x = rgb || tag.columns % 2 != 0 ? 1 : 2;
  const int step_y = rgb || tag.rows % 2 != 0 ? 1 : 2;
  const int sample = std::min(site, tag.samples - 1);
  double sum = 0;
  int n = 0;
  for (int y = step_y == 2 ? site >> 1 : 0; y < tag.rows; y += step_y) {
    for (int x = step_x == 2 ? site & 1 : 0; x < tag.columns; x += step_x, ++n) {
      sum += tag.pattern_dn[(y * tag.columns + x) * tag.samples + sample];
    }
  }
  const auto offset = [rgb](const std::vector<double>& offsets, int parity) {
    return rgb ? (mean_offset(offsets, 0) + mean_offset(offsets, 1)) / 2
               : mean_offset(offsets, static_cast<std::size_t>(parity));
  };
  return sum / n + offset(tag.column_dn, site & 1) + offset(tag.row_dn, site >> 1);
}

bool four_figures_do(const BlackLevel& tag) {
  return 2 % tag.rows == 0 && 2 % tag.columns == 0 && tag.column_dn.empty() && tag.row_dn.empty() && tag.samples == 1;
}

Result<BlackPoint> black_from_tag(const RawDn& raw, const std::string& why_not_measured) {
  if (!raw.black_tag) {
    return fail(ErrorCode::insufficient, fmt::format("the file states no black level{}{}; give it with --black DN",
                                                     why_not_measured.empty() ? "" : ", and ", why_not_measured));
  }
  BlackPoint black;
  black.source = BlackPoint::Source::tag;
  for (int site = 0; site < 4; ++site) black.pedestal_dn[site] = site_mean(*raw.black_tag, site);
  if (!four_figures_do(*raw.black_tag)) black.pattern = *raw.black_tag;
  return black;
}

// Adds dark charge to a tag of any layout: its pattern is repeated until each entry belongs to one site.
void add_to_pattern(const PerSite<double>& dark_dn, BlackLevel& tag) {
  const int rows = tag.rows % 2 == 0 ? tag.rows : 2 * tag.rows;
  const int columns = tag.columns % 2 == 0 ? tag.columns : 2 * tag.columns;
  std::vector<double> pattern;
  pattern.reserve(static_cast<std::size_t>(rows) * static_cast<std::size_t>(columns));
  for (int y = 0; y < rows; ++y) {
    for (int x = 0; x < columns; ++x) {
      const int from = y % tag.rows * tag.columns + x % tag.columns;
      pattern.push_back(tag.pattern_dn[static_cast<std::size_t>(from)] + dark_dn[site_of(x, y)]);
    }
  }
  tag.pattern_dn = std::move(pattern);
  tag.rows = rows;
  tag.columns = columns;
}

// Adds known dark charge to a pedestal without. Demosaiced samples, which no profile describes, have none.
BlackPoint with_dark(BlackPoint black, const PerSite<double>& dark_dn) {
  if (dark_dn == PerSite<double>{}) return black;
  for (int site = 0; site < 4; ++site) black.pedestal_dn[site] += dark_dn[site];
  if (black.pattern && black.pattern->samples == 1) add_to_pattern(dark_dn, *black.pattern);
  black.holds = BlackPoint::Holds::pedestal_and_dark;
  return black;
}

Result<BlackPoint> tagged_black(const RawDn& raw, const BlackRequest& request, const std::string& why_not_measured) {
  Result<BlackPoint> black = black_from_tag(raw, why_not_measured);
  if (!black) return black;
  return with_dark(*std::move(black), request.dark_dn);
}

Result<BlackPoint> requested_black(const RawDn& raw, const BlackRequest& request) {
  if (request.choice == BlackChoice::given) {
    return with_dark({.pedestal_dn = request.given_dn, .source = BlackPoint::Source::given}, request.dark_dn);
  }
  if (request.choice == BlackChoice::measured) {
    if (request.measured) return *request.measured;
    return fail(ErrorCode::invalid_argument,
                "a measured black level is requested, but the profile has none: use another profile, or --black DN");
  }
  if (request.choice == BlackChoice::metadata) return tagged_black(raw, request, "");
  // A tag that is finer than four figures is not replaced with four figures.
  const bool tag_is_finer = raw.black_tag && !four_figures_do(*raw.black_tag);
  if (request.choice == BlackChoice::automatic && tag_is_finer) {
    return request.measured ? *request.measured : tagged_black(raw, request, "");
  }
  MaskedBlack measured = measure_masked_black(raw);
  if (measured.black) return *measured.black;
  if (request.choice == BlackChoice::masked) return fail(ErrorCode::insufficient, measured.refusal);
  if (request.measured) return *request.measured;
  if (!raw.black_tag && raw.is_black_zero_by_default && request.use_format_default) {
    return with_dark({.source = BlackPoint::Source::format_default}, request.dark_dn);
  }
  return tagged_black(raw, request, measured.refusal);
}

}  // namespace

MaskedBlack masked_black_of(const RawFrame& frame) {
  MaskedBlack measured = measure_masked_black(frame.raw);
  if (!measured.black || !frame.noise) return measured;
  const double scale = *std::ranges::max_element(frame.noise->scale);
  return measure_masked_black(frame.raw, scale * mean_range_dn(frame.raw, *measured.black));
}

double white_at(const RawDn& raw, int site) {
  if (raw.layout != SensorLayout::bayer) return raw.white_dn[std::min(site, 2)];
  return raw.white_dn[static_cast<int>(colour_at(raw.phase, site & 1, site >> 1))];
}

double mean_range_dn(const RawDn& raw, const BlackPoint& black) {
  double range = 0;
  for (int site = 0; site < 4; ++site) range += (white_at(raw, site) - black.pedestal_dn[site]) / 4;
  return range;
}

Result<BlackPoint> choose_black(const RawDn& raw, const BlackRequest& request) {
  Result<BlackPoint> black = requested_black(raw, request);
  if (!black) return black;
  for (int site = 0; site < 4; ++site) {
    const double white = white_at(raw, site);
    if (!(white > black->pedestal_dn[site])) {
      return fail(ErrorCode::malformed,
                  fmt::format("the white level {:g} DN is not above the black level {:g} DN: give it with --black DN",
                              white, black->pedestal_dn[site]));
    }
  }
  return black;
}

}  // namespace lowlux::isp
