// Frames from whatever the decoder's process says: it read the file with a library that may be wrong. Sizes and texts
// are as decode_contained() leaves them.
#include <cstddef>
#include <cstdint>
#include <utility>

#include "capture/file/decoder_frame.h"
#include "tests/fuzz/check_frame.h"
#include "tests/fuzz/input.h"

namespace {

constexpr int max_pixels = 64;  // each way

void keep_within(std::int32_t& size) {
  if (size < 1 || size > max_pixels) size = 1 + static_cast<int>(static_cast<std::uint32_t>(size) % max_pixels);
}

void end_texts(lowlux::capture::DecodedHeader& header) {
  header.reason[sizeof header.reason - 1] = 0;
  header.make[sizeof header.make - 1] = 0;
  header.model[sizeof header.model - 1] = 0;
  header.software[sizeof header.software - 1] = 0;
}

}  // namespace

LOWLUX_FUZZ_TARGET(decoder)(const std::uint8_t* data, std::size_t size) {
  lowlux::test::FuzzInput in{data, size};
  lowlux::capture::DecodedRaw decoded;
  auto& h = decoded.header;
  h.outcome = lowlux::capture::DecodeOutcome::decoded;
  auto* const bytes = reinterpret_cast<unsigned char*>(&h);
  constexpr std::size_t figures = offsetof(lowlux::capture::DecodedHeader, raw_width);
  constexpr std::size_t pattern = offsetof(lowlux::capture::DecodedHeader, pattern_black);
  constexpr std::size_t levels = offsetof(lowlux::capture::DecodedHeader, maximum);
  in.copy(bytes + figures, pattern - figures);
  in.copy(bytes + levels, sizeof h - levels);
  in.copy(h.pattern_black, sizeof h.pattern_black);
  keep_within(h.raw_width);
  keep_within(h.raw_height);
  h.samples = h.samples % 2 == 0 ? 1 : 3;
  end_texts(h);
  decoded.samples = lowlux::Plane<std::uint16_t>(h.raw_width * h.samples, h.raw_height);
  for (std::size_t i = 0; i < decoded.samples.size(); ++i) {
    decoded.samples.data()[i] = static_cast<std::uint16_t>(i * 2654435761U >> 16);
  }
  const auto frame = lowlux::capture::frame_of_decoder(std::move(decoded));
  if (frame) lowlux::test::check(*frame);
  return 0;
}
