#include "capture/dng/dng_frame.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "capture/dng/dng_colour.h"
#include "capture/dng/dng_image.h"
#include "capture/dng/dng_info.h"
#include "capture/dng/dng_levels.h"
#include "capture/dng/dng_opcodes.h"
#include "capture/dng/dng_tags.h"
#include "capture/file/decoder_frame.h"
#include "capture/file/pass_on.h"
#include "capture/x_trans/x_trans_frame.h"
#include "isp/base/float_samples.h"
#include "isp/base/text.h"
#include "isp/codec/noise_ratio_bytes.h"

namespace lowlux::capture {
namespace {

bool fits(const DngImage& image, const DecodedHeader& h) {
  return image.width == h.raw_width && image.height == h.raw_height && image.samples == h.samples;
}

/// Returns the description of the raw image that has the size and samples the decoder delivered.
Result<DngDescription> decoded_image(const DngFile& dng, DngDescription expected, std::size_t file_bytes,
                                     const DecodedHeader& h) {
  if (fits(expected.image, h)) return expected;
  for (const TiffDirectory& directory : dng.raw_images) {
    const auto image = dng_image(directory, file_bytes);
    if (image && image->decoder == DngDecoder::libraw && fits(*image, h))
      return describe_dng(dng, directory, file_bytes);
  }
  return fail(ErrorCode::malformed, "the decoder delivers " + std::to_string(h.raw_width) + " x " +
                                        std::to_string(h.raw_height) +
                                        " pixels, no raw image of this DNG has that size");
}

void read_colour_and_noise(const DngFile& dng, const TiffDirectory& directory, RawFrame& frame) {
  const bool coloured = frame.raw.layout != SensorLayout::monochrome;
  frame.noise = or_ignored(read_noise(dng, directory, coloured ? 3 : 1), frame.warnings);
  if (coloured) frame.colour = read_colour(dng, directory, frame.warnings);
}

/// Reads the noise ratio that lowlux wrote; DNGPrivateData of other makers is ignored, as is a tag without values.
void read_noise_ratio(const DngFile& dng, const TiffDirectory& directory, RawFrame& frame) {
  const TiffDirectory& home = dng.main.find(tag::dng_private_data) != nullptr ? dng.main : directory;
  const auto bytes = home.bytes(tag::dng_private_data);
  if (!bytes) return;
  const Rect& active = frame.raw.active;
  auto ratio = or_ignored(isp::decode_noise_ratio(*bytes, active.width, active.height), frame.warnings);
  if (ratio) frame.noise_ratio = std::make_shared<const NoiseRatio>(*std::move(ratio));
}

void warn_of_tables(const DngFile& dng, const TiffDirectory& directory, std::vector<std::string>& warnings) {
  const std::pair<TagName, const char*> tables[] = {{tag::profile_gain_table_map, "local brightness"},
                                                    {tag::profile_gain_table_map2, "local brightness"},
                                                    {tag::rgb_tables, "colours"}};
  for (const auto& [name, what] : tables) {
    if (directory.find(name) == nullptr && dng.main.find(name) == nullptr) continue;
    warnings.push_back(std::string(name.name) + " is not applied: its maker's image has other " + what);
  }
}

/// Returns a point of the unit square of the stored image in that of the upright image.
std::pair<double, double> upright(double x, double y, Orientation orientation) {
  switch (orientation) {
    case Orientation::mirror_horizontal:
      return {1 - x, y};
    case Orientation::rotate_180:
      return {1 - x, 1 - y};
    case Orientation::mirror_vertical:
      return {x, 1 - y};
    case Orientation::transpose:
      return {y, x};
    case Orientation::rotate_90:
      return {1 - y, x};
    case Orientation::transverse:
      return {1 - y, 1 - x};
    case Orientation::rotate_270:
      return {y, 1 - x};
    case Orientation::normal:
      break;
  }
  return {x, y};
}

/// Warns of a crop that the photographer chose in the camera: top, left, bottom and right as fractions of the default
/// crop (DNG 1.4, DefaultUserCrop). One that is damaged or keeps everything is ignored.
void warn_of_user_crop(const DngFile& dng, const TiffDirectory& directory, Orientation orientation,
                       std::vector<std::string>& warnings) {
  const TagName name = tag::default_user_crop;
  const auto stated = (directory.find(name) != nullptr ? directory : dng.main).numbers(name, 4, 4);
  if (!stated || !*stated) return;
  const double top = (**stated)[0], left = (**stated)[1], bottom = (**stated)[2], right = (**stated)[3];
  const bool is_sound = 0 <= top && top < bottom && bottom <= 1 && 0 <= left && left < right && right <= 1;
  if (!is_sound || (top == 0 && left == 0 && bottom == 1 && right == 1)) return;
  const auto [x0, y0] = upright(left, top, orientation);
  const auto [x1, y1] = upright(right, bottom, orientation);
  const auto percent = [](double fraction) { return number_text(100 * fraction, 4) + "%"; };
  warnings.push_back(std::string(name.name) + " is not applied: develop --crop " + percent(std::min(x0, x1)) + "," +
                     percent(std::min(y0, y1)) + "," + percent(std::fabs(x1 - x0)) + "," + percent(std::fabs(y1 - y0)) +
                     " keeps the part that the camera was set to");
}

/// Returns the directory that has an opcode list: that of the raw image, where DNG requires it, or the first one; null
/// if there is none.
const TiffDirectory* directory_of_list(const DngFile& dng, const DngDescription& described, int list) {
  for (const TiffDirectory* directory : {described.directory, &dng.main}) {
    if (directory->find(tag::opcode_list[list - 1]) != nullptr) return directory;
  }
  return nullptr;
}

/// Reads an opcode list, if there is one. A damaged list is ignored with a warning, unless it makes linear values of
/// the codes: without it the image would be wrong.
Result<void> read_list(const DngFile& dng, const DngDescription& described, int list, RawFrame& frame) {
  const TiffDirectory* const directory = directory_of_list(dng, described, list);
  if (directory == nullptr) return {};
  bool is_last = true;
  for (int later = list + 1; later <= 3; ++later) {
    is_last = is_last && directory_of_list(dng, described, later) == nullptr;
  }
  auto read = directory->bytes(tag::opcode_list[list - 1]).and_then([&](std::span<const std::byte> bytes) {
    return read_opcodes(bytes, list, is_last, described.image, frame);
  });
  if (read || (list == 2 && is_encoded(described.image))) return read;
  frame.warnings.push_back(ignored(read.error()));
  return {};
}

/// Returns whether the file states a version of DNG before 1.1.
bool is_dng_1_0(const DngFile& dng) {
  const auto version = dng.main.numbers(tag::dng_version, 4, 4);
  return version && *version && (**version)[0] == 1 && (**version)[1] == 0;
}

/// Makes linear samples of those that the file stores: opcodes of the first list, LinearizationTable, other opcodes.
Result<void> linearize(const DngFile& dng, const DngDescription& described, RawFrame& frame) {
  const TiffDirectory& directory = *described.directory;
  return read_list(dng, described, 1, frame)
      .and_then([&]() -> Result<void> {
        if (!frame.raw.is_float()) return apply_linearization_table(directory, frame.raw.dn);
        if (directory.find(tag::linearization_table) != nullptr) {
          frame.warnings.emplace_back("LinearizationTable is not applied: the samples are floating-point numbers");
        }
        return {};
      })
      .and_then([&] { return read_list(dng, described, 2, frame); })
      .and_then([&] { return read_list(dng, described, 3, frame); })
      .and_then([&]() -> Result<void> {
        auto unusable = frame.raw.is_float() ? unusable_sample(frame.raw) : std::nullopt;
        if (unusable) return fail(ErrorCode::malformed, *std::move(unusable));
        return {};
      });
}

/// Finishes a frame that has the samples that the file stores.
Result<RawFrame> finished(const DngFile& dng, const DngDescription& described, RawFrame frame, const XTransUse& use) {
  const TiffDirectory& directory = *described.directory;
  const std::optional<XTransPhase>& x_trans = described.image.x_trans;
  if (frame.colour.calibrations.empty() && frame.raw.layout != SensorLayout::monochrome) {
    if (auto sound = check_colour_matrices(dng, directory); !sound) return pass_on(sound);
  }
  if (auto linear = linearize(dng, described, frame); !linear) return pass_on(linear);
  ignore_impossible_white(frame.colour, frame.warnings);
  if (x_trans) {
    if (auto used = use_mosaic(frame, *x_trans, use); !used) return pass_on(used);
  }
  if (const auto& quad_bayer = described.image.quad_bayer) {
    if (auto binned = bin_quad_bayer(*quad_bayer, frame); !binned) return pass_on(binned);
  }
  return frame;
}

}  // namespace

Result<DngDescription> describe_dng(const DngFile& dng, const TiffDirectory& raw_image, std::size_t file_bytes) {
  auto image = dng_image(raw_image, file_bytes);
  if (!image) return pass_on(image);
  image->is_dng_1_0 = is_dng_1_0(dng);
  DngDescription described{&raw_image, *image, {}};
  RawFrame& frame = described.frame;
  frame.raw.layout = image->layout;
  frame.raw.phase = image->phase;
  frame.raw.info = read_info(dng);
  frame.warnings = dng.warnings;
  if (auto read = read_geometry(raw_image, *image, frame.raw, frame.warnings); !read) return pass_on(read);
  if (auto read = read_levels(raw_image, *image, frame.raw, frame.warnings); !read) return pass_on(read);
  read_colour_and_noise(dng, raw_image, frame);
  read_noise_ratio(dng, raw_image, frame);
  warn_of_tables(dng, raw_image, frame.warnings);
  warn_of_user_crop(dng, raw_image, frame.raw.info.orientation, frame.warnings);
  return described;
}

Result<RawFrame> complete_dng(const DngFile& dng, DngDescription described, std::size_t file_bytes, DecodedRaw decoded,
                              const XTransUse& use) {
  const DecodedHeader& h = decoded.header;
  auto chosen = decoded_image(dng, std::move(described), file_bytes, h);
  if (!chosen) return pass_on(chosen);
  RawFrame frame = std::move(chosen->frame);
  frame.raw.dn = std::move(decoded.samples);
  if (const auto celsius = decoder_temperature_c(h)) frame.raw.info.temperature_c = celsius;
  const auto table = table_calibration(h);
  if (table && frame.colour.calibrations.empty() && frame.raw.layout != SensorLayout::monochrome) {
    frame.colour.calibrations.push_back(*table);
    frame.colour.source = CameraColour::Source::decoder_table;
  }
  return finished(dng, *chosen, std::move(frame), use);
}

Result<RawFrame> complete_dng(const DngFile& dng, DngDescription described, Plane<std::uint16_t> codes,
                              const XTransUse& use) {
  RawFrame frame = std::move(described.frame);
  frame.raw.dn = std::move(codes);
  return finished(dng, described, std::move(frame), use);
}

Result<RawFrame> complete_dng(const DngFile& dng, DngDescription described, Plane<float> samples,
                              const XTransUse& use) {
  RawFrame frame = std::move(described.frame);
  frame.raw.dn_float = std::move(samples);
  return finished(dng, described, std::move(frame), use);
}

}  // namespace lowlux::capture
