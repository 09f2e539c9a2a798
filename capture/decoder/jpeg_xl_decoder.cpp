// The program lowlux-decode-jxl: see decoder_process.h.
#include "capture/decoder/jpeg_xl_decoder.h"

#include <jxl/decode.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <memory>
#include <new>
#include <optional>
#include <span>
#include <vector>

#include "capture/decoder/decoder_program.h"

namespace lowlux::capture {
namespace {

constexpr double full_scale = 65535;  // libjxl scales samples of any depth to 16 bits

struct Destroy {
  void operator()(JxlDecoder* decoder) const { JxlDecoderDestroy(decoder); }
};
using Decoder = std::unique_ptr<JxlDecoder, Destroy>;

struct Part {
  std::span<const std::byte> bytes;
  int left = 0, top = 0, width = 0, height = 0;  // what it covers of the image [pixels]
};

/// Returns the parts of a job; nullopt if its sizes do not agree.
std::optional<std::vector<Part>> parts_of(const JpegXlJob& job, std::span<const std::byte> data) {
  if (job.parts > data.size() / sizeof(std::uint64_t)) return std::nullopt;
  std::vector<std::uint64_t> sizes(job.parts);
  std::memcpy(sizes.data(), data.data(), job.parts * sizeof(std::uint64_t));
  data = data.subspan(job.parts * sizeof(std::uint64_t));
  const int across = (job.width + job.part_width - 1) / job.part_width;
  std::vector<Part> out;
  for (std::uint64_t i = 0; i < job.parts; ++i) {
    if (sizes[i] > data.size()) return std::nullopt;
    Part part{.bytes = data.first(sizes[i]),
              .left = static_cast<int>(i % static_cast<std::uint64_t>(across)) * job.part_width,
              .top = static_cast<int>(i / static_cast<std::uint64_t>(across)) * job.part_height};
    part.width = std::min(job.part_width, job.width - part.left);
    part.height = std::min(job.part_height, job.height - part.top);
    if (part.height < 1) return std::nullopt;
    out.push_back(part);
    data = data.subspan(sizes[i]);
  }
  return out;
}

/// Returns whether samples come as they were stored: those of the modular mode do, and those of XYB if the file names
/// its colours. The function of libjxl lost its second argument in release 0.9.
template <typename Query>
bool keeps_its_colours(Query query, const JxlDecoder* decoder, const JxlBasicInfo& info) {
  if (info.uses_original_profile != JXL_FALSE) return true;
  if constexpr (std::is_invocable_v<Query, const JxlDecoder*, JxlColorProfileTarget, JxlColorEncoding*>) {
    return query(decoder, JXL_COLOR_PROFILE_TARGET_ORIGINAL, nullptr) == JXL_DEC_SUCCESS;
  } else {
    return query(decoder, nullptr, JXL_COLOR_PROFILE_TARGET_ORIGINAL, nullptr) == JXL_DEC_SUCCESS;
  }
}

struct Decoded {
  int width = 0, height = 0;
  std::vector<std::uint16_t> samples;  // samples in units of full scale
};

/// Returns what is wrong with the header of a part; null if nothing is.
const char* fault_of(const JxlBasicInfo& info, const JpegXlJob& job, const Part& part) {
  if (info.num_color_channels != static_cast<std::uint32_t>(job.samples) || info.num_extra_channels != 0) {
    return "it has another number of channels";
  }
  const auto fits = [](std::uint32_t side, int whole, int covered) {
    return side == static_cast<std::uint32_t>(whole) || side == static_cast<std::uint32_t>(covered);
  };
  const bool sized = fits(info.xsize, job.part_width, part.width) && fits(info.ysize, job.part_height, part.height);
  return sized ? nullptr : "it does not have the size of its tile";
}

/// Decodes one part. @return what is wrong with it; null if nothing is
const char* decode_part(const JpegXlJob& job, const Part& part, Decoded& out) {
  const Decoder decoder(JxlDecoderCreate(nullptr));
  if (!decoder) throw std::bad_alloc();
  JxlDecoderSubscribeEvents(decoder.get(), JXL_DEC_BASIC_INFO | JXL_DEC_COLOR_ENCODING | JXL_DEC_FULL_IMAGE);
  JxlDecoderSetKeepOrientation(decoder.get(), JXL_TRUE);
  JxlDecoderSetInput(decoder.get(), reinterpret_cast<const std::uint8_t*>(part.bytes.data()), part.bytes.size());
  JxlDecoderCloseInput(decoder.get());
  const JxlPixelFormat format{static_cast<std::uint32_t>(job.samples), JXL_TYPE_UINT16, JXL_NATIVE_ENDIAN, 0};
  JxlBasicInfo info{};
  for (;;) {
    switch (JxlDecoderProcessInput(decoder.get())) {
      case JXL_DEC_BASIC_INFO:
        if (JxlDecoderGetBasicInfo(decoder.get(), &info) != JXL_DEC_SUCCESS) return "its header is damaged";
        if (const char* fault = fault_of(info, job, part)) return fault;
        break;
      case JXL_DEC_COLOR_ENCODING:
        if (!keeps_its_colours(JxlDecoderGetColorAsEncodedProfile, decoder.get(), info)) {
          return "its colours are those of an ICC profile";
        }
        break;
      case JXL_DEC_NEED_IMAGE_OUT_BUFFER: {
        out.width = static_cast<int>(info.xsize);
        out.height = static_cast<int>(info.ysize);
        out.samples.resize(std::size_t{info.xsize} * info.ysize * format.num_channels);
        const std::size_t bytes = out.samples.size() * sizeof(std::uint16_t);
        if (JxlDecoderSetImageOutBuffer(decoder.get(), &format, out.samples.data(), bytes) != JXL_DEC_SUCCESS) {
          return "its samples do not fit into the buffer";
        }
        break;
      }
      case JXL_DEC_FULL_IMAGE:
        return nullptr;
      case JXL_DEC_NEED_MORE_INPUT:
        return "it ends early";
      default:
        return "it is not JPEG XL, or damaged";
    }
  }
}

std::vector<std::uint16_t> codes_of_full_scale(int bits) {
  std::vector<std::uint16_t> out(65536);
  const double largest = (1 << bits) - 1;
  for (std::size_t i = 0; i < out.size(); ++i) {
    out[i] = static_cast<std::uint16_t>(std::lround(static_cast<double>(i) * largest / full_scale));
  }
  return out;
}

/// Decodes all parts to codes, in the rows of the image. The reason is filled in if one does not decode.
bool decode_parts(const JpegXlJob& job, const std::vector<Part>& parts, std::vector<std::uint16_t>& image,
                  DecodedHeader& header) {
  const std::vector<std::uint16_t> codes = codes_of_full_scale(job.bits);
  const std::ptrdiff_t row_samples = std::ptrdiff_t{job.width} * job.samples;
  Decoded decoded;
  for (const Part& part : parts) {
    if (const char* fault = decode_part(job, part, decoded)) {
      std::snprintf(header.reason, sizeof header.reason, "the JPEG XL from column %d, row %d on does not decode: %s",
                    part.left, part.top, fault);
      return false;
    }
    const std::ptrdiff_t part_samples = std::ptrdiff_t{decoded.width} * job.samples;
    for (int y = 0; y < part.height; ++y) {
      const auto from = decoded.samples.begin() + y * part_samples;
      std::transform(from, from + std::ptrdiff_t{part.width} * job.samples,
                     image.begin() + (part.top + y) * row_samples + std::ptrdiff_t{part.left} * job.samples,
                     [&](std::uint16_t value) { return codes[value]; });
    }
  }
  return true;
}

/// Decodes the parts of a JpegXlJob, which is the file, with libjxl.
void decode_with_libjxl(std::span<const std::byte> file, const ReadLimits& limits, DecodeSink& sink) {
  auto header = std::make_unique<DecodedHeader>();
  *header = {};
  header->outcome = DecodeOutcome::damaged;
  JpegXlJob job{};
  if (file.size() < sizeof job) return sink.finish(*header);
  std::memcpy(&job, file.data(), sizeof job);
  header->raw_width = job.width;
  header->raw_height = job.height;
  header->samples = job.samples;
  const auto side = [](int pixels) { return pixels >= 1 && pixels <= 65536; };
  const bool sound = side(job.width) && side(job.height) && side(job.part_width) && side(job.part_height) &&
                     (job.samples == 1 || job.samples == 3) && job.bits >= 8 && job.bits <= 16;
  const auto parts = sound ? parts_of(job, file.subspan(sizeof job)) : std::nullopt;
  if (!parts) return sink.finish(*header);
  if (std::int64_t{job.width} * job.height > limits.max_pixels) {
    header->outcome = DecodeOutcome::too_large;
    return sink.finish(*header);
  }
  std::vector<std::uint16_t> image(static_cast<std::size_t>(job.width) * static_cast<std::size_t>(job.height) *
                                   static_cast<std::size_t>(job.samples));
  if (decode_parts(job, *parts, image, *header)) {
    header->outcome =
        sink.write_samples(image.data(), image.size()) ? DecodeOutcome::decoded : DecodeOutcome::out_of_memory;
  }
  sink.finish(*header);
}

}  // namespace
}  // namespace lowlux::capture

int main(int count, char** arguments) {
  lowlux::capture::run_decoder(std::span(arguments, static_cast<std::size_t>(count)),
                               lowlux::capture::decode_with_libjxl);
}
