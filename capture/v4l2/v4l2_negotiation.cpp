#include "capture/v4l2/v4l2_negotiation.h"

#include <algorithm>
#include <cstdint>
#include <tuple>
#include <utility>

#include <linux/videodev2.h>

#include "capture/file/pass_on.h"

namespace lowlux::capture {
namespace {

constexpr std::uint32_t max_pixels_a_side = 65536;

std::string size_text(std::uint32_t width, std::uint32_t height) {
  return std::to_string(width) + "x" + std::to_string(height);
}

/// Returns the formats that the driver offers, for errors: the raw formats with sizes, else the other ones.
std::string offers_text(V4l2Device& device) {
  constexpr std::size_t most = 12;
  std::vector<std::string> entries = raw_offers_text(device);
  if (entries.empty()) {
    for (const V4l2Offer& offer : list_offers(device)) entries.push_back(format_text(offer.fourcc));
    if (entries.empty()) return "no format";
  }
  std::string text;
  for (std::size_t i = 0; i < std::min(most, entries.size()); ++i) text += (i == 0 ? "" : ", ") + entries[i];
  return entries.size() > most ? text + " and " + std::to_string(entries.size() - most) + " more" : text;
}

std::string asked_text(const RawFormat& format) {
  const RawFormatNames* names = names_of(format);
  if (names != nullptr && !names->libcamera.empty()) return std::string(names->libcamera);
  if (names != nullptr && names->v4l2_fourcc != 0) return format_text(names->v4l2_fourcc);
  return "such raw format";
}

/// Returns the rank of a format, highest best: Bayer before monochrome, then depth; among equals the current format,
/// then the current mosaic order.
auto rank(const RawFormat& raw, std::uint32_t fourcc, const V4l2Layout& current) {
  const auto now = raw_format_of_v4l2(current.fourcc);
  return std::tuple(raw.layout == SensorLayout::bayer, raw.bits, fourcc == current.fourcc,
                    now && now->layout == raw.layout && now->phase == raw.phase);
}

/// Returns the format code to request.
Result<std::uint32_t> choose_format(V4l2Device& device, const CameraRequest& request, const V4l2Layout& current) {
  if (!request.format && device.media_controlled() && raw_format_of_v4l2(current.fourcc)) return current.fourcc;
  const V4l2Offer* best = nullptr;
  const std::vector<V4l2Offer> offers = list_offers(device);
  for (const V4l2Offer& offer : offers) {
    if (!offer.raw || (request.format && *offer.raw != *request.format)) continue;
    if (best == nullptr || rank(*offer.raw, offer.fourcc, current) > rank(*best->raw, best->fourcc, current)) {
      best = &offer;
    }
  }
  if (best != nullptr) return best->fourcc;
  if (device.gone()) return tl::make_unexpected(device.disconnected_error());
  const std::string lacks = request.format ? asked_text(*request.format) : "raw format that lowlux knows";
  return fail(ErrorCode::unsupported, device.name() + " has no " + lacks + ": it offers " + offers_text(device),
              device.path());
}

/// Returns the size to request.
V4l2Size choose_size(V4l2Device& device, const CameraRequest& request, std::uint32_t fourcc,
                     const V4l2Layout& current) {
  if (request.width) {
    return {static_cast<std::uint32_t>(*request.width), static_cast<std::uint32_t>(*request.height)};
  }
  const V4l2Sizes listed = device.media_controlled() ? V4l2Sizes{} : list_sizes(device, fourcc);
  if (!listed.range) {  // a range is that of a scaler, not of the sensor
    const auto largest =
        std::max_element(listed.sizes.begin(), listed.sizes.end(), [](const V4l2Size& a, const V4l2Size& b) {
          return std::uint64_t{a.width} * a.height < std::uint64_t{b.width} * b.height;
        });
    if (largest != listed.sizes.end()) return *largest;
  }
  return {current.width, current.height};
}

/// Checks that the driver's response is possible for a raw frame, consistent and within bounds.
Result<CameraFormat> checked(const V4l2Device& device, const V4l2Layout& got, const RawFormat& raw, int buffers) {
  const std::string what = format_text(got.fourcc) + " " + size_text(got.width, got.height);
  const auto refuse = [&](ErrorCode code, const std::string& why) {
    return fail(code, "the driver of " + device.name() + " answers with " + what + why, device.path());
  };
  if (got.planes != 1) {
    return refuse(ErrorCode::unsupported, " in " + std::to_string(got.planes) + " planes; raw frames have one");
  }
  if (got.field != V4L2_FIELD_NONE && got.field != V4L2_FIELD_ANY) {
    return refuse(ErrorCode::unsupported, " interlaced; lowlux takes whole frames only");
  }
  if (got.width == 0 || got.height == 0 || got.width > max_pixels_a_side || got.height > max_pixels_a_side) {
    return refuse(ErrorCode::malformed,
                  ", expected 1 to " + std::to_string(max_pixels_a_side) + " pixels a side: ask for another size");
  }
  CameraFormat format{.raw = raw,
                      .width = static_cast<int>(got.width),
                      .height = static_cast<int>(got.height),
                      .stride_bytes = got.stride_bytes,
                      .frame_rate_hz = std::nullopt};
  const std::size_t row = row_bytes(raw, format.width);
  if (format.stride_bytes < row) {
    return refuse(ErrorCode::malformed, " in rows of " + std::to_string(got.stride_bytes) + " bytes, which take " +
                                            std::to_string(row) + ": ask for another format");
  }
  if (got.buffer_bytes < frame_bytes(format)) {
    return refuse(ErrorCode::malformed, " in buffers of " + std::to_string(got.buffer_bytes) + " bytes, which take " +
                                            std::to_string(frame_bytes(format)) + ": ask for another format");
  }
  if (std::uint64_t{got.buffer_bytes} * static_cast<std::uint64_t>(buffers) > max_buffer_bytes) {
    return refuse(ErrorCode::too_large, " in " + std::to_string(buffers) + " buffers of " +
                                            std::to_string(got.buffer_bytes) + " bytes; the limit is " +
                                            std::to_string(max_buffer_bytes) + " bytes: ask for a smaller size");
  }
  return format;
}

}  // namespace

Result<V4l2Agreement> negotiate(V4l2Device& device, const CameraRequest& request) {
  auto current = read_layout(device);
  if (!current) return pass_on(current);
  const auto fourcc = choose_format(device, request, *current);
  if (!fourcc) return tl::make_unexpected(fourcc.error());
  const V4l2Size size = choose_size(device, request, *fourcc, *current);
  auto got = set_layout(device, *fourcc, size.width, size.height);
  if (!got) return pass_on(got);

  const auto raw = raw_format_of_v4l2(got->fourcc);
  const bool other_format = got->fourcc != *fourcc;
  const bool other_size = got->width != size.width || got->height != size.height;
  if (!raw || (other_format && request.format) || (other_size && request.width)) {
    return fail(ErrorCode::unsupported,
                "asked for " + format_text(*fourcc) + " " + size_text(size.width, size.height) + ", " + device.name() +
                    " makes it " + format_text(got->fourcc) + " " + size_text(got->width, got->height) +
                    ": it offers " + offers_text(device),
                device.path());
  }
  auto format = checked(device, *got, *raw, request.buffers);
  if (!format) return pass_on(format);
  V4l2Agreement out{.format = *format, .layout = *got, .warnings = {}};
  if (other_format || other_size) {
    out.warnings.push_back("the driver lists " + format_text(*fourcc) + " " + size_text(size.width, size.height) +
                           " and delivers " + format_text(got->fourcc) + " " + size_text(got->width, got->height));
  }
  return out;
}

namespace {

// Drivers end their lists with an error; a list of this length is assumed to be endless.
constexpr std::uint32_t max_formats = 256;
constexpr std::uint32_t max_sizes = 128;

V4l2Layout layout_of(const v4l2_format& told, bool multi_planar) {
  if (multi_planar) {
    const v4l2_pix_format_mplane& many = told.fmt.pix_mp;
    return {.fourcc = many.pixelformat,
            .width = many.width,
            .height = many.height,
            .stride_bytes = many.plane_fmt[0].bytesperline,
            .buffer_bytes = many.plane_fmt[0].sizeimage,
            .field = many.field,
            .planes = many.num_planes};
  }
  const v4l2_pix_format& one = told.fmt.pix;
  return {.fourcc = one.pixelformat,
          .width = one.width,
          .height = one.height,
          .stride_bytes = one.bytesperline,
          .buffer_bytes = one.sizeimage,
          .field = one.field,
          .planes = 1};
}

std::string size_text(const V4l2Size& size) { return std::to_string(size.width) + "x" + std::to_string(size.height); }

}  // namespace

Result<V4l2Layout> read_layout(V4l2Device& device) {
  v4l2_format told{};
  told.type = device.buffer_type();
  if (const int code = device.call(VIDIOC_G_FMT, &told)) {
    return tl::make_unexpected(device.error(code, "the driver does not state its format"));
  }
  return layout_of(told, device.multi_planar());
}

Result<V4l2Layout> set_layout(V4l2Device& device, std::uint32_t fourcc, std::uint32_t width, std::uint32_t height) {
  v4l2_format asked{};
  asked.type = device.buffer_type();
  if (device.multi_planar()) {
    v4l2_pix_format_mplane& many = asked.fmt.pix_mp;
    many.pixelformat = fourcc;
    many.width = width;
    many.height = height;
    many.field = V4L2_FIELD_NONE;
    many.num_planes = 1;
  } else {
    v4l2_pix_format& one = asked.fmt.pix;
    one.pixelformat = fourcc;
    one.width = width;
    one.height = height;
    one.field = V4L2_FIELD_NONE;
  }
  if (const int code = device.call(VIDIOC_S_FMT, &asked)) {
    return tl::make_unexpected(device.error(code, "the driver refuses the format " + format_text(fourcc)));
  }
  return layout_of(asked, device.multi_planar());
}

V4l2Sizes list_sizes(V4l2Device& device, std::uint32_t fourcc) {
  V4l2Sizes out;
  for (std::uint32_t index = 0; index < max_sizes; ++index) {
    v4l2_frmsizeenum one{};
    one.index = index;
    one.pixel_format = fourcc;
    if (device.call(VIDIOC_ENUM_FRAMESIZES, &one) != 0) break;
    if (one.type != V4L2_FRMSIZE_TYPE_DISCRETE) {
      const v4l2_frmsize_stepwise& range = one.stepwise;
      return {{{range.min_width, range.min_height}, {range.max_width, range.max_height}}, true};
    }
    out.sizes.push_back({one.discrete.width, one.discrete.height});
  }
  return out;
}

std::vector<V4l2Offer> list_offers(V4l2Device& device) {
  std::vector<V4l2Offer> out;
  for (std::uint32_t index = 0; index < max_formats; ++index) {
    v4l2_fmtdesc one{};
    one.index = index;
    one.type = device.buffer_type();
    if (device.call(VIDIOC_ENUM_FMT, &one) != 0) break;
    out.push_back({one.pixelformat, raw_format_of_v4l2(one.pixelformat)});
  }
  return out;
}

std::string format_text(std::uint32_t fourcc) {
  const auto raw = raw_format_of_v4l2(fourcc);
  return raw ? text_of(*raw) : v4l2_text(fourcc);
}

std::string sizes_text(const V4l2Sizes& sizes) {
  if (sizes.range) return size_text(sizes.sizes.front()) + " to " + size_text(sizes.sizes.back());
  std::string text;
  for (const V4l2Size& size : sizes.sizes) text += (text.empty() ? "" : " ") + size_text(size);
  return text;
}

std::vector<std::string> raw_offers_text(V4l2Device& device) {
  std::vector<std::string> out;
  for (const V4l2Offer& offer : list_offers(device)) {
    if (!offer.raw) continue;
    const std::string sizes = sizes_text(list_sizes(device, offer.fourcc));
    out.push_back(format_text(offer.fourcc) + (sizes.empty() ? "" : " " + sizes));
  }
  return out;
}

}  // namespace lowlux::capture
