// Tags that a picture can do without, damaged in every way there is: the picture is read, with one warning that names
// the tag. Those that only inform (EXIF) stay absent without one.
#include <functional>

#include "tests/capture/read_built.h"

namespace lowlux::test {
namespace {

constexpr std::size_t first_directory = 8, entry_bytes = 12;
const std::vector<double> matrix = {0.7, -0.2, -0.07, -0.45, 1.25, 0.22, -0.08, 0.18, 0.65};

struct OptionalTag {
  std::uint16_t id;
  const char* name;
  std::vector<double> sound;
  TagType type = TagType::srational;
  bool warns = true;             // or stays absent without a word
  bool only_positive = false;    // or matrices that must have an inverse
  bool text_is_numbers = false;  // any type of bytes serves
};

const std::vector<OptionalTag>& optional_tags() {
  static const std::vector<OptionalTag> tags = {
      {.id = 50718, .name = "DefaultScale", .sound = {1, 1}, .only_positive = true},
      {.id = 50720, .name = "DefaultCropSize", .sound = {24, 24}, .only_positive = true},
      {.id = 50722, .name = "ColorMatrix2", .sound = matrix, .only_positive = true},
      {.id = 50723, .name = "CameraCalibration1", .sound = matrix, .only_positive = true},
      {.id = 50727, .name = "AnalogBalance", .sound = {1, 1, 1}, .only_positive = true},
      {.id = 50728, .name = "AsShotNeutral", .sound = {0.5, 1, 0.6}, .only_positive = true},
      {.id = 50729, .name = "AsShotWhiteXY", .sound = {0.3457, 0.3585}, .only_positive = true},
      {.id = 50778, .name = "CalibrationIlluminant1", .sound = {21}, .only_positive = true},
      {.id = 50830, .name = "MaskedAreas", .sound = {0, 0, 2, 24}, .only_positive = true},
      {.id = 50964, .name = "ForwardMatrix1", .sound = matrix, .only_positive = true},
      {.id = 51041, .name = "NoiseProfile", .sound = {1e-4, 1e-8}, .type = TagType::f64, .only_positive = true},
      {.id = 51008, .name = "OpcodeList1", .sound = {}, .text_is_numbers = true},
      {.id = 51009, .name = "OpcodeList2", .sound = {}, .text_is_numbers = true},
      {.id = 51022, .name = "OpcodeList3", .sound = {}, .text_is_numbers = true},
      {.id = 274, .name = "Orientation", .sound = {1}, .warns = false},
      {.id = 306, .name = "DateTime", .sound = {1}, .warns = false},
      {.id = 33434, .name = "ExposureTime", .sound = {0.01}, .warns = false},
      {.id = 33437, .name = "FNumber", .sound = {4}, .warns = false},
      {.id = 34855, .name = "PhotographicSensitivity", .sound = {800}, .warns = false},
      {.id = 37386, .name = "FocalLength", .sound = {50}, .warns = false},
      {.id = 50730, .name = "BaselineExposure", .sound = {0.5}, .warns = false},
  };
  return tags;
}

Tag tag_of(const OptionalTag& tag, const std::vector<double>& values) {
  if (!tag.sound.empty()) return Tag::numbers(tag.type, values);
  std::vector<std::byte> list;  // one opcode, TrimBounds, without parameters
  for (const std::uint32_t word : {1U, 6U, 0x01030000U, 1U, 0U}) append_u32(list, word);
  return Tag::opaque(list);
}

/// Where the entry of a tag lies, in the first directory or that of EXIF.
std::size_t entry_of(const std::vector<std::byte>& file, std::uint16_t id) {
  const auto number = [&](std::size_t at, int bytes) {
    std::size_t value = 0;
    for (int i = bytes - 1; i >= 0; --i) value = value << 8 | std::to_integer<std::size_t>(file[at + i]);
    return value;
  };
  std::vector<std::size_t> directories{first_directory};
  for (std::size_t i = 0; i < directories.size(); ++i) {
    for (std::size_t entry = 0; entry < number(directories[i], 2); ++entry) {
      const std::size_t at = directories[i] + 2 + entry * entry_bytes;
      if (number(at, 2) == id) return at;
      if (number(at, 2) == 34665) directories.push_back(number(at + 8, 4));
    }
  }
  ADD_FAILURE() << "no tag " << id;
  return 0;
}

void put(std::vector<std::byte>& file, std::size_t at, std::uint32_t value, int bytes) {
  for (int i = 0; i < bytes; ++i) file[at + i] = static_cast<std::byte>(value >> (8 * i) & 255);
}

using File = std::vector<std::byte>;
using Damage = std::function<File(const OptionalTag&)>;

/// A sound tag whose entry says `value` in `bytes` bytes at `place` in place of the truth.
Damage lie(std::size_t place, std::uint32_t value, int bytes) {
  return [=](const OptionalTag& tag) {
    DngBuilder dng;
    File file = dng.set(tag.id, tag_of(tag, tag.sound)).build();
    put(file, entry_of(file, tag.id) + place, value, bytes);
    return file;
  };
}

Damage beyond_the_end() {
  return [](const OptionalTag& tag) {
    File file = lie(8, 0xFFFFFF00U, 4)(tag);
    const std::size_t at = entry_of(file, tag.id);
    put(file, at + 4, std::max<std::uint32_t>(5, std::to_integer<std::uint32_t>(file[at + 4])), 4);  // not in the entry
    return file;
  };
}

/// Values that all are the same.
Damage values(TagType type, double numerator, double denominator) {
  return [=](const OptionalTag& tag) {
    DngBuilder dng;
    if (type == TagType::f64) dng.set(tag.id, Tag::numbers(type, std::vector<double>(tag.sound.size(), numerator)));
    std::vector<std::pair<double, double>> all(tag.sound.size(), {numerator, denominator});
    if (type == TagType::srational) dng.set(tag.id, Tag::rationals(type, all));
    return dng.build();
  };
}

struct Case {
  const char* name;
  Damage damage;
  bool of_numbers = false;    // not for opcodes
  bool of_positives = false;  // damage only where numbers must be above zero
  bool of_type = false;
};

const std::vector<Case>& cases() {
  static const double nan = std::numeric_limits<double>::quiet_NaN(),
                      infinity = std::numeric_limits<double>::infinity();
  static const std::vector<Case> all = {
      {.name = "text", .damage = lie(2, 2, 2), .of_type = true},
      {.name = "unknown type", .damage = lie(2, 99, 2)},
      {.name = "no values", .damage = lie(4, 0, 4)},
      {.name = "4294967295 values", .damage = lie(4, 0xFFFFFFFFU, 4)},
      {.name = "2^29 values", .damage = lie(4, 1U << 29, 4)},
      {.name = "values beyond the end", .damage = beyond_the_end()},
      {.name = "NaN", .damage = values(TagType::f64, nan, 1), .of_numbers = true},
      {.name = "infinity", .damage = values(TagType::f64, infinity, 1), .of_numbers = true},
      {.name = "0/0", .damage = values(TagType::srational, 0, 0), .of_numbers = true},
      {.name = "1/0", .damage = values(TagType::srational, 1, 0), .of_numbers = true},
      {.name = "-1", .damage = values(TagType::srational, -1, 1), .of_numbers = true, .of_positives = true},
  };
  return all;
}

TEST(OptionalTags, DamageOfEachIsWarnedOfOnceAndThePictureIsRead) {
  for (const OptionalTag& tag : optional_tags()) {
    for (const Case& damaged : cases()) {
      if ((damaged.of_numbers && tag.sound.empty()) || (damaged.of_type && tag.text_is_numbers)) continue;
      SCOPED_TRACE(std::string(tag.name) + ": " + damaged.name);
      const auto frame = read_bytes(damaged.damage(tag));
      if (!frame) {
        ADD_FAILURE() << frame.error().message;
        continue;
      }
      EXPECT_EQ(samples_of(*frame), ramp(DngBuilder{}));
      const bool expected = tag.warns && (!damaged.of_positives || tag.only_positive);
      EXPECT_EQ(frame->warnings.size(), expected ? 1u : 0u);
      for (const std::string& warning : frame->warnings) {
        EXPECT_NE(warning.find(tag.name), std::string::npos) << warning;
        EXPECT_TRUE(warning.ends_with("; the tag is ignored")) << warning;
        EXPECT_EQ(warning.find('\n'), std::string::npos);
      }
    }
  }
}

// LibRaw takes DefaultScale from any directory. It is set under another number here, because it belongs to the raw
// image.
TEST(OptionalTags, ADefaultScaleDamagedInThePreviewDoesNoHarm) {
  constexpr std::uint16_t private_id = 65000, default_scale = 50718;
  for (const std::uint32_t type : {2U, 99U}) {
    DngBuilder dng;
    dng.raw_in_sub_ifd = true;
    File file = dng.set(private_id, Tag::numbers(TagType::srational, {1, 1})).build();
    const std::size_t at = entry_of(file, private_id);
    put(file, at, default_scale, 2);
    put(file, at + 2, type, 2);
    const auto frame = read_bytes(file);
    ASSERT_TRUE(frame) << type << ": " << frame.error().message;
    EXPECT_EQ(samples_of(*frame), ramp(dng));
    EXPECT_TRUE(frame->warnings.empty());
  }
}

TEST(OptionalTags, ADirectoryOfExifBeyondTheEndIsWarnedOf) {
  DngBuilder dng;
  File file = dng.set(33434, Tag::rationals(TagType::rational, {{1, 30}})).build();
  put(file, entry_of(file, 34665) + 8, 0x7FFFFFFF, 4);
  const auto frame = read_bytes(file);
  ASSERT_TRUE(frame) << frame.error().message;
  ASSERT_EQ(frame->warnings.size(), 1u);
  EXPECT_EQ(frame->warnings[0].find("the tag ExifIFD: the tag directory at byte 2147483647 lies beyond"), 0u);
}

}  // namespace
}  // namespace lowlux::test
