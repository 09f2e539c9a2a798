#include "isp/output/dng/dng_tags.h"

#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

#include <tiffio.h>

#include "isp/codec/noise_ratio_bytes.h"
#include "isp/output/dng/dng_check.h"

namespace lowlux::isp {
namespace {

constexpr std::array<std::uint32_t, 2> color_matrix{TIFFTAG_COLORMATRIX1, TIFFTAG_COLORMATRIX2};
constexpr std::array<std::uint32_t, 2> camera_calibration{TIFFTAG_CAMERACALIBRATION1, TIFFTAG_CAMERACALIBRATION2};
constexpr std::array<std::uint32_t, 2> illuminant{TIFFTAG_CALIBRATIONILLUMINANT1, TIFFTAG_CALIBRATIONILLUMINANT2};
constexpr std::array<std::uint32_t, 2> forward_matrix{50964, 50965};
constexpr std::array<std::uint32_t, 3> opcode_list{51008, 51009, 51022};
constexpr std::uint32_t noise_profile = 51041, noise_reduction_applied = 50935;

/// Converts the values of rationals to float, as libtiff requires.
template <class Numbers>
std::vector<float> floats_of(const Numbers& numbers) {
  std::vector<float> out;
  out.reserve(std::size(numbers));
  for (const double number : numbers) out.push_back(static_cast<float>(number));
  return out;
}

template <class Numbers>
void set_floats(TIFF* tiff, std::uint32_t tag, const Numbers& numbers) {
  const std::vector<float> values = floats_of(numbers);
  TIFFSetField(tiff, tag, static_cast<int>(values.size()), values.data());
}

void set_matrix(TIFF* tiff, std::uint32_t tag, const Matrix3& m) {
  set_floats(tiff, tag, std::array{m[0][0], m[0][1], m[0][2], m[1][0], m[1][1], m[1][2], m[2][0], m[2][1], m[2][2]});
}

void set_pair(TIFF* tiff, std::uint32_t tag, double first, double second) {
  const std::array<float, 2> pair{static_cast<float>(first), static_cast<float>(second)};
  TIFFSetField(tiff, tag, pair.data());
}

void set_black(TIFF* tiff, const BlackLevel& black) {
  const std::array<std::uint16_t, 2> repeat{static_cast<std::uint16_t>(black.rows),
                                            static_cast<std::uint16_t>(black.columns)};
  // 1 x 1 is the default: RawTherapee takes three levels for one if it is stated.
  if (black.rows != 1 || black.columns != 1) TIFFSetField(tiff, TIFFTAG_BLACKLEVELREPEATDIM, repeat.data());
  set_floats(tiff, TIFFTAG_BLACKLEVEL, black.pattern_dn);
  if (!black.column_dn.empty()) set_floats(tiff, TIFFTAG_BLACKLEVELDELTAH, black.column_dn);
  if (!black.row_dn.empty()) set_floats(tiff, TIFFTAG_BLACKLEVELDELTAV, black.row_dn);
}

std::array<std::uint32_t, 4> edges_of(const Rect& r) {
  return {static_cast<std::uint32_t>(r.y), static_cast<std::uint32_t>(r.x), static_cast<std::uint32_t>(r.y + r.height),
          static_cast<std::uint32_t>(r.x + r.width)};
}

}  // namespace

void declare_dng_tags(TIFF* file) {
  static char names[][24] = {"ForwardMatrix1", "ForwardMatrix2", "OpcodeList1",          "OpcodeList2",
                             "OpcodeList3",    "NoiseProfile",   "NoiseReductionApplied"};
  constexpr short any = TIFF_VARIABLE, any32 = TIFF_VARIABLE2;
  static const TIFFFieldInfo fields[] = {
      {50964, any, any, TIFF_SRATIONAL, FIELD_CUSTOM, 1, 1, names[0]},
      {50965, any, any, TIFF_SRATIONAL, FIELD_CUSTOM, 1, 1, names[1]},
      {opcode_list[0], any32, any32, TIFF_UNDEFINED, FIELD_CUSTOM, 1, 1, names[2]},
      {opcode_list[1], any32, any32, TIFF_UNDEFINED, FIELD_CUSTOM, 1, 1, names[3]},
      {opcode_list[2], any32, any32, TIFF_UNDEFINED, FIELD_CUSTOM, 1, 1, names[4]},
      {noise_profile, any, any, TIFF_DOUBLE, FIELD_CUSTOM, 1, 1, names[5]},
      {noise_reduction_applied, any, any, TIFF_RATIONAL, FIELD_CUSTOM, 1, 1, names[6]},
  };
  TIFFMergeFieldInfo(file, fields, std::size(fields));
}

void set_dng_levels(TIFF* file, const RawDn& raw) {
  TIFFSetField(file, TIFFTAG_ACTIVEAREA, edges_of(raw.active).data());
  if (raw.masked_is_stated && !raw.masked.empty()) {
    std::vector<std::uint32_t> masked;
    for (const Rect& rect : raw.masked) {
      const auto edges = edges_of(rect);
      masked.insert(masked.end(), edges.begin(), edges.end());
    }
    TIFFSetField(file, TIFFTAG_MASKEDAREAS, static_cast<int>(masked.size()), masked.data());
  }
  set_pair(file, TIFFTAG_DEFAULTSCALE, 1, 1);
  set_pair(file, TIFFTAG_DEFAULTCROPORIGIN, raw.default_crop.x, raw.default_crop.y);
  set_pair(file, TIFFTAG_DEFAULTCROPSIZE, raw.default_crop.width, raw.default_crop.height);
  if (raw.black_tag) set_black(file, *raw.black_tag);
  std::array<std::uint32_t, 3> white{};
  for (int i = 0; i < 3; ++i) white[i] = static_cast<std::uint32_t>(std::lround(raw.white_dn[i]));
  TIFFSetField(file, TIFFTAG_WHITELEVEL, samples_of(raw.layout), white.data());
}

void set_dng_colour(TIFF* file, const CameraColour& colour) {
  for (std::size_t i = 0; i < colour.calibrations.size(); ++i) {
    const ColourCalibration& c = colour.calibrations[i];
    set_matrix(file, color_matrix[i], c.xyz_to_camera);
    if (c.camera_calibration != identity3()) set_matrix(file, camera_calibration[i], c.camera_calibration);
    if (c.forward) set_matrix(file, forward_matrix[i], *c.forward);
    if (const auto light = light_source_of(c.cct_k); light != 0) TIFFSetField(file, illuminant[i], light);
  }
  set_floats(file, TIFFTAG_ANALOGBALANCE, colour.analog_balance);
  if (colour.as_shot_neutral) {
    set_floats(file, TIFFTAG_ASSHOTNEUTRAL, *colour.as_shot_neutral);
  } else if (const auto& xy = colour.as_shot_white_xy) {  // DNG 1.4: one of the two, not both
    set_pair(file, TIFFTAG_ASSHOTWHITEXY, (*xy)[0], (*xy)[1]);
  }
}

void set_dng_noise_and_opcodes(TIFF* file, const RawFrame& frame) {
  if (frame.noise) {
    std::vector<double> pairs;
    const int planes = frame.raw.layout == SensorLayout::monochrome ? 1 : 3;
    for (int i = 0; i < planes; ++i) {
      pairs.push_back(frame.noise->scale[i]);
      pairs.push_back(frame.noise->offset[i]);
    }
    TIFFSetField(file, noise_profile, static_cast<int>(pairs.size()), pairs.data());
    if (frame.noise->reduced) set_floats(file, noise_reduction_applied, std::array{1.0});
  }
  if (frame.noise_ratio) {
    const std::vector<std::byte> bytes = encode_noise_ratio(*frame.noise_ratio);
    TIFFSetField(file, TIFFTAG_DNGPRIVATEDATA, static_cast<int>(bytes.size()), bytes.data());
  }
  const OpcodeLists lists = opcode_lists(frame);
  for (std::size_t i = 0; i < lists.size(); ++i) {
    if (lists[i].empty()) continue;
    TIFFSetField(file, opcode_list[i], static_cast<std::uint32_t>(lists[i].size()), lists[i].data());
  }
}

std::uint16_t light_source_of(double cct_k) {
  // Temperatures are those of CIE 15; fluorescent lamps other than F2: the centre of the range EXIF 2.32 gives.
  struct LightSource {
    std::uint16_t code;
    double cct_k;
  };
  constexpr LightSource known[] = {{17, 2856}, {16, 2925}, {24, 3200}, {15, 3525}, {14, 4150}, {2, 4230},  {18, 4874},
                                   {23, 5003}, {13, 5050}, {20, 5503}, {12, 6400}, {21, 6504}, {19, 6774}, {22, 7504}};
  if (!(cct_k > 0) || !std::isfinite(cct_k)) return 0;
  std::uint16_t nearest = 0;
  double least = std::numeric_limits<double>::infinity();
  for (const LightSource& light : known) {
    const double distance = std::fabs(1 / light.cct_k - 1 / cct_k);
    if (distance < least) {
      least = distance;
      nearest = light.code;
    }
  }
  return nearest;
}

namespace {

constexpr std::uint32_t fix_vignette_radial = 3, fix_bad_pixels_list = 5, gain_map = 9;
constexpr std::uint32_t since_version = 0x01030000;  // DNG 1.3 introduced them all

/// Writes numbers big-endian, whatever the byte order of the file.
class Numbers {
 public:
  void whole(int number) { put(static_cast<std::uint32_t>(number), 4); }
  void word(std::uint32_t number) { put(number, 4); }
  void number(double number) { put(std::bit_cast<std::uint64_t>(number), 8); }
  void number(float number) { put(std::bit_cast<std::uint32_t>(number), 4); }
  void append(const std::vector<std::byte>& more) { bytes_.insert(bytes_.end(), more.begin(), more.end()); }
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
    add({.id = id, .version = since_version, .parameters = parameters.bytes()});  // flags 0: must not be skipped
  }
  void add(const DngOpcode& opcode) {
    for (const std::uint32_t word : {opcode.id, opcode.version, opcode.flags}) opcodes_.word(word);
    opcodes_.word(static_cast<std::uint32_t>(opcode.parameters.size()));
    opcodes_.append(opcode.parameters);
    ++count_;
  }
  std::vector<std::byte> bytes() const {
    if (count_ == 0) return {};
    Numbers all;
    all.word(count_);
    all.append(opcodes_.bytes());
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

/// Returns the parameters of FixBadPixelsList. Positions count from the corner of the readout; so does the phase (DNG
/// 1.4, FixBadPixelsList).
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
  List first, second, third;
  const RawCorrections& c = frame.corrections;
  if (!c.defects.empty()) first.add(fix_bad_pixels_list, parameters_of(c.defects, frame.raw));
  for (const GainMap& map : c.gain_maps) second.add(gain_map, parameters_of(map));
  for (const RadialGain& radial : c.radial_gains) second.add(fix_vignette_radial, parameters_of(radial));
  for (const DngOpcode& opcode : c.not_applied[0]) second.add(opcode);
  for (const DngOpcode& opcode : c.not_applied[1]) third.add(opcode);
  return {first.bytes(), second.bytes(), third.bytes()};
}

std::uint32_t opcodes_version(const RawCorrections& corrections) {
  const bool any = !corrections.gain_maps.empty() || !corrections.radial_gains.empty() || !corrections.defects.empty();
  std::uint32_t version = any ? since_version : 0;
  for (const auto& list : corrections.not_applied) {
    for (const DngOpcode& opcode : list) {
      if (!opcode.is_optional()) version = std::max(version, opcode.version);
    }
  }
  return version;
}

}  // namespace lowlux::isp
