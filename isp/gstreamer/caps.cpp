#include "isp/gstreamer/caps.h"

#include <algorithm>
#include <array>
#include <initializer_list>
#include <string>
#include <string_view>

namespace lowlux::gst {
namespace {

constexpr int min_px = 2, max_px = 65535;
constexpr const char* bayer = "video/x-bayer";
constexpr const char* raw = "video/x-raw";

/// Names a mosaic as GStreamer and V4L2 do.
struct Mosaic {
  std::string_view name;
  std::uint32_t fourcc;
};

constexpr std::uint32_t v4l2(const char (&code)[5]) { return LOWLUX_STAGE_FOURCC(code[0], code[1], code[2], code[3]); }

constexpr std::array<Mosaic, 20> mosaics{{
    {"rggb", v4l2("RGGB")},     {"grbg", v4l2("GRBG")},     {"gbrg", v4l2("GBRG")},     {"bggr", v4l2("BA81")},
    {"rggb10le", v4l2("RG10")}, {"grbg10le", v4l2("BA10")}, {"gbrg10le", v4l2("GB10")}, {"bggr10le", v4l2("BG10")},
    {"rggb12le", v4l2("RG12")}, {"grbg12le", v4l2("BA12")}, {"gbrg12le", v4l2("GB12")}, {"bggr12le", v4l2("BG12")},
    {"rggb14le", v4l2("RG14")}, {"grbg14le", v4l2("GR14")}, {"gbrg14le", v4l2("GB14")}, {"bggr14le", v4l2("BG14")},
    {"rggb16le", v4l2("RG16")}, {"grbg16le", v4l2("GR16")}, {"gbrg16le", v4l2("GB16")}, {"bggr16le", v4l2("BYR2")},
}};
constexpr std::string_view clean_suffix = "16le";  // of denoised mosaics

/// Names monochrome frames as GStreamer and V4L2 do.
struct Grey {
  const char* name;
  std::uint32_t fourcc;
  int bits;
};

constexpr std::array<Grey, 2> greys{{{"GRAY8", v4l2("GREY"), 8}, {"GRAY16_LE", v4l2("Y16 "), 16}}};

/// Names an output as GStreamer and the stage do. Both name the order of bytes in memory.
struct Picture {
  const char* name;
  std::uint32_t fourcc;
};

constexpr std::array<Picture, 5> pictures{{{"RGBx", LOWLUX_STAGE_XBGR8888},
                                           {"BGRx", LOWLUX_STAGE_XRGB8888},
                                           {"RGB", LOWLUX_STAGE_BGR888},
                                           {"BGR", LOWLUX_STAGE_RGB888},
                                           {"NV12", LOWLUX_STAGE_NV12}}};

void append_name(GValue& list, std::string_view name) {
  GValue value = G_VALUE_INIT;
  g_value_init(&value, G_TYPE_STRING);
  g_value_set_string(&value, std::string(name).c_str());
  gst_value_list_append_and_take_value(&list, &value);
}

/// Sets a structure's format to the names of mosaics that a test accepts.
template <typename Accepts>
void set_mosaics(GstStructure* structure, const Accepts& accepts) {
  GValue list = G_VALUE_INIT;
  g_value_init(&list, GST_TYPE_LIST);
  for (const Mosaic& mosaic : mosaics) {
    if (accepts(mosaic.name)) append_name(list, mosaic.name);
  }
  gst_structure_take_value(structure, "format", &list);
}

void set_names(GstStructure* structure, const char* field, std::initializer_list<const char*> names) {
  GValue list = G_VALUE_INIT;
  g_value_init(&list, GST_TYPE_LIST);
  for (const char* name : names) append_name(list, name);
  gst_structure_take_value(structure, field, &list);
}

/// Appends pictures of the size of a structure. The stage writes NV12 by the matrix of BT.601 or BT.709, in the range
/// of video, the usual one of the size first. Its chroma is at the centre of 2x2 pixels, which GStreamer calls "jpeg":
/// without this name other elements would assume the position of MPEG-2, half a pixel to the left.
GstCaps* with_pictures(GstCaps* caps, GstStructure* rgb) {
  GstStructure* nv12 = gst_structure_copy(rgb);
  set_names(rgb, "format", {"RGBx", "BGRx", "RGB", "BGR"});
  gst_structure_set(nv12, "format", G_TYPE_STRING, "NV12", "chroma-site", G_TYPE_STRING, "jpeg", nullptr);
  int height = 0;
  const bool hd = gst_structure_get_int(nv12, "height", &height) != FALSE && height >= 720;
  set_names(nv12, "colorimetry",
            {hd ? GST_VIDEO_COLORIMETRY_BT709 : GST_VIDEO_COLORIMETRY_BT601,
             hd ? GST_VIDEO_COLORIMETRY_BT601 : GST_VIDEO_COLORIMETRY_BT709});
  return gst_caps_merge_structure(gst_caps_merge_structure(caps, rgb), nv12);
}

GstStructure* any_size(const char* name) {
  return gst_structure_new(name, "width", GST_TYPE_INT_RANGE, min_px, max_px, "height", GST_TYPE_INT_RANGE, min_px,
                           max_px, "framerate", GST_TYPE_FRACTION_RANGE, 0, 1, G_MAXINT, 1, nullptr);
}

/// Returns whether a format, or one in a list of formats, begins with the order of colours of this name.
bool has_order(const GValue* format, std::string_view name) {
  if (format == nullptr) return true;
  if (GST_VALUE_HOLDS_LIST(format)) {
    for (guint i = 0; i < gst_value_list_get_size(format); ++i) {
      if (has_order(gst_value_list_get_value(format, i), name)) return true;
    }
    return false;
  }
  return G_VALUE_HOLDS_STRING(format) && std::string_view(g_value_get_string(format)).starts_with(name.substr(0, 4));
}

/// Returns whether a format, or one in a list of formats, is monochrome.
bool has_grey(const GValue* format) {
  if (format == nullptr) return true;
  if (GST_VALUE_HOLDS_LIST(format)) {
    for (guint i = 0; i < gst_value_list_get_size(format); ++i) {
      if (has_grey(gst_value_list_get_value(format, i))) return true;
    }
    return false;
  }
  const char* const name = G_VALUE_HOLDS_STRING(format) ? g_value_get_string(format) : nullptr;
  return name != nullptr && std::ranges::find(greys, std::string_view(name), &Grey::name) != greys.end();
}

/// Copies a structure under another name, with those of its members that say nothing of formats.
GstStructure* same_frames(const GstStructure* from, const char* name) {
  GstStructure* out = gst_structure_new_empty(name);
  for (const char* field : {"width", "height", "framerate", "pixel-aspect-ratio", "interlace-mode"}) {
    if (const GValue* value = gst_structure_get_value(from, field)) gst_structure_set_value(out, field, value);
  }
  return out;
}

std::size_t padded(std::size_t count) { return (count + 3) / 4 * 4; }

/// Returns the one structure of fixed caps, and its size.
const GstStructure* fixed_structure(const GstCaps* caps, int& width, int& height) {
  if (caps == nullptr || !gst_caps_is_fixed(caps) || gst_caps_get_size(caps) != 1) return nullptr;
  const GstStructure* structure = gst_caps_get_structure(caps, 0);
  const bool sized = gst_structure_get_int(structure, "width", &width) != FALSE &&
                     gst_structure_get_int(structure, "height", &height) != FALSE;
  const auto fits = [](int side) { return side >= min_px && side <= max_px; };
  return sized && fits(width) && fits(height) ? structure : nullptr;
}

int bits_of(std::string_view name) { return name.size() == 4 ? 8 : 10 * (name[4] - '0') + (name[5] - '0'); }

}  // namespace

GstCaps* sink_template() {
  GstStructure* mosaic = any_size(bayer);
  set_mosaics(mosaic, [](std::string_view) { return true; });
  GstStructure* grey = any_size(raw);
  set_names(grey, "format", {greys[0].name, greys[1].name});
  return gst_caps_new_full(mosaic, grey, nullptr);
}

GstCaps* source_template() {
  GstStructure* picture = any_size(raw);
  set_names(picture, "format", {"RGBx", "BGRx", "RGB", "BGR", "NV12"});
  GstStructure* mosaic = any_size(bayer);
  set_mosaics(mosaic, [](std::string_view name) { return name.ends_with(clean_suffix); });
  return gst_caps_new_full(picture, mosaic, nullptr);
}

GstCaps* other_caps(GstPadDirection direction, const GstCaps* caps) {
  GstCaps* out = gst_caps_new_empty();
  for (guint i = 0; i < gst_caps_get_size(caps); ++i) {
    const GstStructure* from = gst_caps_get_structure(caps, i);
    const GValue* format = gst_structure_get_value(from, "format");
    const bool from_mosaic = gst_structure_has_name(from, bayer) != FALSE;
    if (direction == GST_PAD_SINK) {
      if (!from_mosaic && !has_grey(format)) continue;
      out = with_pictures(out, same_frames(from, raw));
      if (!from_mosaic) continue;
    }
    GstStructure* mosaic = same_frames(from, bayer);
    set_mosaics(mosaic, [&](std::string_view name) {
      return (direction == GST_PAD_SRC || name.ends_with(clean_suffix)) && (!from_mosaic || has_order(format, name));
    });
    out = gst_caps_merge_structure(out, mosaic);
    if (direction == GST_PAD_SINK || from_mosaic) continue;
    GstStructure* grey = same_frames(from, raw);
    set_names(grey, "format", {greys[0].name, greys[1].name});
    out = gst_caps_merge_structure(out, grey);
  }
  return out;
}

std::optional<InputCaps> read_input_caps(const GstCaps* caps) {
  InputCaps out;
  const GstStructure* structure = fixed_structure(caps, out.width, out.height);
  if (structure == nullptr) return std::nullopt;
  const char* const format = gst_structure_get_string(structure, "format");
  const std::string_view name = format == nullptr ? "" : format;
  out.is_mosaic = gst_structure_has_name(structure, bayer) != FALSE;
  if (out.is_mosaic) {
    const auto* const mosaic = std::ranges::find(mosaics, name, &Mosaic::name);
    if (mosaic == mosaics.end()) return std::nullopt;
    out.fourcc = mosaic->fourcc;
    out.bits = bits_of(mosaic->name);
  } else {
    const auto* const grey = std::ranges::find(greys, name, &Grey::name);
    if (grey == greys.end() || gst_structure_has_name(structure, raw) == FALSE) return std::nullopt;
    out.fourcc = grey->fourcc;
    out.bits = grey->bits;
  }
  const std::size_t sample_bytes = out.bits == 8 ? 1 : 2;
  out.row_bytes = static_cast<std::size_t>(out.width) * sample_bytes;
  out.stride = out.is_mosaic ? padded(static_cast<std::size_t>(out.width)) * sample_bytes : padded(out.row_bytes);
  return out;
}

std::size_t InputCaps::stride_of(std::size_t bytes) const {
  const auto rows = static_cast<std::size_t>(height);
  for (const std::size_t shorter : {padded(row_bytes), row_bytes}) {
    if (shorter < stride && bytes == shorter * rows) return shorter;
  }
  return stride;
}

std::optional<OutputCaps> read_output_caps(const GstCaps* caps) {
  if (const std::optional<InputCaps> mosaic = read_input_caps(caps)) {
    if (!mosaic->is_mosaic || mosaic->bits != 16) return std::nullopt;
    return OutputCaps{
        .fourcc = LOWLUX_STAGE_BAYER16, .stride = mosaic->stride, .width = mosaic->width, .height = mosaic->height};
  }
  OutputCaps out;
  if (fixed_structure(caps, out.width, out.height) == nullptr) return std::nullopt;
  if (gst_video_info_from_caps(&out.picture, caps) == FALSE) return std::nullopt;
  const std::string_view name = gst_video_format_to_string(GST_VIDEO_INFO_FORMAT(&out.picture));
  const auto* const picture = std::ranges::find(pictures, name, &Picture::name);
  if (picture == pictures.end()) return std::nullopt;
  out.fourcc = picture->fourcc;
  return out;
}

}  // namespace lowlux::gst
