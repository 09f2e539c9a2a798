#include <algorithm>
#include <array>
#include <new>
#include <optional>
#include <string>

#include <gst/base/gstbasetransform.h>
#include <gst/gst.h>
#include <gst/video/gstvideopool.h>
#include <gst/video/video.h>

#include "isp/adapter/lowlux_stage.h"
#include "isp/gstreamer/caps.h"
#include "isp/gstreamer/properties.h"

namespace lowlux::gst {
namespace {

/// Holds the members of an element in addition to those of its base class.
struct State {
  Properties properties;  // under the lock of the object
  lowlux_stage* stage = nullptr;
  std::optional<InputCaps> in;
  std::optional<OutputCaps> out;
  const char* warning = nullptr;  // that was posted last
};

struct Element {
  GstBaseTransform base;
  State* state;
};

struct ElementClass {
  GstBaseTransformClass base;
};

gpointer parent_class = nullptr;

template <typename Any>
State& state_of(Any* object) {
  return *reinterpret_cast<Element*>(object)->state;
}

const GstBaseTransformClass* parent() { return static_cast<const GstBaseTransformClass*>(parent_class); }

Properties locked_properties(GstBaseTransform* element) {
  GST_OBJECT_LOCK(element);
  Properties out = state_of(element).properties;
  GST_OBJECT_UNLOCK(element);
  return out;
}

void set(GObject* object, guint id, const GValue* value, GParamSpec* spec) {
  GST_OBJECT_LOCK(object);
  const bool known = set_property(state_of(object).properties, id, value);
  GST_OBJECT_UNLOCK(object);
  if (!known) G_OBJECT_WARN_INVALID_PROPERTY_ID(object, id, spec);
}

void get(GObject* object, guint id, GValue* value, GParamSpec* spec) {
  GST_OBJECT_LOCK(object);
  const bool known = get_property(state_of(object).properties, id, value);
  GST_OBJECT_UNLOCK(object);
  if (!known) G_OBJECT_WARN_INVALID_PROPERTY_ID(object, id, spec);
}

void finalize(GObject* object) {
  delete reinterpret_cast<Element*>(object)->state;
  G_OBJECT_CLASS(parent_class)->finalize(object);
}

gboolean start(GstBaseTransform* element) {
  const Properties properties = locked_properties(element);
  const lowlux_stage_settings settings = properties.settings();
  std::array<char, 256> message{};
  if (lowlux_stage_open(&settings, &state_of(element).stage, message.data(), message.size()) < 0) {
    GST_ELEMENT_ERROR(element, RESOURCE, SETTINGS, ("%s", message.data()), (nullptr));
    return FALSE;
  }
  return TRUE;
}

gboolean stop(GstBaseTransform* element) {
  State& state = state_of(element);
  lowlux_stage_release(state.stage);
  state.stage = nullptr;
  state.in.reset();
  state.out.reset();
  return TRUE;
}

GstCaps* transform_caps(GstBaseTransform* /*element*/, GstPadDirection direction, GstCaps* caps, GstCaps* filter) {
  GstCaps* out = other_caps(direction, caps);
  if (filter == nullptr) return out;
  GstCaps* kept = gst_caps_intersect_full(filter, out, GST_CAPS_INTERSECT_FIRST);
  gst_caps_unref(out);
  return kept;
}

int matrix_of(const OutputCaps& out) {
  if (out.fourcc != LOWLUX_STAGE_NV12) return 0;
  return out.picture.colorimetry.matrix == GST_VIDEO_COLOR_MATRIX_BT709 ? 709 : 601;
}

gboolean set_caps(GstBaseTransform* element, GstCaps* in_caps, GstCaps* out_caps) {
  State& state = state_of(element);
  state.in = read_input_caps(in_caps);
  state.out = read_output_caps(out_caps);
  if (!state.in || !state.out) {
    GST_ELEMENT_ERROR(
        element, STREAM, FORMAT, ("lowluxisp does not support the format of the frames"),
        ("%" GST_PTR_FORMAT " to %" GST_PTR_FORMAT, static_cast<void*>(in_caps), static_cast<void*>(out_caps)));
    return FALSE;
  }
  lowlux_stage_input in{};
  in.size = sizeof in;
  in.api = LOWLUX_STAGE_V4L2;
  in.fourcc = state.in->fourcc;
  in.width = state.in->width;
  in.height = state.in->height;
  in.white_level = locked_properties(element).stated_white_dn();
  lowlux_stage_output out{};
  out.size = sizeof out;
  out.fourcc = state.out->fourcc;
  out.yuv_matrix = matrix_of(*state.out);
  if (lowlux_stage_configure(state.stage, &in, &out) < 0) {
    GST_ELEMENT_ERROR(
        element, STREAM, FORMAT, ("%s", lowlux_stage_last_error(state.stage)),
        ("%" GST_PTR_FORMAT " to %" GST_PTR_FORMAT, static_cast<void*>(in_caps), static_cast<void*>(out_caps)));
    state.in.reset();
    return FALSE;
  }
  return TRUE;
}

/// Rows of cameras may be padded, so buffers may be larger than their caps ask for: process() checks them.
gboolean transform_size(GstBaseTransform* /*element*/, GstPadDirection direction, GstCaps* /*caps*/, gsize size,
                        GstCaps* other, gsize* other_size) {
  if (direction == GST_PAD_SRC) {
    const std::optional<InputCaps> in = read_input_caps(other);
    *other_size = in ? in->stride * static_cast<std::size_t>(in->height) : size;
    return static_cast<gboolean>(in.has_value());
  }
  const std::optional<OutputCaps> out = read_output_caps(other);
  *other_size = out ? out->bytes() : size;
  return static_cast<gboolean>(out.has_value());
}

gboolean get_unit_size(GstBaseTransform* /*element*/, GstCaps* caps, gsize* size) {
  if (const std::optional<InputCaps> mosaic = read_input_caps(caps)) {
    *size = mosaic->stride * static_cast<std::size_t>(mosaic->height);
    return TRUE;
  }
  const std::optional<OutputCaps> out = read_output_caps(caps);
  if (out) *size = out->bytes();
  return static_cast<gboolean>(out.has_value());
}

gboolean propose_allocation(GstBaseTransform* element, GstQuery* decided, GstQuery* query) {
  if (parent()->propose_allocation(element, decided, query) == FALSE) return FALSE;
  gst_query_add_allocation_meta(query, GST_VIDEO_META_API_TYPE, nullptr);
  return TRUE;
}

/// Lets the buffers of a pool downstream have strides of their own.
gboolean decide_allocation(GstBaseTransform* element, GstQuery* query) {
  if (gst_query_get_n_allocation_pools(query) > 0) {
    GstBufferPool* pool = nullptr;
    guint size = 0, least = 0, most = 0;
    gst_query_parse_nth_allocation_pool(query, 0, &pool, &size, &least, &most);
    if (pool != nullptr && gst_query_find_allocation_meta(query, GST_VIDEO_META_API_TYPE, nullptr) != FALSE &&
        gst_buffer_pool_has_option(pool, GST_BUFFER_POOL_OPTION_VIDEO_META) != FALSE) {
      GstStructure* config = gst_buffer_pool_get_config(pool);
      gst_buffer_pool_config_add_option(config, GST_BUFFER_POOL_OPTION_VIDEO_META);
      gst_buffer_pool_set_config(pool, config);
    }
    if (pool != nullptr) gst_object_unref(pool);
  }
  return parent()->decide_allocation(element, query);
}

gboolean sink_event(GstBaseTransform* element, GstEvent* event) {
  State& state = state_of(element);
  if (GST_EVENT_TYPE(event) == GST_EVENT_FLUSH_STOP && state.stage != nullptr) lowlux_stage_reset(state.stage);
  return parent()->sink_event(element, event);
}

/// Posts what was done to a frame to the application.
void post(GstBaseTransform* element, const GstBuffer* frame, const lowlux_stage_result& done,
          const lowlux_stage_statistics& counted) {
  GstStructure* told = gst_structure_new(
      "lowlux", "timestamp", G_TYPE_UINT64, GST_BUFFER_PTS(frame), "level", G_TYPE_INT, done.level, "temporal",
      G_TYPE_BOOLEAN, static_cast<gboolean>(done.temporal), "step", G_TYPE_INT, done.step, "predicted-ms",
      G_TYPE_DOUBLE, static_cast<double>(done.predicted_ms), "took-ms", G_TYPE_DOUBLE,
      static_cast<double>(done.took_ms), "black-level", G_TYPE_DOUBLE, static_cast<double>(done.black_level[1]),
      "noise-gain", G_TYPE_DOUBLE, static_cast<double>(done.noise_gain), "noise-read", G_TYPE_DOUBLE,
      static_cast<double>(done.noise_read), "red-gain", G_TYPE_DOUBLE, static_cast<double>(done.colour_gains[0]),
      "blue-gain", G_TYPE_DOUBLE, static_cast<double>(done.colour_gains[1]), "exposure-ev", G_TYPE_DOUBLE,
      static_cast<double>(done.exposure_ev), "clipped", G_TYPE_DOUBLE, static_cast<double>(counted.clipped), nullptr);
  gst_element_post_message(GST_ELEMENT(element), gst_message_new_element(GST_OBJECT(element), told));
}

/// Holds the planes of an output buffer while they are written.
class MappedOutput {
 public:
  MappedOutput(GstBuffer* buffer, const OutputCaps& caps) : buffer_(buffer) {
    picture.size = sizeof picture;
    if (caps.is_mosaic()) {
      mapped_ = gst_buffer_map(buffer, &map_, GST_MAP_WRITE) != FALSE;
      picture.planes = 1;
      picture.plane[0] = {map_.data, map_.size, caps.stride};
      return;
    }
    is_frame_ = true;
    mapped_ = gst_video_frame_map(&frame_, &caps.picture, buffer, GST_MAP_WRITE) != FALSE;
    if (!mapped_) return;
    picture.planes = static_cast<int>(GST_VIDEO_FRAME_N_PLANES(&frame_));
    for (int i = 0; i < picture.planes; ++i) {
      const auto stride = static_cast<std::size_t>(GST_VIDEO_FRAME_PLANE_STRIDE(&frame_, i));
      const int rows = GST_VIDEO_FRAME_COMP_HEIGHT(&frame_, i);
      picture.plane[i] = {GST_VIDEO_FRAME_PLANE_DATA(&frame_, i), stride * static_cast<std::size_t>(rows), stride};
    }
  }
  ~MappedOutput() {
    if (!mapped_) return;
    if (is_frame_) {
      gst_video_frame_unmap(&frame_);
    } else {
      gst_buffer_unmap(buffer_, &map_);
    }
  }
  MappedOutput(const MappedOutput&) = delete;
  MappedOutput& operator=(const MappedOutput&) = delete;
  explicit operator bool() const { return mapped_; }

