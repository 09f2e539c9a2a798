#include "capture/dng/dng_levels.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "capture/dng/dng_file.h"
#include "capture/dng/dng_tags.h"
#include "capture/file/pass_on.h"
#include "isp/base/text.h"

namespace lowlux::capture {
namespace {

constexpr int max_pattern = 4096;  // maximum number of values of a black level pattern: more indicate damage
constexpr std::size_t max_masked_numbers = 1024;  // four for each area
constexpr double max_level_dn = 65535;
constexpr double min_float_white_dn = 1e-6, max_float_white_dn = 4294967295.0;

/// Returns the rectangle of four numbers top, left, bottom, right; nullopt unless all are valid and it is not empty and
/// in the readout.
std::optional<Rect> rect_inside(const double* edges, int width, int height) {
  const double top = edges[0], left = edges[1], bottom = edges[2], right = edges[3];
  if (!(top >= 0 && left >= 0 && bottom > top && right > left && bottom <= height && right <= width))
    return std::nullopt;
  for (int i = 0; i < 4; ++i) {
    if (edges[i] != std::floor(edges[i])) return std::nullopt;
  }
  return Rect{static_cast<int>(left), static_cast<int>(top), static_cast<int>(right - left),
              static_cast<int>(bottom - top)};
}

tl::unexpected<Error> bad_rect(TagName name, const double* edges, const DngImage& image) {
  std::string message = std::string("the tag ") + name.name + " (top " + number_text(edges[0]) + ", left " +
                        number_text(edges[1]) + ", bottom " + number_text(edges[2]) + ", right " +
                        number_text(edges[3]) + ") is not a rectangle inside the " + std::to_string(image.width) +
                        " x " + std::to_string(image.height) + " pixels";
  return fail(ErrorCode::malformed, std::move(message), name.name);
}

/// Reads the areas of the tag MaskedAreas; nullopt if there is no such tag.
Result<std::optional<std::vector<Rect>>> read_masked(const TiffDirectory& directory, const DngImage& image) {
  auto masked = directory.numbers(tag::masked_areas, 4, max_masked_numbers);
  if (!masked) return pass_on(masked);
  if (!*masked) return std::nullopt;
  const std::vector<double>& edges = **masked;
  if (edges.size() % 4 != 0) {
    return fail(ErrorCode::malformed,
                "the tag MaskedAreas has " + std::to_string(edges.size()) + " values, expected four for each rectangle",
                tag::masked_areas.name);
  }
  std::vector<Rect> areas;
  for (std::size_t i = 0; i + 4 <= edges.size(); i += 4) {
    const auto rect = rect_inside(&edges[i], image.width, image.height);
    if (!rect) return bad_rect(tag::masked_areas, &edges[i], image);
    areas.push_back(*rect);
  }
  return areas;
}

/// Reads the default crop: stated in (rational) pixels from the corner of the active area; rounded to integers. nullopt
/// if the file states none.
Result<std::optional<Rect>> read_crop(const TiffDirectory& directory, const Rect& active,
                                      std::vector<std::string>& warnings) {
  auto origin = directory.numbers(tag::default_crop_origin, 2, 2);
  if (!origin) return pass_on(origin);
  auto size = directory.numbers(tag::default_crop_size, 2, 2);
  if (!size) return pass_on(size);
  if (!*size) return std::nullopt;
  const double x = *origin ? std::round((**origin)[0]) : 0, y = *origin ? std::round((**origin)[1]) : 0;
  const double right = std::round(x + (**size)[0]), bottom = std::round(y + (**size)[1]);
  const double inner_right = std::min<double>(right, active.width),
               inner_bottom = std::min<double>(bottom, active.height);
  const bool inside = x >= 0 && y >= 0 && inner_right > x && inner_bottom > y;
  if (!inside || !std::isfinite(right) || !std::isfinite(bottom)) {
    return fail(ErrorCode::malformed,
                std::string("the tag ") + tag::default_crop_size.name + " states a crop outside of the active area",
                tag::default_crop_size.name);
  }
  if (inner_right < right || inner_bottom < bottom) {
    warnings.emplace_back("DefaultCropSize reaches beyond the active area: the part inside is used");
  }
  return Rect{static_cast<int>(x), static_cast<int>(y), static_cast<int>(inner_right - x),
              static_cast<int>(inner_bottom - y)};
}

Result<void> check_finite(const std::vector<double>& values, TagName name) {
  for (const double value : values) {
    if (!std::isfinite(value)) {
      return fail(ErrorCode::malformed, std::string("the tag ") + name.name + " holds a value that is not a number",
                  name.name);
    }
  }
  return {};
}

/// Reads one offset for each active column or row; empty if there is no such tag.
Result<std::vector<double>> read_deltas(const TiffDirectory& directory, TagName name, int expected) {
  auto deltas = directory.numbers(name, expected, expected);
  if (!deltas) return pass_on(deltas);
  if (!*deltas) return std::vector<double>{};
  if (auto finite = check_finite(**deltas, name); !finite) return pass_on(finite);
  return **std::move(deltas);
}

/// Returns the side of the repeating cell of a mosaic; 1 of other images.
int mosaic_side(const DngImage& image) {
  if (image.layout != SensorLayout::bayer) return 1;
  if (image.x_trans) return 6;
  return image.quad_bayer ? 4 : 2;
}

/// Reads the black level. One value is used for all pixels, as some writers mean it. As many values as the cell of the
/// mosaic has sites are used for these sites if the file states no pattern: DNG's default of 1 x 1 leaves them none.
Result<BlackLevel> read_black(const TiffDirectory& directory, std::vector<double> stated, const DngImage& image,
                              const RawDn& raw, std::vector<std::string>& warnings) {
  BlackLevel black;
  const int samples = black.samples = image.samples;
  auto repeat = directory.numbers(tag::black_level_repeat_dim, 2, 2);
  if (!repeat) return pass_on(repeat);
  if (*repeat) {
    const double rows = (**repeat)[0], columns = (**repeat)[1];
    const bool whole = rows == std::floor(rows) && columns == std::floor(columns);
    if (!(whole && rows >= 1 && columns >= 1 && rows * columns * samples <= max_pattern)) {
      return fail(ErrorCode::malformed,
                  "the tag BlackLevelRepeatDim says " + number_text(rows) + " x " + number_text(columns),
                  tag::black_level_repeat_dim.name);
    }
    black.rows = static_cast<int>(rows);
    black.columns = static_cast<int>(columns);
  } else if (const int side = mosaic_side(image); stated.size() == static_cast<std::size_t>(side) * side && side > 1) {
    black.rows = black.columns = side;
    warnings.push_back("BlackLevel has " + std::to_string(stated.size()) +
                       " values, but BlackLevelRepeatDim is missing: they are used for the " + std::to_string(side) +
                       " x " + std::to_string(side) + " sites of the mosaic");
  }
  const auto expected = static_cast<std::size_t>(black.rows) * black.columns * samples;
  if (stated.size() == 1) stated.resize(expected, stated.front());
  if (stated.size() != expected) {
    return fail(ErrorCode::malformed,
                "the tag BlackLevel has " + std::to_string(stated.size()) + " values, its pattern needs " +
                    std::to_string(expected),
                tag::black_level.name);
  }
  if (auto finite = check_finite(stated, tag::black_level); !finite) return pass_on(finite);
  black.pattern_dn = std::move(stated);
  auto columns = read_deltas(directory, tag::black_level_delta_h, raw.active.width);
  if (!columns) return pass_on(columns);
  black.column_dn = *std::move(columns);
  auto rows = read_deltas(directory, tag::black_level_delta_v, raw.active.height);
  if (!rows) return pass_on(rows);
  black.row_dn = *std::move(rows);
  return black;
}

/// Reads the white level: one for each sample, or one for all; 2^bits - 1 if the file does not state it, and 1 for
/// floating-point samples (DNG 1.4, WhiteLevel).
Result<std::array<double, 3>> read_white(const TiffDirectory& directory, const DngImage& image) {
  auto stated = directory.numbers(tag::white_level, 1, 16);
  if (!stated) return pass_on(stated);
  std::array<double, 3> white{};
  white.fill(image.is_float ? 1 : std::exp2(image.bits) - 1);
  const double least = image.is_float ? min_float_white_dn : 0,
               most = image.is_float ? max_float_white_dn : max_level_dn;
  if (!*stated) return white;
  for (std::size_t i = 0; i < 3; ++i) {
    const double level = (**stated)[std::min(i, std::min<std::size_t>((*stated)->size(), image.samples) - 1)];
    if (!(level > least && level <= most)) {
      return fail(ErrorCode::malformed,
                  "the tag WhiteLevel says " + number_text(level) + ", expected 1 to " + number_text(most),
                  tag::white_level.name);
    }
    white[i] = level;
  }
  return white;
}

double largest(const std::vector<double>& values) {
  return values.empty() ? 0.0 : *std::max_element(values.begin(), values.end());
}

}  // namespace

std::vector<Rect> borders(int width, int height, const Rect& active) {
  const int right = active.x + active.width, bottom = active.y + active.height;
  const Rect candidates[] = {{0, 0, active.x, height},                            // left, over the full height
                             {right, 0, width - right, height},                   // right, likewise
                             {active.x, 0, active.width, active.y},               // above the active area
                             {active.x, bottom, active.width, height - bottom}};  // below it
  std::vector<Rect> found;
  std::copy_if(std::begin(candidates), std::end(candidates), std::back_inserter(found),
               [](const Rect& r) { return r.width > 0 && r.height > 0; });
  return found;
}

Result<void> check_levels(const RawDn& raw, const std::string& source) {
  if (!raw.black_tag) return {};
  const BlackLevel& black = *raw.black_tag;
  const double deltas = largest(black.column_dn) + largest(black.row_dn);
  for (std::size_t i = 0; i < black.pattern_dn.size(); ++i) {
    const double level = black.pattern_dn[i] + deltas;
    const double white = raw.white_dn[black.samples == 3 ? i % 3 : 0];
    if (!(white > level)) {
      return fail(ErrorCode::malformed, "white level " + number_text(white) + " is not above black level " +
                                            number_text(level) + " (" + source + ")");
    }
  }
  return {};
}

Result<void> read_geometry(const TiffDirectory& directory, const DngImage& image, RawDn& raw,
                           std::vector<std::string>& warnings) {
  raw.active = {0, 0, image.width, image.height};
  auto active = directory.numbers(tag::active_area, 4, 4);
  if (!active) return pass_on(active);
  if (*active) {
    const auto rect = rect_inside((*active)->data(), image.width, image.height);
    if (!rect) return bad_rect(tag::active_area, (*active)->data(), image);
    raw.active = *rect;
  }
  auto masked = or_ignored(read_masked(directory, image), warnings);
  raw.masked_is_stated = masked.has_value();
  raw.masked = masked ? *std::move(masked) : borders(image.width, image.height, raw.active);
  const auto crop = or_ignored(read_crop(directory, raw.active, warnings), warnings);
  raw.default_crop = crop.value_or(Rect{0, 0, raw.active.width, raw.active.height});
  const auto scale = or_ignored(read_scale(directory), warnings);
  if (scale && (*scale)[0] != (*scale)[1]) {
    warnings.emplace_back("DefaultScale is not applied: the pixels are not square");
  }
  return {};
}

Result<std::optional<std::vector<double>>> read_scale(const TiffDirectory& directory) {
  auto scale = directory.numbers(tag::default_scale, 2, 2);
  if (!scale || !*scale) return scale;
  for (const double value : **scale) {
    if (!std::isfinite(value) || value <= 0) {
      return fail(ErrorCode::malformed,
                  "the tag DefaultScale holds " + number_text(value) + ", expected numbers above 0",
                  tag::default_scale.name);
    }
  }
  return scale;
}

Result<void> read_levels(const TiffDirectory& directory, const DngImage& image, RawDn& raw,
                         std::vector<std::string>& warnings) {
  auto white = read_white(directory, image);
  if (!white) return pass_on(white);
  raw.white_dn = *white;
  auto stated = directory.numbers(tag::black_level, 1, max_pattern);
  if (!stated) return pass_on(stated);
  if (*stated) {
    auto black = read_black(directory, **std::move(stated), image, raw, warnings);
    if (!black) return pass_on(black);
    raw.black_tag = *std::move(black);
  } else if (image.is_float || image.samples > 1) {
    raw.black_tag = BlackLevel{.samples = image.samples,
                               .pattern_dn = std::vector<double>(static_cast<std::size_t>(image.samples), 0.0)};
  } else {  // the codes of a sensor seldom have the default: masked pixels, a profile and the user know better
    raw.is_black_zero_by_default = true;
  }
  return check_levels(raw, "tags WhiteLevel and BlackLevel");
}

Result<void> apply_linearization_table(const TiffDirectory& directory, Plane<std::uint16_t>& codes) {
  constexpr std::size_t all_codes = 65536;
  auto table = directory.numbers(tag::linearization_table, 1, all_codes);
  if (!table) return pass_on(table);
  if (!*table) return {};
  if (auto finite = check_finite(**table, tag::linearization_table); !finite) return finite;
  std::vector<std::uint16_t> linear;
  for (const double dn : **table) linear.push_back(static_cast<std::uint16_t>(std::clamp(dn, 0.0, max_level_dn)));
  linear.resize(all_codes, linear.back());
  std::transform(codes.data(), codes.data() + codes.size(), codes.data(),
                 [&](std::uint16_t code) { return linear[code]; });
  return {};
}

}  // namespace lowlux::capture
