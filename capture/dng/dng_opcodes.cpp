#include "capture/dng/dng_opcodes.h"

#include <algorithm>
#include <array>
#include <bitset>
#include <cmath>
#include <cstdint>
#include <iterator>
#include <optional>
#include <string>
#include <utility>

#include "capture/dng/dng_tags.h"
#include "capture/file/pass_on.h"

namespace lowlux::capture {
namespace {

constexpr std::size_t max_opcodes = 64;  // cameras write some
constexpr std::size_t opcode_header_bytes = 16;

// Cameras write four gain maps and some thousand defects.
constexpr std::size_t max_defects = std::size_t{1} << 20;  // in all lists
constexpr std::size_t max_gains = 64;                      // in all lists
constexpr std::uint32_t fix_vignette_radial = 3, fix_bad_pixels_constant = 4, fix_bad_pixels_list = 5,
                        map_polynomial = 8, gain_map = 9, scale_per_row = 12, scale_per_column = 13;

/// Returns the name of an opcode, DNG 1.4 chapter 7 and DNG 1.6.
std::string opcode_name(std::uint32_t id) {
  constexpr const char* names[] = {
      "opcode 0",         "WarpRectilinear", "WarpFisheye", "FixVignetteRadial", "FixBadPixelsConstant",
      "FixBadPixelsList", "TrimBounds",      "MapTable",    "MapPolynomial",     "GainMap",
      "DeltaPerRow",      "DeltaPerColumn",  "ScalePerRow", "ScalePerColumn",    "WarpRectilinear2"};
  return id < std::size(names) ? names[id] : "opcode " + std::to_string(id);
}

/// State of one list while it is read. Its results are added to the frame only when all of the list has been read.
struct OpcodeContext {
  int list;
  SampleState samples;
  const RawFrame& frame;
  RawCorrections& found;
  std::bitset<65536>& constants;  // values of defective pixels
  std::vector<std::string>& warnings;