  lowlux_stage_picture picture{};

 private:
  GstBuffer* buffer_;
  GstMapInfo map_{};
  GstVideoFrame frame_{};
  bool is_frame_ = false, mapped_ = false;
};

/// Posts a warning about a property without effect, once until it changes.
void warn(GstBaseTransform* element, const Properties& properties) {
  const char* const warning = properties.without_effect();
  if (warning != nullptr && warning != state_of(element).warning) {
    GST_ELEMENT_WARNING(element, RESOURCE, SETTINGS, ("%s", warning), (nullptr));
  }
  state_of(element).warning = warning;
}

/// Returns what is wrong with a frame; advice is on properties of the element.
const char* error_text(const lowlux_stage* stage, int code) {
  if (code != LOWLUX_STAGE_UNKNOWN_LIGHT) return lowlux_stage_last_error(stage);
  return "the look of the eye needs the luminance of the scene: set lux, or exposure-time, f-number and analogue-gain";
}

/// Processes one mapped frame. @return a code of lowlux_stage.h
int process(GstBaseTransform* element, GstBuffer* in, const GstMapInfo& bytes, const lowlux_stage_picture& picture) {
  State& state = state_of(element);
  const Properties properties = locked_properties(element);
  warn(element, properties);
  lowlux_stage_params params = properties.params();
  if (GST_BUFFER_PTS_IS_VALID(in)) {
    params.timestamp_ns = GST_BUFFER_PTS(in);
    params.valid |= LOWLUX_STAGE_HAS_TIMESTAMP;
  }
  if (GST_BUFFER_FLAG_IS_SET(in, GST_BUFFER_FLAG_DISCONT)) lowlux_stage_reset(state.stage);
  lowlux_stage_source source{bytes.data, bytes.size, state.in->stride_of(bytes.size), -1};
  if (const GstVideoMeta* meta = gst_buffer_get_video_meta(in)) {
    const std::size_t skipped = std::min<std::size_t>(meta->offset[0], bytes.size);
    source = {bytes.data + skipped, bytes.size - skipped, static_cast<std::size_t>(std::max(meta->stride[0], 0)), -1};
  }
  lowlux_stage_result done{};
  done.size = sizeof done;
  lowlux_stage_statistics counted{};
  counted.size = sizeof counted;
  const int code = lowlux_stage_process(state.stage, &source, &picture, &params, &done,
                                        properties.posts_messages ? &counted : nullptr);
  if (code >= 0 && properties.posts_messages) post(element, in, done, counted);
  return code;
}

GstFlowReturn transform(GstBaseTransform* element, GstBuffer* in, GstBuffer* out) {
  State& state = state_of(element);
  if (!state.in || !state.out) return GST_FLOW_NOT_NEGOTIATED;
  GstMapInfo bytes{};
  if (gst_buffer_map(in, &bytes, GST_MAP_READ) == FALSE) {
    GST_ELEMENT_ERROR(element, RESOURCE, READ, ("A frame cannot be read"), (nullptr));
    return GST_FLOW_ERROR;
  }
  int code = LOWLUX_STAGE_MISSING_PLANE;
  {
    const MappedOutput mapped(out, *state.out);
    if (mapped) code = process(element, in, bytes, mapped.picture);
  }
  gst_buffer_unmap(in, &bytes);
  if (code >= 0) return GST_FLOW_OK;
  GST_ELEMENT_ERROR(element, STREAM, DECODE, ("%s", error_text(state.stage, code)),
                    ("code %d for a frame of %" G_GSIZE_FORMAT " bytes", code, bytes.size));
  return GST_FLOW_ERROR;
}

void add_pad(GstElementClass* element_class, const char* name, GstPadDirection direction, GstCaps* caps) {
  gst_element_class_add_pad_template(element_class, gst_pad_template_new(name, direction, GST_PAD_ALWAYS, caps));
  gst_caps_unref(caps);
}

void init_class(gpointer any_class, gpointer /*data*/) {
  parent_class = g_type_class_peek_parent(any_class);
  auto* object_class = static_cast<GObjectClass*>(any_class);
  object_class->set_property = set;
  object_class->get_property = get;
  object_class->finalize = finalize;
  install_properties(object_class);
  auto* element_class = static_cast<GstElementClass*>(any_class);
  gst_element_class_set_static_metadata(element_class, "lowlux ISP", "Filter/Converter/Video",
                                        "Converts raw frames of a sensor to images, for low light: black level, noise "
                                        "reduction, demosaicing, colour, look",
                                        "the lowlux authors");
  add_pad(element_class, "sink", GST_PAD_SINK, sink_template());
  add_pad(element_class, "src", GST_PAD_SRC, source_template());
  auto* transform_class = static_cast<GstBaseTransformClass*>(any_class);
  transform_class->start = start;
  transform_class->stop = stop;
  transform_class->transform_caps = transform_caps;
  transform_class->set_caps = set_caps;
  transform_class->transform_size = transform_size;
  transform_class->get_unit_size = get_unit_size;
  transform_class->propose_allocation = propose_allocation;
  transform_class->decide_allocation = decide_allocation;
  transform_class->sink_event = sink_event;
  transform_class->transform = transform;
}

void init_element(GTypeInstance* instance, gpointer /*any_class*/) {
  reinterpret_cast<Element*>(instance)->state = new State;
  gst_base_transform_set_qos_enabled(reinterpret_cast<GstBaseTransform*>(instance), TRUE);
}

/// Returns the type of the element `lowluxisp`: raw frames of a sensor to pictures, or to mosaics without noise.
GType lowlux_isp_type() {
  static const GType type =
      g_type_register_static_simple(GST_TYPE_BASE_TRANSFORM, "GstLowluxIsp", sizeof(ElementClass), init_class,
                                    sizeof(Element), init_element, static_cast<GTypeFlags>(0));
  return type;
}

gboolean add_elements(GstPlugin* plugin) {
  return gst_element_register(plugin, "lowluxisp", GST_RANK_NONE, lowlux_isp_type());
}

}  // namespace
}  // namespace lowlux::gst

#define PACKAGE "lowlux"
GST_PLUGIN_DEFINE(GST_VERSION_MAJOR, GST_VERSION_MINOR, lowlux, "A camera ISP for low light", lowlux::gst::add_elements,
                  LOWLUX_VERSION, "BSD", "lowlux", "lowlux")
