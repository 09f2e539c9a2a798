#include <algorithm>
#include <cmath>
#include <functional>
#include <iterator>
#include <limits>
#include <memory>
#include <numeric>
#include <utility>

#include "capture/dng/opcode_context.h"
#include "isp/base/gain_at.h"

namespace lowlux::capture {
namespace {

constexpr double largest_code = 65535;
constexpr std::size_t max_functions = 128;  // of a sample, in a list

/// Reads the pixels that an opcode applies to, which may be none, and its planes. An area without pixels whose pitches
/// are 1 is the whole image, as in the DNG SDK, whose writers leave it so.
GainMap read_area(const OpcodeContext& context, OpcodeReader& in) {
  const Rect image = context.area();
  GainMap map;
  map.top = small(in.u32());
  map.left = small(in.u32());
  map.bottom = small(in.u32());
  map.right = small(in.u32());
  map.first_plane = small(in.u32());
  map.planes = small(in.u32());
  map.row_pitch = small(in.u32());
  map.column_pitch = small(in.u32());
  if ((map.top >= map.bottom || map.left >= map.right) && map.row_pitch == 1 && map.column_pitch == 1) {
    map.top = map.left = 0, map.bottom = image.height, map.right = image.width;
  }
  map.bottom = std::min(map.bottom, image.height);
  map.right = std::min(map.right, image.width);
  return map;
}

bool is_usable(const GainMap& map) {
  return map.row_pitch >= 1 && map.column_pitch >= 1 && map.planes >= 1 && map.points_v >= 1 && map.points_h >= 1 &&
         map.map_planes >= 1 && std::isfinite(map.spacing_v) && std::isfinite(map.spacing_h) &&
         std::isfinite(map.origin_v) && std::isfinite(map.origin_h) && (map.points_v == 1 || map.spacing_v > 0) &&
         (map.points_h == 1 || map.spacing_h > 0);
}

/// Returns why an area has no sample of the image; empty if it has one.
std::string why_outside(const OpcodeContext& context, const GainMap& area) {
  if (area.top >= area.bottom || area.left >= area.right) return ": its area is outside of the image";
  return area.first_plane >= context.planes() ? ": the image has no colour of its number" : "";
}

/// Adds a change of the samples, of list 1 or 2. One that follows gains is made before them.
Result<void> add_change(OpcodeContext& context, GainMap area, SampleFunction function, bool is_delta) {
  context.functions += 1 + context.gains.size();
  if (context.functions > max_functions) {
    return fail(ErrorCode::malformed, "the tag " + context.tag() + " asks for more changes than any camera writes",
                context.tag());
  }
  area.gain.clear();
  if (!context.gains.empty()) {
    area.points_v = area.points_h = 2;  // it differs between rows and columns
    function = [gains = context.gains, of = std::move(function)](double value, int x, int y, int plane) {
      double gain = 1;
      for (const SampleChange& before : gains) {
        if (includes(before.area, x, y, plane)) gain = before.function(gain, x, y, plane);
      }
      return gain > 0 ? of(gain * value, x, y, plane) / gain : value;
    };
  }
  context.changes.push_back({std::move(area), std::move(function), is_delta});
  return {};
}

/// Adds a gain of list 1 to the changes; remembers one of list 2 for changes that follow it.
void add_gain_function(OpcodeContext& context, const GainMap& area, SampleFunction gain) {
  if (context.list == 3) return;
  GainMap place = area;
  place.gain.clear();
  (context.list == 1 ? context.changes : context.gains).push_back({std::move(place), std::move(gain), false});
}

/// Returns the value of a map at a pixel of the image that the list changes.
auto value_of(const OpcodeContext& context, const GainMap& map) {
  return [map = std::make_shared<const GainMap>(map), image = context.area()](int x, int y, int plane) {
    return static_cast<double>(
        gain_at(*map, row_position(*map, y, image.height), column_position(*map, x, image.width), plane));
  };
}

/// Returns a map of one of its planes alone.
GainMap map_of_plane(const GainMap& all, int plane) {
  const int map_plane = std::min(plane, all.map_planes - 1);
  GainMap one = all;
  one.first_plane = 0;
  one.planes = one.map_planes = 1;
  one.gain.resize(static_cast<std::size_t>(all.points_v) * all.points_h);
  for (std::size_t i = 0; i < one.gain.size(); ++i) one.gain[i] = all.gain[i * all.map_planes + map_plane];
  return one;
}

/// Adds a map of demosaiced data that differs between colours, split into maps of the mosaic's four sites.
void add_split(OpcodeContext& context, const GainMap& map) {
  for (int y = 0; y < 2; ++y) {
    for (int x = 0; x < 2; ++x) {
      const int plane = static_cast<int>(colour_at(context.frame.raw.phase, x, y));
      if (plane < map.first_plane || plane - map.first_plane >= map.planes) continue;
      GainMap one = map_of_plane(map, plane);
      one.top += (one.top & 1) != y;
      one.left += (one.left & 1) != x;
      one.row_pitch = one.column_pitch = 2;
      if (one.top < one.bottom && one.left < one.right) context.found.gain_maps.push_back(std::move(one));
    }
  }
}

/// Adds the map of an opcode, unless the layout of the image does not let it be applied.
Result<void> add_gains(OpcodeContext& context, const Opcode& opcode, GainMap map) {
  const bool sound = std::ranges::all_of(map.gain, [](float g) { return std::isfinite(g) && g >= 0; });
  if (!is_usable(map) || !sound) return context.damaged(opcode);
  if (const std::string why = why_outside(context, map); !why.empty()) return context.not_applied(opcode, why);
  const auto multiply = [gain = value_of(context, map)](double value, int x, int y, int plane) {
    return value * gain(x, y, plane);
  };
  if (context.list == 1) {
    add_gain_function(context, map, multiply);
    return {};
  }
  if (context.planes() == 1) map = map_of_plane(map, 0);
  const bool alike = map.first_plane == 0 && map.planes >= 3 && map.map_planes == 1;
  const bool split =
      context.list == 3 && context.image.layout == SensorLayout::bayer && !context.image.x_trans && !alike;
  const bool skips = map.row_pitch != 1 || map.column_pitch != 1;
  if (auto room = context.check_gains(split ? 4 : 1); !room) return room;
  if (context.image.quad_bayer && (skips || split)) {
    return context.not_applied(opcode, ": it skips sites of a Quad Bayer mosaic, which is binned");
  }
  if (split) {
    if (skips) return context.not_applied(opcode, ": it skips rows or columns of demosaiced data");
    add_split(context, map);
    return {};
  }
  if (context.list == 2 && context.image.x_trans) {
    if (skips) return context.not_applied(opcode, ": it skips sites of an X-Trans mosaic");
    map.planes = 3;
  }
  add_gain_function(context, map, multiply);
  context.found.gain_maps.push_back(std::move(map));
  return {};
}

Result<void> read_gain_map(OpcodeContext& context, const Opcode& opcode) {
  OpcodeReader in(opcode.parameters);
  GainMap map = read_area(context, in);
  map.points_v = small(in.u32());
  map.points_h = small(in.u32());
  map.spacing_v = in.f64();
  map.spacing_h = in.f64();
  map.origin_v = in.f64();
  map.origin_h = in.f64();
  map.map_planes = small(in.u32());
  const double points = static_cast<double>(map.points_v) * map.points_h * map.map_planes;
  if (!in.complete() || points * sizeof(float) > static_cast<double>(in.left())) return context.damaged(opcode);
  map.gain.resize(static_cast<std::size_t>(points));
  for (float& gain : map.gain) gain = in.f32();
  return add_gains(context, opcode, std::move(map));
}

/// Adds a delta for each row or column. Those beyond the range of the values are damage.
Result<void> add_deltas(OpcodeContext& context, const Opcode& opcode, const GainMap& map) {
  const float most = context.list == 1 ? static_cast<float>(largest_code) : 1.0F;
  const bool sound = std::ranges::all_of(map.gain, [&](float delta) { return std::fabs(delta) <= most; });
  if (!is_usable(map) || !sound) return context.damaged(opcode);
  if (context.list == 3) return context.not_applied(opcode, ": it is meant for demosaiced data");
  if (const std::string why = why_outside(context, map); !why.empty()) return context.not_applied(opcode, why);
  return add_change(
      context, map,
      [delta = value_of(context, map)](double value, int x, int y, int plane) { return value + delta(x, y, plane); },
      true);
}

/// Reads one number for each row or column of an area, as a map with a point in each.
Result<void> read_lines(OpcodeContext& context, const Opcode& opcode) {
  OpcodeReader in(opcode.parameters);
  GainMap map = read_area(context, in);
  const std::uint32_t count = in.u32();
  if (!in.complete() || std::uint64_t{count} * sizeof(float) > in.left()) return context.damaged(opcode);
  const Rect image = context.area();
  const bool of_rows = opcode.is_of_rows();
  const int first = of_rows ? map.top : map.left, end = of_rows ? map.bottom : map.right;
  const int pitch = of_rows ? map.row_pitch : map.column_pitch, side = of_rows ? image.height : image.width;
  if (pitch < 1 || (end > first && std::int64_t{count} * pitch < end - first)) return context.damaged(opcode);
  map.gain.resize(count);
  for (float& number : map.gain) number = in.f32();
  map.points_v = of_rows ? static_cast<int>(count) : 1;
  map.points_h = of_rows ? 1 : static_cast<int>(count);
  map.map_planes = 1;
  (of_rows ? map.spacing_v : map.spacing_h) = static_cast<double>(pitch) / side;
  (of_rows ? map.origin_v : map.origin_h) = (first + 0.5) / side;
  const bool are_deltas = opcode.id == delta_per_row || opcode.id == delta_per_column;
  return are_deltas ? add_deltas(context, opcode, map) : add_gains(context, opcode, std::move(map));
}

Result<void> read_vignette(OpcodeContext& context, const Opcode& opcode) {
  OpcodeReader in(opcode.parameters);
  RadialGain radial;
  for (double& k : radial.k) k = in.f64();
  radial.centre_x = in.f64();
  radial.centre_y = in.f64();
  const bool finite = std::all_of(std::begin(radial.k), std::end(radial.k), [](double k) { return std::isfinite(k); });
  const auto relative = [](double position) { return position >= 0 && position <= 1; };
  if (!in.complete() || !finite || !relative(radial.centre_x) || !relative(radial.centre_y)) {
    return context.damaged(opcode);
  }
  if (auto room = context.check_gains(1); !room) return room;
  const Rect image = context.area();
  const GainMap whole{.bottom = image.height, .right = image.width, .planes = context.planes()};
  add_gain_function(context, whole,
                    [gain = RadialGainAt(radial, image.width, image.height)](double value, int x, int y, int) {
                      return value * gain(x, y);
                    });
  if (context.list > 1) context.found.radial_gains.push_back(radial);
  return {};
}

/// Adds a function of the values alone, which list 2 has for values from 0 (black) to 1 (white). Below black it
/// continues as the mirror image through the point of black, which preserves means of noise where the function is
/// straight, and above white with slope 1.
Result<void> add_map(OpcodeContext& context, const Opcode& opcode, const GainMap& area,
                     std::function<double(double)> of) {
  if (context.list == 3) return context.not_applied(opcode, ": it is meant for demosaiced data");
  if (const std::string why = why_outside(context, area); !why.empty()) return context.not_applied(opcode, why);
  if (context.list == 1) {
    return add_change(
        context, area, [of = std::move(of)](double code, int, int, int) { return of(code); }, false);
  }
  long before = std::numeric_limits<long>::min();
  for (int i = 0; i <= static_cast<int>(largest_code); ++i) {
    const double value = largest_code * of(i / largest_code);
    if (!(std::fabs(value) <= largest_code * largest_code)) return context.damaged(opcode);
    if (std::lround(value) < before) return context.damaged(opcode, ": its values fall");
    before = std::lround(value);
  }
  const double black = of(0), white = of(1);
  return add_change(
      context, area,
      [of = std::move(of), black, white](double value, int, int, int) {
        if (value < 0) return 2 * black - of(std::min(-value, 1.0));
        return value > 1 ? white + value - 1 : of(value);
      },
      false);
}

Result<void> read_polynomial(OpcodeContext& context, const Opcode& opcode) {
  constexpr std::uint32_t max_degree = 8;
  OpcodeReader in(opcode.parameters);
  const GainMap area = read_area(context, in);
  const std::uint32_t degree = in.u32();
  if (!in.complete() || degree > max_degree || !is_usable(area)) return context.damaged(opcode);
  std::vector<double> coefficient(degree + 1);
  for (double& k : coefficient) k = in.f64();
  if (!in.complete() || !std::ranges::all_of(coefficient, [](double k) { return std::isfinite(k); })) {
    return context.damaged(opcode);
  }
  return add_map(context, opcode, area, [k = std::move(coefficient)](double x) {
    return std::accumulate(k.rbegin(), k.rend(), 0.0, [x](double all, double next) { return all * x + next; });
  });
}

/// Reads a table of codes. Values of list 2 are mapped between its entries, which are those of 0, 1 / 65535 and so on.
Result<void> read_table(OpcodeContext& context, const Opcode& opcode) {
  OpcodeReader in(opcode.parameters);
  const GainMap area = read_area(context, in);
  const std::uint32_t size = in.u32();
  if (!in.complete() || size < 1 || size > largest_code + 1 || size * sizeof(std::uint16_t) > in.left() ||
      !is_usable(area)) {
    return context.damaged(opcode);
  }
  std::vector<double> table(size);
  for (double& entry : table) entry = in.u16();
  const double scale = context.list == 1 ? 1 : largest_code;
  return add_map(context, opcode, area, [table = std::move(table), scale](double value) {
    const double at = std::clamp(scale * value, 0.0, static_cast<double>(table.size() - 1));
    const auto before = static_cast<std::size_t>(at);
    const std::size_t after = std::min(before + 1, table.size() - 1);
    return std::lerp(table[before], table[after], at - static_cast<double>(before)) / scale;
  });
}

}  // namespace

bool changes_values(std::uint32_t id) {
  return id == fix_vignette_radial || (id >= map_table && id <= scale_per_column);
}

Result<void> read_value_opcode(OpcodeContext& context, const Opcode& opcode) {
  switch (opcode.id) {
    case gain_map:
      return read_gain_map(context, opcode);
    case fix_vignette_radial:
      return read_vignette(context, opcode);
    case map_polynomial:
      return read_polynomial(context, opcode);
    case map_table:
      return read_table(context, opcode);
    default:
      return read_lines(context, opcode);
  }
}

}  // namespace lowlux::capture
