#include "capture/libcamera/raw_stream.h"

#include <algorithm>
#include <optional>
#include <tuple>

namespace lowlux::capture {
namespace {

constexpr std::uint32_t largest_side_px = 65535;
constexpr std::uint64_t max_stream_bytes = std::uint64_t{4} << 30;

std::string pixels_text(std::int64_t width, std::int64_t height) {
  return std::to_string(width) + "x" + std::to_string(height);
}

std::string name_of(const RawFormat& format) {
  const RawFormatNames* names = names_of(format);
  return names == nullptr || names->libcamera.empty() ? std::string("a nameless format")
                                                      : std::string(names->libcamera);
}

std::string joined(const std::vector<std::string>& texts) {
  std::string all;
  for (const std::string& text : texts) all += (all.empty() ? "" : ", ") + text;
  return all;
}

bool lists(const OfferedStream& stream, const CameraRequest& request) {
  if (!request.width || !request.height) return false;
  const FrameSize wanted{*request.width, *request.height};
  return std::find(stream.sizes.begin(), stream.sizes.end(), wanted) != stream.sizes.end();
}

bool same_but_for_phase(const RawFormat& a, const RawFormat& b) {
  return a.bits == b.bits && a.packing == b.packing && a.layout == b.layout;
}

std::int64_t area_of(const FrameSize& size) { return std::int64_t{size.width} * size.height; }

FrameSize largest_of(const std::vector<FrameSize>& sizes) {
  FrameSize largest;
  for (const FrameSize& size : sizes) {
    if (area_of(size) > area_of(largest)) largest = size;
  }
  return largest;
}

Result<void> check_bytes(const AgreedStream& agreed, const CameraFormat& format) {
  if (format.stride_bytes < row_bytes(format.raw, format.width) || agreed.frame_bytes < frame_bytes(format)) {
    return fail(ErrorCode::malformed, "the camera states " + std::to_string(agreed.stride_bytes) +
                                          " bytes for a row and " + std::to_string(agreed.frame_bytes) +
                                          " for a frame, too few for " + pixels_text(agreed.width, agreed.height) +
                                          " of " + name_of(format.raw) + ", whose rows take " +
                                          std::to_string(row_bytes(format.raw, format.width)));
  }
  if (std::uint64_t{agreed.frame_bytes} * agreed.buffers > max_stream_bytes) {
    return fail(ErrorCode::too_large, std::to_string(agreed.buffers) + " buffers of " +
                                          std::to_string(agreed.frame_bytes) +
                                          " bytes are more than 4 GiB: ask for fewer or a smaller size");
  }
  return {};
}

Result<void> compare(const CameraFormat& format, const RawStreamChoice& choice, const CameraRequest& request,
                     std::vector<std::string>& warnings) {
  const std::string given = name_of(format.raw), wanted = name_of(choice.format);
  if (!same_but_for_phase(format.raw, choice.format)) {
    if (request.format) {
      return fail(ErrorCode::unsupported,
                  "the camera gives " + given + " in place of " + wanted + ": ask for that, or for another size");
    }
    warnings.push_back("the camera gives " + given + " in place of " + wanted);
  } else if (request.format && format.raw.phase != choice.format.phase) {
    warnings.push_back("the camera gives " + given + " in place of " + wanted +
                       ": the sensor's flips decide which colour comes first");
  }
  const FrameSize size{format.width, format.height};
  if (choice.size != FrameSize{} && size != choice.size) {
    const std::string text = "the camera gives " + pixels_text(size.width, size.height) + " in place of " +
                             pixels_text(choice.size.width, choice.size.height);
    if (request.width) return fail(ErrorCode::unsupported, text + ": ask for a size it has");
    warnings.push_back(text);
  }
  return {};
}

}  // namespace

std::vector<std::string> raw_stream_texts(std::span<const OfferedStream> offered) {
  std::vector<std::string> texts;
  texts.reserve(offered.size());
  for (const OfferedStream& stream : offered) {
    const auto format = raw_format_of_drm(stream.drm_fourcc, stream.drm_modifier);
    if (!format) continue;
    std::string text = name_of(*format);
    for (const FrameSize& size : stream.sizes) text += " " + pixels_text(size.width, size.height);
    texts.push_back(std::move(text));
  }
  return texts;
}

Result<RawStreamChoice> choose_raw_stream(std::span<const OfferedStream> offered, const CameraRequest& request,
                                          const std::string& camera) {
  const std::vector<std::string> there_is = raw_stream_texts(offered);
  if (there_is.empty()) {
    return fail(ErrorCode::unsupported,
                "this camera offers no raw stream in a known format, and lowlux develops raw frames only", camera);
  }
  const OfferedStream* best = nullptr;
  std::optional<RawFormat> best_format;
  const auto rank = [&](const OfferedStream& stream, const RawFormat& format) {
    return std::tuple(lists(stream, request), format.layout == SensorLayout::bayer, format.bits,
                      area_of(largest_of(stream.sizes)));
  };
  for (const OfferedStream& stream : offered) {
    const auto format = raw_format_of_drm(stream.drm_fourcc, stream.drm_modifier);
    if (!format || (request.format && *format != *request.format)) continue;
    if (best != nullptr && rank(stream, *format) <= rank(*best, *best_format)) continue;
    best = &stream;
    best_format = format;
  }
  if (best == nullptr) {
    return fail(ErrorCode::unsupported,
                "this camera does not offer " + name_of(*request.format) + ", but " + joined(there_is), camera);
  }
  RawStreamChoice choice{.format = *best_format, .drm_fourcc = best->drm_fourcc, .drm_modifier = best->drm_modifier};
  choice.size = request.width && request.height ? FrameSize{*request.width, *request.height} : largest_of(best->sizes);
  return choice;
}

Result<CameraFormat> agreed_format(const AgreedStream& agreed, const RawStreamChoice& choice,
                                   const CameraRequest& request, std::vector<std::string>& warnings) {
  const auto raw = raw_format_of_drm(agreed.drm_fourcc, agreed.drm_modifier);
  if (!raw) {
    return fail(ErrorCode::unsupported, "this camera offers no raw stream: asked for " + name_of(choice.format) +
                                            ", it gives a format that is not raw");
  }
  if (agreed.width < 1 || agreed.height < 1 || agreed.width > largest_side_px || agreed.height > largest_side_px) {
    return fail(ErrorCode::malformed, "the camera states a size of " + pixels_text(agreed.width, agreed.height) +
                                          ", which is not 1 to 65535");
  }
  CameraFormat format{.raw = *raw,
                      .width = static_cast<int>(agreed.width),
                      .height = static_cast<int>(agreed.height),
                      .stride_bytes = agreed.stride_bytes};
  return check_bytes(agreed, format).and_then([&] { return compare(format, choice, request, warnings); }).map([&] {
    return format;
  });
}

}  // namespace lowlux::capture
