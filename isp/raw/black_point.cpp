#include "isp/raw/black_point.h"

#include <algorithm>

#include <fmt/format.h>

#include "isp/raw/masked_black.h"

namespace lowlux::isp {
namespace {

Result<BlackPoint> black_from_tag(const RawDn& raw) {
  if (!raw.black_tag) {
    return fail(ErrorCode::insufficient,
                "the file states no black level and has no masked pixels to measure it on; black is not guessed: "
                "give it with --black DN");
  }
  const BlackLevel& tag = *raw.black_tag;
  BlackPoint black;
  black.source = BlackPoint::Source::tag;
  const int last = tag.samples - 1;
  for (int site = 0; site < 4; ++site) black.pedestal_dn[site] = tag.at(site & 1, site >> 1, std::min(site, last));
  const bool four_do =
      2 % tag.rows == 0 && 2 % tag.columns == 0 && tag.column_dn.empty() && tag.row_dn.empty() && tag.samples == 1;
  if (!four_do) black.pattern = tag;
  return black;
}

Result<BlackPoint> black_from_masked_pixels(const RawDn& raw) {
  MaskedBlack measured = measure_masked_black(raw);
  if (!measured.black) return fail(ErrorCode::insufficient, measured.refusal);
  return *measured.black;
}

Result<BlackPoint> requested_black(const RawDn& raw, const BlackRequest& request) {
  switch (request.choice) {
    case BlackChoice::given:
      return BlackPoint{.pedestal_dn = request.given_dn, .source = BlackPoint::Source::given};
    case BlackChoice::metadata:
      return black_from_tag(raw);
    case BlackChoice::masked:
      return black_from_masked_pixels(raw);
    case BlackChoice::automatic:
      break;
  }
  // Per-row and per-column offsets are finer than four figures: a tag that has them is not replaced.
  const bool tag_is_finer = raw.black_tag && (!raw.black_tag->column_dn.empty() || !raw.black_tag->row_dn.empty());
  if (!tag_is_finer) {
    if (Result<BlackPoint> measured = black_from_masked_pixels(raw)) return measured;
  }
  return black_from_tag(raw);
}

}  // namespace

double white_at(const RawDn& raw, int site) {
  if (raw.layout != SensorLayout::bayer) return raw.white_dn[std::min(site, 2)];
  return raw.white_dn[static_cast<int>(colour_at(raw.phase, site & 1, site >> 1))];
}

Result<BlackPoint> choose_black(const RawDn& raw, const BlackRequest& request) {
  Result<BlackPoint> black = requested_black(raw, request);
  if (!black) return black;
  for (int site = 0; site < 4; ++site) {
    const double white = white_at(raw, site);
    if (!(white > black->pedestal_dn[site])) {
      return fail(ErrorCode::malformed,
                  fmt::format("the white level {:g} DN is not above black {:g} DN", white, black->pedestal_dn[site]));
    }
  }
  return black;
}

}  // namespace lowlux::isp
