#include <gst/gst.h>

#include "isp/gstreamer/lowlux_isp.h"

namespace {

gboolean add_elements(GstPlugin* plugin) {
  return gst_element_register(plugin, "lowluxisp", GST_RANK_NONE, lowlux::gst::lowlux_isp_type());
}

}  // namespace

#define PACKAGE "lowlux"
GST_PLUGIN_DEFINE(GST_VERSION_MAJOR, GST_VERSION_MINOR, lowlux, "A camera ISP for low light", add_elements,
                  LOWLUX_VERSION, "BSD", "lowlux", "lowlux")
