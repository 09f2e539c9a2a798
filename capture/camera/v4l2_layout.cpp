#include "capture/camera/v4l2_layout.h"

#include <linux/videodev2.h>

#include <algorithm>

namespace lowlux::capture {
namespace {

// Lists of drivers end by an error; these are the lengths at which a list is taken to be without end.
constexpr std::uint32_t most_formats = 256;
constexpr std::uint32_t most_sizes = 128;

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
    return tl::make_unexpected(device.error(code, "the driver does not tell its format"));
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
  for (std::uint32_t index = 0; index < most_sizes; ++index) {
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
  for (std::uint32_t index = 0; index < most_formats; ++index) {
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