  std::string tag() const { return "OpcodeList" + std::to_string(list); }
  void not_applied(std::uint32_t id, const std::string& why = {}) const {
    warnings.push_back(opcode_name(id) + " (" + tag() + ") is not applied" + why);
  }
  tl::unexpected<Error> damaged(std::uint32_t id) const {
    return fail(ErrorCode::malformed, opcode_name(id) + " of the tag " + tag() + " is damaged", tag());
  }
  Result<void> check_gains(std::size_t more) const {
    const RawCorrections& before = frame.corrections;
    const std::size_t gains =
        before.gain_maps.size() + before.radial_gains.size() + found.gain_maps.size() + found.radial_gains.size();
    if (gains + more <= max_gains) return {};
    return fail(ErrorCode::malformed, "the tag " + tag() + " asks for more gain maps than any camera writes", tag());
  }
  std::size_t room_for_defects() const { return max_defects - frame.corrections.defects.size() - found.defects.size(); }
};

/// Returns the gains for one colour of a mosaic, as a map that applies only to the sites of that colour in one of the
/// cell's rows.
GainMap map_of_sites(const GainMap& all, int site_x, int site_y, int plane) {
  GainMap one = all;
  one.top += (all.top & 1) != site_y;
  one.left += (all.left & 1) != site_x;
  one.row_pitch = one.column_pitch = 2;
  one.first_plane = 0;
  one.planes = one.map_planes = 1;
  const int map_plane = std::clamp(plane - all.first_plane, 0, all.map_planes - 1);
  const std::size_t points = static_cast<std::size_t>(all.points_v) * all.points_h;
  one.gain.resize(points);
  for (std::size_t i = 0; i < points; ++i) one.gain[i] = all.gain[i * all.map_planes + map_plane];
  return one;
}

/// Adds a map of demosaiced data that differs between colours, split into maps of the mosaic's four sites.
void add_split(const OpcodeContext& context, const GainMap& map) {
  for (int y = 0; y < 2; ++y) {
    for (int x = 0; x < 2; ++x) {
      const int plane = static_cast<int>(colour_at(context.frame.raw.phase, x, y));
      if (plane < map.first_plane || plane >= map.first_plane + map.planes) continue;
      GainMap one = map_of_sites(map, x, y, plane);
      if (one.top < one.bottom && one.left < one.right) context.found.gain_maps.push_back(std::move(one));
    }
  }
}

/// Adds a map of an X-Trans mosaic to the planes that are made of it.
void add_to_all_planes(const OpcodeContext& context, std::uint32_t id, GainMap map) {
  if (map.row_pitch != 1 || map.column_pitch != 1 || map.map_planes != 1) {
    return context.not_applied(id, ": it skips sites of an X-Trans mosaic");
  }
  map.first_plane = 0;
  map.planes = 3;
  context.found.gain_maps.push_back(std::move(map));
}

bool is_usable(const GainMap& map) {
  return map.row_pitch >= 1 && map.column_pitch >= 1 && map.points_v >= 1 && map.points_h >= 1 && map.map_planes >= 1 &&
         std::isfinite(map.spacing_v) && std::isfinite(map.spacing_h) && std::isfinite(map.origin_v) &&
         std::isfinite(map.origin_h) && (map.points_v == 1 || map.spacing_v > 0) &&
         (map.points_h == 1 || map.spacing_h > 0) &&
         std::all_of(map.gain.begin(), map.gain.end(), [](float g) { return std::isfinite(g) && g >= 0; });
}

int small(std::uint32_t value) { return static_cast<int>(std::min<std::uint32_t>(value, 1U << 30)); }

/// Reads the pixels that a map applies to, which may be none, and its planes.
void read_area(const Rect& active, OpcodeReader& in, GainMap& map) {
  map.top = small(in.u32());
  map.left = small(in.u32());
  map.bottom = std::min(small(in.u32()), active.height);
  map.right = std::min(small(in.u32()), active.width);
  map.first_plane = small(in.u32());
  map.planes = small(in.u32());
  map.row_pitch = small(in.u32());
  map.column_pitch = small(in.u32());
}

/// Adds the map of an opcode, unless its list or the layout of the image does not let it be applied.
Result<void> add_gains(const OpcodeContext& context, std::uint32_t id, GainMap map) {
  if (!is_usable(map)) return context.damaged(id);
  if (map.top >= map.bottom || map.left >= map.right) return {};  // it applies to no pixel
  const SensorLayout layout = context.frame.raw.layout;
  const bool mosaic = layout == SensorLayout::bayer;
  const bool alike = map.first_plane == 0 && map.planes >= 3 && map.map_planes == 1;
  const bool split = context.list == 3 && mosaic && !alike;
  const bool is_one_plane =
      layout == SensorLayout::monochrome || (context.list == 2 && (mosaic || context.samples.is_x_trans));
  if (auto room = context.check_gains(split ? 4 : 1); !room) return room;
  if (context.list == 1) {
    context.not_applied(id, ": it is meant for values that still hold the black level");
  } else if (map.first_plane >= (is_one_plane ? 1 : 3)) {
    context.not_applied(id, ": the image has no colour of its number");
  } else if (context.list == 2 && context.samples.is_x_trans) {
    add_to_all_planes(context, id, std::move(map));
  } else if (split && (map.row_pitch != 1 || map.column_pitch != 1)) {
    context.not_applied(id, ": it skips rows or columns of demosaiced data");
  } else if (split) {
    add_split(context, map);
  } else {
    context.found.gain_maps.push_back(std::move(map));
  }
  return {};
}

Result<void> read_gain_map(const OpcodeContext& context, OpcodeReader in) {
  GainMap map;
  read_area(context.frame.raw.active, in, map);
  map.points_v = small(in.u32());
  map.points_h = small(in.u32());
  map.spacing_v = in.f64();
  map.spacing_h = in.f64();
  map.origin_v = in.f64();
  map.origin_h = in.f64();
  map.map_planes = small(in.u32());
  const double points = static_cast<double>(map.points_v) * map.points_h * map.map_planes;
  if (!in.complete() || points * sizeof(float) > static_cast<double>(in.left())) return context.damaged(gain_map);
  map.gain.resize(static_cast<std::size_t>(points));
  for (float& gain : map.gain) gain = in.f32();
  return add_gains(context, gain_map, std::move(map));
}

/// Reads one gain for each row or column of an area, as a map with a point in each.
Result<void> read_scale(const OpcodeContext& context, std::uint32_t id, OpcodeReader in) {
  const Rect& active = context.frame.raw.active;
  GainMap map;
  read_area(active, in, map);
  const std::uint32_t count = in.u32();
  if (!in.complete() || std::uint64_t{count} * sizeof(float) > in.left()) return context.damaged(id);
  const bool of_rows = id == scale_per_row;
  const int first = of_rows ? map.top : map.left, end = of_rows ? map.bottom : map.right;
  const int pitch = of_rows ? map.row_pitch : map.column_pitch, side = of_rows ? active.height : active.width;
  if (pitch < 1 || (end > first && std::int64_t{count} * pitch < end - first)) return context.damaged(id);
  map.gain.resize(count);
  for (float& gain : map.gain) gain = in.f32();
  map.points_v = of_rows ? static_cast<int>(count) : 1;
  map.points_h = of_rows ? 1 : static_cast<int>(count);
  map.map_planes = 1;
  (of_rows ? map.spacing_v : map.spacing_h) = static_cast<double>(pitch) / side;
  (of_rows ? map.origin_v : map.origin_h) = (first + 0.5) / side;
  return add_gains(context, id, std::move(map));
}

Result<void> read_vignette(const OpcodeContext& context, OpcodeReader in) {
  RadialGain radial;
  for (double& k : radial.k) k = in.f64();
  radial.centre_x = in.f64();
  radial.centre_y = in.f64();
  const bool finite = std::all_of(std::begin(radial.k), std::end(radial.k), [](double k) { return std::isfinite(k); });
  const auto relative = [](double position) { return position >= 0 && position <= 1; };
  if (!in.complete() || !finite || !relative(radial.centre_x) || !relative(radial.centre_y)) {
    return context.damaged(fix_vignette_radial);
  }
  if (auto room = context.check_gains(1); !room) return room;
  if (context.list == 1) {
    context.not_applied(fix_vignette_radial, ": it is meant for values that still hold the black level");
  } else {
    context.found.radial_gains.push_back(radial);
  }
  return {};
}

/// Adds the intersection of a rectangle (ends excluded, in the pixels of the list) with the active area.
void add_defect(const OpcodeContext& context, std::uint32_t top, std::uint32_t left, std::uint64_t bottom,
                std::uint64_t right) {
  const Rect& active = context.frame.raw.active;
  const std::int64_t dx = context.list == 1 ? active.x : 0, dy = context.list == 1 ? active.y : 0;
  const std::int64_t x0 = std::max<std::int64_t>(left - dx, 0), y0 = std::max<std::int64_t>(top - dy, 0);
  const std::int64_t x1 = std::min<std::int64_t>(static_cast<std::int64_t>(right) - dx, active.width);
  const std::int64_t y1 = std::min<std::int64_t>(static_cast<std::int64_t>(bottom) - dy, active.height);
  if (x0 >= x1 || y0 >= y1) return;
  context.found.defects.push_back(
      {static_cast<int>(x0), static_cast<int>(y0), static_cast<int>(x1 - x0), static_cast<int>(y1 - y0)});
}

Result<void> read_defect_list(const OpcodeContext& context, OpcodeReader in) {
  in.u32();  // the Bayer phase; the frame's is known
  const std::uint64_t points = in.u32(), rects = in.u32();
  if (!in.complete() || points * 8 + rects * 16 > in.left()) return context.damaged(fix_bad_pixels_list);
  if (points + rects > context.room_for_defects()) {
    return fail(ErrorCode::malformed, "the tag " + context.tag() + " names more than a million defects", context.tag());
  }
  for (std::uint64_t i = 0; i < points; ++i) {
    const std::uint32_t y = in.u32(), x = in.u32();
    add_defect(context, y, x, std::uint64_t{y} + 1, std::uint64_t{x} + 1);
  }
  for (std::uint64_t i = 0; i < rects; ++i) {
    const std::uint32_t top = in.u32(), left = in.u32(), bottom = in.u32(), right = in.u32();
    add_defect(context, top, left, bottom, right);
  }
  return {};
}

/// Marks pixels of a constant value as defective: they are found in the readout, once it is complete.
Result<void> read_defect_constant(const OpcodeContext& context, OpcodeReader in) {
  const std::uint32_t constant = in.u32();
  if (!in.complete()) return context.damaged(fix_bad_pixels_constant);
  const RawDn& raw = context.frame.raw;
  const bool is_mosaic = raw.layout != SensorLayout::linear_rgb || context.samples.is_x_trans;
  if (context.samples.linearized || context.list != 1 || !is_mosaic || raw.is_float()) {
    context.not_applied(fix_bad_pixels_constant, ": its constant does not refer to the decoded values");
  } else if (constant < context.constants.size()) {
    context.constants.set(constant);
  }
  return {};
}

/// Finds all constants in one pass over the readout. Constants of too many pixels are dropped; defects that the file
/// lists stay.
void find_constants(const OpcodeContext& context) {
  const RawDn& raw = context.frame.raw;
  std::vector<DefectRect>& defects = context.found.defects;
  const std::int64_t believed = std::int64_t{raw.active.width} * raw.active.height / max_named_fraction;
  const std::size_t named = defects.size();
  const std::size_t room = std::min(context.room_for_defects(), static_cast<std::size_t>(believed));
  for (int y = 0; y < raw.active.height; ++y) {
    const std::uint16_t* row = raw.dn.row(raw.active.y + y) + raw.active.x;
    for (int x = 0; x < raw.active.width; ++x) {
      if (!context.constants[row[x]]) continue;
      if (defects.size() - named == room) {
        defects.resize(named);
        return context.not_applied(fix_bad_pixels_constant,
                                   ": more than " + std::to_string(room) + " pixels have its value");
      }
      defects.push_back({x, y, 1, 1});
    }
  }
}

Result<void> read_opcode(const OpcodeContext& context, std::uint32_t id, std::span<const std::byte> parameters) {
  switch (id) {
    case gain_map:
      return read_gain_map(context, OpcodeReader(parameters));
    case scale_per_row:
    case scale_per_column:
      return read_scale(context, id, OpcodeReader(parameters));
    case fix_vignette_radial:
      return read_vignette(context, OpcodeReader(parameters));
    case fix_bad_pixels_list:
      return read_defect_list(context, OpcodeReader(parameters));
    case fix_bad_pixels_constant:
      return read_defect_constant(context, OpcodeReader(parameters));
    case map_polynomial:
      if (!(context.list == 2 && context.samples.polynomials)) context.not_applied(id);
      return {};
    default:
      context.not_applied(id);
      return {};
  }
}

template <class T>
void append(std::vector<T>& to, std::vector<T>& from) {
  to.insert(to.end(), std::make_move_iterator(from.begin()), std::make_move_iterator(from.end()));
}

constexpr std::uint32_t max_degree = 8;

tl::unexpected<Error> refused(ErrorCode code, const std::string& why) {
  return fail(code, "MapPolynomial of the tag OpcodeList2 " + why, tag::opcode_list[1].name);
}

Result<Polynomial> read_polynomial(OpcodeReader in, const Rect& active) {
  const std::uint32_t top = in.u32(), left = in.u32(), bottom = in.u32(), right = in.u32();
  const std::uint32_t first_plane = in.u32(), planes = in.u32(), row_pitch = in.u32(), column_pitch = in.u32();
  const std::uint32_t degree = in.u32();
  if (!in.complete() || degree > max_degree || first_plane > 2) return refused(ErrorCode::malformed, "is damaged");
  const bool whole = top == 0 && left == 0 && bottom >= static_cast<std::uint32_t>(active.height) &&
                     right >= static_cast<std::uint32_t>(active.width) && row_pitch == 1 && column_pitch == 1;
  if (!whole) return refused(ErrorCode::unsupported, "applies to a part of the image, which is not supported");
  Polynomial out{.first_plane = static_cast<int>(first_plane), .planes = planes < 3 ? static_cast<int>(planes) : 3};
  for (std::uint32_t i = 0; i <= degree; ++i) {
    out.coefficient.push_back(in.f64());
    if (!std::isfinite(out.coefficient.back())) return refused(ErrorCode::malformed, "is damaged");
  }
  if (!in.complete()) return refused(ErrorCode::malformed, "is damaged");
  return out;
}

}  // namespace

Result<void> each_opcode(std::span<const std::byte> bytes, int list,
                         const std::function<Result<void>(std::uint32_t, std::span<const std::byte>)>& use) {
  const std::string tag = "OpcodeList" + std::to_string(list);
  const auto damaged = [&] { return fail(ErrorCode::malformed, "the tag " + tag + " is damaged", tag); };
  OpcodeReader in(bytes);
  const std::uint32_t count = in.u32();
  if (!in.complete() || count > in.left() / opcode_header_bytes) return damaged();
  if (count > max_opcodes) {
    return fail(ErrorCode::malformed, "the tag " + tag + " holds more opcodes than any camera writes", tag);
  }
  for (std::uint32_t i = 0; i < count; ++i) {
    const std::uint32_t id = in.u32();
    in.u32();  // the DNG version that introduced it
    in.u32();  // flags: whether a reader may skip it; a skipped opcode becomes a warning in any case
    const auto parameters = in.block(in.u32());
    if (!in.complete()) return damaged();
    if (auto used = use(id, parameters); !used) return used;
  }
  return {};
}

Result<void> read_opcodes(std::span<const std::byte> bytes, int list, SampleState samples, RawFrame& frame) {
  RawCorrections found;
  std::bitset<65536> constants;
  std::vector<std::string> warnings;
  const OpcodeContext context{list, samples, frame, found, constants, warnings};
  auto read = each_opcode(bytes, list, [&](std::uint32_t id, std::span<const std::byte> parameters) {
    return read_opcode(context, id, parameters);
  });
  if (!read) return read;
  if (constants.any()) find_constants(context);
  append(frame.corrections.gain_maps, found.gain_maps);
  append(frame.corrections.radial_gains, found.radial_gains);
  append(frame.corrections.defects, found.defects);
  append(frame.warnings, warnings);
  return {};
}

Result<std::vector<Polynomial>> read_polynomials(std::span<const std::byte> bytes, const Rect& active) {
  std::vector<Polynomial> found;
  if (bytes.empty()) return found;
  auto read = each_opcode(bytes, 2, [&](std::uint32_t id, std::span<const std::byte> parameters) -> Result<void> {
    if (id != map_polynomial) return {};
    return read_polynomial(OpcodeReader(parameters), active).map([&](Polynomial p) { found.push_back(std::move(p)); });
  });
  if (!read) return pass_on(read);
  return found;
}

}  // namespace lowlux::capture
