#include "capture/dng/dng_image.h"

#include <algorithm>
#include <cmath>
#include <tuple>
#include <utility>

#include "capture/dng/dng_jpeg_xl.h"
#include "capture/dng/dng_lossy.h"
#include "capture/dng/dng_rows.h"
#include "capture/dng/dng_tags.h"
#include "capture/file/pass_on.h"
#include "isp/base/text.h"

namespace lowlux::capture {
namespace {

constexpr std::uint32_t max_size = 65535;

tl::unexpected<Error> wrong_size(std::uint32_t width, std::uint32_t height) {
  return fail(ErrorCode::malformed, "a raw image of " + std::to_string(width) + " x " + std::to_string(height) +
                                        " pixels cannot be decoded, 1 to " + std::to_string(max_size) +
                                        " each way can");
}

/// Returns whether the samples are floating-point numbers; else they are unsigned integers.
Result<bool> holds_floats(const TiffDirectory& directory) {
  constexpr double unsigned_integers = 1, floats = 3, undefined = 4;
  auto formats = directory.numbers(tag::sample_format, 1, 16);
  if (!formats) return pass_on(formats);
  if (!*formats) return false;
  const double format = (**formats)[0];
  const bool is_known = format == unsigned_integers || format == floats || format == undefined;
  if (is_known && std::ranges::count(**formats, format) == std::ssize(**formats)) return format == floats;
  return fail(ErrorCode::unsupported,
              "raws of signed or complex numbers or of mixed formats are not supported, unsigned integers and floats "
              "are (SampleFormat 1 and 3)",
              tag::sample_format.name);
}

Result<void> check_bits(double bits, bool is_float) {
  if (is_float) {
    if (bits == 16 || bits == 24 || bits == 32) return {};
    return fail(ErrorCode::unsupported,
                "floating-point raws of " + number_text(bits) + " bits per sample are not supported, 16, 24 and 32 are",
                tag::bits_per_sample.name);
  }
  if (bits >= 8 && bits <= 16 && bits == std::floor(bits)) return {};
  return fail(ErrorCode::unsupported,
              "raws of " + number_text(bits) + " bits per sample are not supported, 8 to 16 are",
              tag::bits_per_sample.name);
}

Result<int> bits_of(const TiffDirectory& directory, std::size_t samples, bool is_float) {
  auto bits = directory.numbers(tag::bits_per_sample, 1, 16);
  if (!bits) return pass_on(bits);
  if (!*bits) return fail(ErrorCode::malformed, "the tag BitsPerSample is missing", tag::bits_per_sample.name);
  const std::vector<double>& values = **bits;
  const bool equal = std::all_of(values.begin(), values.end(), [&](double b) { return b == values.front(); });
  if (!equal || (values.size() != 1 && values.size() < samples)) {
    return fail(ErrorCode::malformed, "the tag BitsPerSample does not agree with the samples",
                tag::bits_per_sample.name);
  }
  if (auto known = check_bits(values.front(), is_float); !known) return pass_on(known);
  return static_cast<int>(values.front());
}

/// Reads the side of a mosaic's pattern: 2, 4 or 6 sites.
Result<std::uint32_t> pattern_side(const TiffDirectory& directory) {
  auto size = directory.numbers(tag::cfa_repeat_pattern_dim, 2, 2);
  if (!size) return pass_on(size);
  if (!*size || **size == std::vector<double>{2, 2}) return 2;
  if (**size == std::vector<double>{4, 4}) return 4;
  if (**size == std::vector<double>{6, 6}) return 6;
  return fail(ErrorCode::unsupported,
              "repeating mosaics of " + number_text((**size)[0]) + " x " + number_text((**size)[1]) +
                  " sites are not supported: only Bayer, Quad Bayer and X-Trans mosaics and monochrome are",
              tag::cfa_repeat_pattern_dim.name);
}

/// Checks that sites are rectangular and have colours R, G, B.
Result<void> check_sites(const TiffDirectory& directory) {
  auto layout = directory.whole_or(tag::cfa_layout, 1);
  if (!layout) return pass_on(layout);
  if (*layout != 1) {
    return fail(ErrorCode::unsupported, "mosaics that are not rectangular are not supported", tag::cfa_layout.name);
  }
  auto planes = directory.numbers(tag::cfa_plane_color, 1, 16);
  if (!planes) return pass_on(planes);
  if (*planes && **planes != std::vector<double>{0, 1, 2}) {
    return fail(ErrorCode::unsupported, "mosaics of colours other than R, G, B are not supported",
                tag::cfa_plane_color.name);
  }
  return {};
}

/// Returns the phase of 36 colours.
Result<XTransPhase> x_trans_phase_of(const std::vector<double>& pattern) {
  std::vector<std::uint8_t> colours(pattern.size());
  std::transform(pattern.begin(), pattern.end(), colours.begin(), [](double colour) {
    return colour >= 0 && colour <= 2 ? static_cast<std::uint8_t>(colour) : std::uint8_t{3};
  });
  if (const auto phase = x_trans_phase(colours)) return *phase;
  return fail(ErrorCode::unsupported, "this mosaic of 6 x 6 sites is not X-Trans", tag::cfa_pattern.name);
}

Result<void> fill_mosaic(const TiffDirectory& directory, DngImage& image) {
  auto side = pattern_side(directory);
  if (!side) return pass_on(side);
  if (auto known = check_sites(directory); !known) return known;
  auto pattern = directory.numbers(tag::cfa_pattern, *side * *side, *side * *side);
  if (!pattern) return pass_on(pattern);
  if (!*pattern) return fail(ErrorCode::malformed, "the tag CFAPattern is missing", tag::cfa_pattern.name);
  if (*side == 6) {
    auto phase = x_trans_phase_of(**pattern);
    if (!phase) return pass_on(phase);
    image.x_trans = *phase;
    return {};
  }
  if (*side == 4) {
    image.quad_bayer = quad_bayer_of(**pattern);
    if (image.quad_bayer) return {};
    return fail(ErrorCode::unsupported, "this mosaic of 4 x 4 sites is not Quad Bayer", tag::cfa_pattern.name);
  }
  const std::vector<double> patterns[] = {{0, 1, 1, 2}, {1, 0, 2, 1}, {1, 2, 0, 1}, {2, 1, 1, 0}};
  const auto* const at = std::find(std::begin(patterns), std::end(patterns), **pattern);
  if (at == std::end(patterns)) {
    return fail(ErrorCode::unsupported, "this mosaic is not one of the four Bayer patterns of R, G, B",
                tag::cfa_pattern.name);
  }
  image.phase = static_cast<BayerPhase>(at - std::begin(patterns));
  return {};
}

/// Checks that there are as many tiles as the image needs. LibRaw leaves the rest of the image black.
Result<void> check_tile_count(const TiffDirectory& directory, const DngImage& image, const DngParts& parts) {
  if (!parts.tiled) return {};
  auto width = directory.whole_or(tag::tile_width, static_cast<std::uint32_t>(image.width));  // as LibRaw takes it
  if (!width) return pass_on(width);
  auto height = directory.whole_or(tag::tile_length, static_cast<std::uint32_t>(image.height));
  if (!height) return pass_on(height);
  if (*width < 1 || *height < 1) return fail(ErrorCode::malformed, "the strips or tiles have no pixels");
  const auto count = [](int pixels, double side) { return std::ceil(pixels / side); };
  return check_part_count(image, count(image.width, *width) * count(image.height, *height), parts);
}

/// Checks that lossless JPEG for LibRaw is inside the file and complete.
Result<void> check_lossless_jpeg(const TiffDirectory& directory, const DngImage& image, std::size_t file_bytes) {
  return dng_parts(directory, file_bytes).and_then([&](const DngParts& parts) {
    return check_tile_count(directory, image, parts);
  });
}

Result<DngDecoder> decoder_of(const TiffDirectory& directory, const DngImage& image, std::size_t file_bytes) {
  auto compression = directory.whole_or(tag::compression, tag::compression_none);
  if (!compression) return pass_on(compression);
  if (image.is_float || is_deflate(*compression)) return DngDecoder::rows;
  switch (*compression) {
    case tag::compression_none:
    case tag::compression_jpeg:
      return is_for_libraw(directory, image, file_bytes) ? DngDecoder::libraw : DngDecoder::rows;
    case tag::compression_lossy_jpeg:
      return DngDecoder::lossy_jpeg;
    case tag::compression_jpeg_xl:
      return DngDecoder::jpeg_xl;
    default:
      break;
  }
  std::string message =
      "the raw image is compressed with " + compression_name(*compression) + ", which lowlux does not decode: ";
  message += *compression == tag::compression_vc5 ? "convert it with GoPro's or Adobe's DNG converter"
                                                  : "convert it to a DNG with lossless JPEG or no compression";
  return fail(ErrorCode::unsupported, std::move(message), tag::compression.name);
}

/// Checks that the highest bit of each byte is the first one. The compressions that have an order of their own ignore
/// the tag, as libtiff does.
Result<void> check_bit_order(const TiffDirectory& directory) {
  auto compression = directory.whole_or(tag::compression, tag::compression_none);
  if (!compression) return pass_on(compression);
  if (*compression != tag::compression_none && !is_deflate(*compression)) return {};
  auto order = directory.whole_or(tag::fill_order, 1);
  if (!order) return pass_on(order);
  if (*order == 1) return {};
  return fail(ErrorCode::unsupported,
              "samples with the lowest bit of each byte first (FillOrder " + std::to_string(*order) +
                  ") are not supported: DNG stores the highest bit first (FillOrder 1)",
              tag::fill_order.name);
}

/// Checks that the image data are inside the file and stored as their decoder reads them.
Result<void> check_storage(const TiffDirectory& directory, const DngImage& image, std::size_t file_bytes) {
  if (image.is_planar && image.decoder != DngDecoder::rows) {
    return fail(
        ErrorCode::unsupported,
        "images stored colour after colour are supported without compression, in lossless JPEG or with Deflate only",
        tag::planar_configuration.name);
  }
  if (auto order = check_bit_order(directory); !order) return order;
  switch (image.decoder) {
    case DngDecoder::rows:
      return check_row_image(directory, image, file_bytes);
    case DngDecoder::lossy_jpeg:
      return check_lossy_image(directory, image, file_bytes);
    case DngDecoder::jpeg_xl:
      return check_jpeg_xl_image(directory, image, file_bytes);
    case DngDecoder::libraw:
      break;
  }
  const auto compression = directory.whole_or(tag::compression, tag::compression_none);
  if (compression && *compression == tag::compression_jpeg) return check_lossless_jpeg(directory, image, file_bytes);
  return {};
}

Result<void> fill_layout(const TiffDirectory& directory, DngImage& image) {
  auto photometric = required_whole(directory, tag::photometric);
  if (!photometric) return pass_on(photometric);
  if (*photometric == tag::photometric_cfa) {
    if (image.samples != 1) {
      return fail(ErrorCode::unsupported, "mosaics with more than one sample per pixel are not supported",
                  tag::samples_per_pixel.name);
    }
    return fill_mosaic(directory, image);
  }
  if (image.samples != 1 && image.samples != 3) {
    return fail(ErrorCode::unsupported,
                "LinearRaw images of " + std::to_string(image.samples) + " samples are not supported, 1 and 3 are",
                tag::samples_per_pixel.name);
  }
  auto planar = directory.whole_or(tag::planar_configuration, 1);
  if (!planar) return pass_on(planar);
  if (image.samples == 3 && *planar != 1 && *planar != 2) {
    return fail(ErrorCode::malformed, "the tag PlanarConfiguration is damaged", tag::planar_configuration.name);
  }
  image.is_planar = image.samples == 3 && *planar == 2;
  image.layout = image.samples == 1 ? SensorLayout::monochrome : SensorLayout::linear_rgb;
  return {};
}

/// Reads how many images the rows and columns are stored as: one but for JPEG XL.
Result<void> fill_interleave(const TiffDirectory& directory, DngImage& image) {
  const std::tuple<TagName, int, int&> sides[] = {
      {tag::row_interleave_factor, image.height, image.row_interleave},
      {tag::column_interleave_factor, image.width, image.column_interleave}};
  for (const auto& [name, pixels, factor] : sides) {
    auto stated = directory.whole_or(name, 1);
    if (!stated) return pass_on(stated);
    if (*stated == 1) continue;
    if (image.decoder != DngDecoder::jpeg_xl) {
      return fail(ErrorCode::unsupported, "raws whose rows or columns are stored apart are supported in JPEG XL alone",
                  name.name);
    }
    if (*stated < 1 || *stated > static_cast<std::uint32_t>(pixels)) {
      return fail(ErrorCode::malformed, std::string("the tag ") + name.name + " is damaged", name.name);
    }
    factor = static_cast<int>(*stated);
  }
  return {};
}

}  // namespace

Result<DngImage> dng_image(const TiffDirectory& directory, std::size_t file_bytes) {
  auto width = required_whole(directory, tag::image_width);
  if (!width) return pass_on(width);
  auto height = required_whole(directory, tag::image_length);
  if (!height) return pass_on(height);
  auto samples = directory.whole_or(tag::samples_per_pixel, 1);
  if (!samples) return pass_on(samples);
  auto is_float = holds_floats(directory);
  if (!is_float) return pass_on(is_float);
  if (std::min(*width, *height) < 1 || std::max(*width, *height) > max_size) return wrong_size(*width, *height);
  DngImage image;
  image.is_float = *is_float;
  image.width = static_cast<int>(*width);
  image.height = static_cast<int>(*height);
  image.samples = static_cast<int>(std::min<std::uint32_t>(*samples, 65535));
  auto bits = bits_of(directory, image.samples, image.is_float);
  if (!bits) return pass_on(bits);
  image.bits = *bits;
  if (auto layout = fill_layout(directory, image); !layout) return pass_on(layout);
  auto decoder = decoder_of(directory, image, file_bytes);
  if (!decoder) return pass_on(decoder);
  image.decoder = *decoder;
  if (auto interleave = fill_interleave(directory, image); !interleave) return pass_on(interleave);
  if (auto stored = check_storage(directory, image, file_bytes); !stored) return pass_on(stored);
  return image;
}

}  // namespace lowlux::capture
