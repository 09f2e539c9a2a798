#pragma once

#include <gst/gst.h>

namespace lowlux::gst {

/// Returns the type of the element `lowluxisp`: raw frames of a sensor to pictures, or to mosaics without noise.
GType lowlux_isp_type();

}  // namespace lowlux::gst
