// All of the DNG reader but the decoder, whose process costs a hundred times as much as the rest: it is played by
// samples of the size the tags say.
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>

#include "capture/dng/dng_frame.h"
#include "capture/dng/dng_rows.h"
#include "tests/fuzz/check_frame.h"
#include "tests/fuzz/input.h"

namespace {

constexpr std::int64_t max_pixels = 1 << 14;

lowlux::capture::DecodedRaw decoded(const lowlux::capture::DngImage& image) {
  lowlux::capture::DecodedRaw raw;
  raw.header.raw_width = image.width;
  raw.header.raw_height = image.height;
  raw.header.samples = image.samples;
  raw.header.sensor_temperature_c = raw.header.camera_temperature_c = -1000;
  raw.samples = lowlux::Plane<std::uint16_t>(image.width * image.samples, image.height);
  for (std::size_t i = 0; i < raw.samples.size(); ++i)
    raw.samples.data()[i] = static_cast<std::uint16_t>(i * 2654435761U >> 16);
  return raw;
}

}  // namespace

LOWLUX_FUZZ_TARGET(dng_tags)(const std::uint8_t* data, std::size_t size) {
  const auto bytes = std::as_bytes(std::span(data, size));
  const auto dng = lowlux::capture::open_dng(bytes);
  if (!dng || !*dng) return 0;
  for (const auto& raw_image : (*dng)->raw_images) {
    auto described = lowlux::capture::describe_dng(**dng, raw_image, size);
    if (!described) continue;
    const lowlux::capture::DngImage image = described->image;
    if (std::int64_t{image.width} * image.height > max_pixels) continue;
    if (image.is_float) {
      auto samples = lowlux::capture::decode_float_image(bytes, raw_image, image);
      if (!samples) continue;
      const auto frame = lowlux::capture::complete_dng(**dng, *std::move(described), *std::move(samples));
      if (frame) lowlux::test::check(*frame);
      continue;
    }
    if (image.decoder == lowlux::capture::DngDecoder::rows) {
      auto codes = lowlux::capture::decode_code_image(bytes, raw_image, image);
      if (!codes) continue;
      const auto frame = lowlux::capture::complete_dng(**dng, *std::move(described), *std::move(codes));
      if (frame) lowlux::test::check(*frame);
      continue;
    }
    const auto frame = lowlux::capture::complete_dng(**dng, *std::move(described), size, decoded(image));
    if (frame) lowlux::test::check(*frame);
  }
  return 0;
}
