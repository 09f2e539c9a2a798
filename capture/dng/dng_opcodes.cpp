#include "capture/dng/dng_opcodes.h"

#include <algorithm>
#include <cstdint>
#include <iterator>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "capture/dng/dng_tags.h"
#include "capture/dng/opcode_context.h"
#include "capture/dng/sample_changes.h"

namespace lowlux::capture {
namespace {

constexpr std::size_t max_opcodes = 64;  // cameras write some
constexpr std::size_t opcode_header_bytes = 16;
// Cameras write four gain maps and some thousand defects.
constexpr std::size_t max_defects = std::size_t{1} << 20;  // in all lists
constexpr std::size_t max_gains = 64;                      // in all lists
constexpr std::uint32_t known_version = 0x01070100;        // DNG 1.7.1

std::size_t room_for_defects(const OpcodeContext& context) {
  return max_defects - context.frame.corrections.defects.size() - context.found.defects.size();
}

/// Returns whether a DNG of the frame, which consists of the active area and has no defects, is to state an opcode
/// again.
bool stays(const OpcodeContext& context, const Opcode& opcode) {
  if (context.list == 1 || opcode.id == fix_bad_pixels_constant) return false;
  if (context.list == 2) return !context.image.x_trans && !context.image.quad_bayer;
  return !context.image.quad_bayer || opcode.is_warp();
}

/// Reads a crop. The default crop counts from its corner, as do all opcodes that follow it: then it is not applied.
Result<void> read_trim(OpcodeContext& context, const Opcode& opcode) {
  OpcodeReader in(opcode.parameters);
  const int top = small(in.u32()), left = small(in.u32()), bottom = small(in.u32()), right = small(in.u32());
  const Rect image = context.area();
  if (!in.complete() || top >= bottom || left >= right || bottom > image.height || right > image.width) {
    return context.damaged(opcode);
  }
  if (context.list == 1) return context.not_applied(opcode, ": it would move the active area");
  if (opcode.is_last) {
    context.trimmed = Rect{left, top, right - left, bottom - top};
    return {};
  }
  context.follows_trim = true;
  return context.not_applied(opcode, ": other opcodes follow it");
}

/// Adds the intersection of a rectangle (ends excluded, in the pixels of the list) with the active area.
void add_defect(OpcodeContext& context, std::uint32_t top, std::uint32_t left, std::uint64_t bottom,
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

Result<void> read_defect_list(OpcodeContext& context, const Opcode& opcode) {
  OpcodeReader in(opcode.parameters);
  in.u32();  // the Bayer phase; the frame's is known
  const std::uint64_t points = in.u32(), rects = in.u32();
  if (!in.complete() || points * 8 + rects * 16 > in.left()) return context.damaged(opcode);
  if (points + rects > room_for_defects(context)) {
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

/// Marks pixels of a constant value as defective: they are found in the readout, once the list is complete.
Result<void> read_defect_constant(OpcodeContext& context, const Opcode& opcode) {
  OpcodeReader in(opcode.parameters);
  const std::uint32_t constant = in.u32();
  if (!in.complete()) return context.damaged(opcode);
  if (context.list != 1 || context.image.samples != 1 || context.image.is_float || !context.changes.empty()) {
    return context.not_applied(opcode, ": its constant does not refer to the decoded values");
  }
  if (constant < context.constants.size()) context.constants.set(constant);
  return {};
}

/// Finds all constants in one pass over the readout. Constants of too many pixels are dropped; defects that the file
/// lists stay.
void find_constants(OpcodeContext& context) {
  const RawDn& raw = context.frame.raw;
  std::vector<DefectRect>& defects = context.found.defects;
  const std::int64_t believed = std::int64_t{raw.active.width} * raw.active.height / max_named_fraction;
  const std::size_t named = defects.size();
  const std::size_t room = std::min(room_for_defects(context), static_cast<std::size_t>(believed));
  for (int y = 0; y < raw.active.height; ++y) {
    const std::uint16_t* row = raw.dn.row(raw.active.y + y) + raw.active.x;
    for (int x = 0; x < raw.active.width; ++x) {
      if (!context.constants[row[x]]) continue;
      if (defects.size() - named == room) {
        defects.resize(named);
        context.not_applied({.id = fix_bad_pixels_constant},
                            ": more than " + std::to_string(room) + " pixels have its value");
        return;
      }
      defects.push_back({x, y, 1, 1});
    }
  }
}

Result<void> read_opcode(OpcodeContext& context, const Opcode& opcode) {
  if (opcode.version > known_version) {
    return context.not_applied(opcode, ": it came with DNG " + std::to_string(opcode.version >> 24) + "." +
                                           std::to_string(opcode.version >> 16 & 255));
  }
  if (context.follows_trim) return context.not_applied(opcode, ": it follows TrimBounds");
  if (changes_values(opcode.id)) return read_value_opcode(context, opcode);
  switch (opcode.id) {
    case trim_bounds:
      return read_trim(context, opcode);
    case fix_bad_pixels_list:
      return read_defect_list(context, opcode);
    case fix_bad_pixels_constant:
      return read_defect_constant(context, opcode);
    default:
      return context.not_applied(opcode);
  }
}

Result<void> read_list(OpcodeContext& context, std::span<const std::byte> bytes, bool is_last) {
  const std::string tag = context.tag();
  const auto damaged = [&] { return fail(ErrorCode::malformed, "the tag " + tag + " is damaged", tag); };
  OpcodeReader in(bytes);
  const std::uint32_t count = in.u32();
  if (!in.complete() || count > in.left() / opcode_header_bytes) return damaged();
  if (count > max_opcodes) {
    return fail(ErrorCode::malformed, "the tag " + tag + " holds more opcodes than any camera writes", tag);
  }
  for (std::uint32_t i = 0; i < count; ++i) {
    Opcode opcode{.id = in.u32(), .version = in.u32(), .flags = in.u32(), .is_last = is_last && i + 1 == count};
    opcode.parameters = in.block(in.u32());
    if (!in.complete()) return damaged();
    if (auto read = read_opcode(context, opcode); !read) return read;
  }
  return {};
}

/// Changes the samples or the black level of the frame.
Result<void> change_samples(const OpcodeContext& context, RawDn& raw) {
  if (context.changes.empty()) return {};
  const int planes = context.image.samples;
  if (context.list == 1) {
    change_readout(context.changes, planes, raw);
    return {};
  }
  const BlackLevel none{.samples = planes, .pattern_dn = std::vector<double>(static_cast<std::size_t>(planes), 0.0)};
  std::optional<std::string> wrong = "the file states no black level, from which its values count";
  if (raw.black_tag || is_encoded(context.image)) {
    wrong = change_fractions(context.changes, planes, raw.black_tag.value_or(none), raw);
  }
  if (!wrong) return {};
  return fail(ErrorCode::malformed, "the tag " + context.tag() + " cannot be applied: " + *wrong, context.tag());
}

/// Cuts the default crop, which counts from the corner of the trimmed image.
void trim_crop(const Rect& trimmed, Rect& crop) {
  const int width = std::min(crop.width, trimmed.width - crop.x);
  const int height = std::min(crop.height, trimmed.height - crop.y);
  crop = width > 0 && height > 0 ? Rect{trimmed.x + crop.x, trimmed.y + crop.y, width, height} : trimmed;
}

template <class T>
void append(std::vector<T>& to, std::vector<T>& from) {
  to.insert(to.end(), std::make_move_iterator(from.begin()), std::make_move_iterator(from.end()));
}

}  // namespace

std::string Opcode::name() const {
  constexpr const char* names[] = {
      "opcode 0",         "WarpRectilinear", "WarpFisheye", "FixVignetteRadial", "FixBadPixelsConstant",
      "FixBadPixelsList", "TrimBounds",      "MapTable",    "MapPolynomial",     "GainMap",
      "DeltaPerRow",      "DeltaPerColumn",  "ScalePerRow", "ScalePerColumn",    "WarpRectilinear2"};
  return id < std::size(names) ? names[id] : "opcode " + std::to_string(id);
}

std::string OpcodeContext::tag() const { return tag::opcode_list[list - 1].name; }

Result<void> OpcodeContext::not_applied(const Opcode& opcode, const std::string& why) {
  warnings.push_back(opcode.name() + " (" + tag() + ") is not applied" + why);
  if (stays(*this, opcode)) {
    found.not_applied[list - 2].push_back(
        {opcode.id, opcode.version, opcode.flags, {opcode.parameters.begin(), opcode.parameters.end()}});
  }
  return {};
}

tl::unexpected<Error> OpcodeContext::damaged(const Opcode& opcode, const std::string& why) const {
  return fail(ErrorCode::malformed, opcode.name() + " of the tag " + tag() + " is damaged" + why, tag());
}

Result<void> OpcodeContext::check_gains(std::size_t more) const {
  const RawCorrections& before = frame.corrections;
  const std::size_t all =
      before.gain_maps.size() + before.radial_gains.size() + found.gain_maps.size() + found.radial_gains.size();
  if (all + more <= max_gains) return {};
  return fail(ErrorCode::malformed, "the tag " + tag() + " asks for more gain maps than any camera writes", tag());
}

int small(std::uint32_t value) { return static_cast<int>(std::min<std::uint32_t>(value, 1U << 30)); }

Result<void> read_opcodes(std::span<const std::byte> bytes, int list, bool is_last, const DngImage& image,
                          RawFrame& frame) {
  OpcodeContext context{list, image, frame};
  context.follows_trim = list == 3 && std::ranges::any_of(frame.corrections.not_applied[0],
                                                          [](const DngOpcode& o) { return o.id == trim_bounds; });
  if (auto read = read_list(context, bytes, is_last); !read) return read;
  if (context.constants.any()) find_constants(context);
  if (auto changed = change_samples(context, frame.raw); !changed) return changed;
  append(frame.corrections.gain_maps, context.found.gain_maps);
  append(frame.corrections.radial_gains, context.found.radial_gains);
  append(frame.corrections.defects, context.found.defects);
  for (std::size_t i = 0; i < 2; ++i) append(frame.corrections.not_applied[i], context.found.not_applied[i]);
  append(frame.warnings, context.warnings);
  if (context.trimmed) trim_crop(*context.trimmed, frame.raw.default_crop);
  return {};
}

}  // namespace lowlux::capture
