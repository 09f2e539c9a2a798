#pragma once

#include "isp/base/frame.h"

namespace lowlux::python {

/// Returns a frame with everything but the samples.
RawFrame without_samples(const RawFrame& frame);

/// Returns a complete copy.
RawFrame clone(const RawFrame& frame);

}  // namespace lowlux::python
