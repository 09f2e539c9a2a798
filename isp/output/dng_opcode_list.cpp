#include "isp/output/dng_opcode_list.h"

#include <bit>
#include <cstdint>

namespace lowlux::isp {
namespace {

constexpr std::uint32_t fix_vignette_radial = 3, fix_bad_pixels_list = 5, gain_map = 9;
constexpr std::uint32_t since_version = 0x01030000;  // DNG 1.3 introduced them all

/// Big-endian, whatever the byte order of the file.
class Numbers {
 public:
  void whole(int number) { put(static_cast<std::uint32_t>(number), 4); }
  void word(std::uint32_t number) { put(number, 4); }
  void number(double number) { put(std::bit_cast<std::uint64_t>(number), 8); }
  void number(float number) { put(std::bit_cast<std::uint32_t>(number), 4); }
  void append(const Numbers& more) { bytes_.insert(bytes_.end(), more.bytes_.begin(), more.bytes_.end()); }
  const std::vector<std::byte>& bytes() const { return bytes_; }

 private:
  void put(std::uint64_t number, int size) {
    for (int i = size - 1; i >= 0; --i) bytes_.push_back(static_cast<std::byte>(number >> (8 * i) & 255));
  }
  std::vector<std::byte> bytes_;
};

class List {
 public:
  void add(std::uint32_t id, const Numbers& parameters) {
    for (const std::uint32_t word : {id, since_version, 0U}) opcodes_.word(word);  // flags 0: not to be skipped
    opcodes_.word(static_cast<std::uint32_t>(parameters.bytes().size()));
    opcodes_.append(parameters);
    ++count_;
  }
  std::vector<std::byte> bytes() const {
    if (count_ == 0) return {};
    Numbers all;
    all.word(count_);
    all.append(opcodes_);
    return all.bytes();
  }

 private:
  std::uint32_t count_ = 0;
  Numbers opcodes_;
};

Numbers parameters_of(const GainMap& map) {
  Numbers out;
  for (const int n : {map.top, map.left, map.bottom, map.right, map.first_plane, map.planes, map.row_pitch,
                      map.column_pitch, map.points_v, map.points_h}) {
    out.whole(n);
  }
  for (const double n : {map.spacing_v, map.spacing_h, map.origin_v, map.origin_h}) out.number(n);
  out.whole(map.map_planes);
  for (const float gain : map.gain) out.number(gain);
  return out;
}

Numbers parameters_of(const RadialGain& radial) {
  Numbers out;
  for (const double k : radial.k) out.number(k);
  out.number(radial.centre_x);
  out.number(radial.centre_y);
  return out;
}

/// Positions count from the corner of the readout; so does the phase (DNG 1.4, FixBadPixelsList).
Numbers parameters_of(const std::vector<DefectRect>& defects, const RawDn& raw) {
  Numbers out;
  out.whole(static_cast<int>(phase_of_crop(raw.phase, raw.active.x, raw.active.y)));
  out.whole(0);  // points: each is a rectangle of one pixel here
  out.word(static_cast<std::uint32_t>(defects.size()));
  for (const DefectRect& d : defects) {
    const int x = raw.active.x + d.x, y = raw.active.y + d.y;
    for (const int edge : {y, x, y + d.height, x + d.width}) out.whole(edge);
  }
  return out;
}

}  // namespace

OpcodeLists opcode_lists(const RawFrame& frame) {
  List first, second;
  const RawCorrections& c = frame.corrections;
  if (!c.defects.empty()) first.add(fix_bad_pixels_list, parameters_of(c.defects, frame.raw));
  for (const GainMap& map : c.gain_maps) second.add(gain_map, parameters_of(map));
  for (const RadialGain& radial : c.radial_gains) second.add(fix_vignette_radial, parameters_of(radial));
  return {first.bytes(), second.bytes()};
}

}  // namespace lowlux::isp
