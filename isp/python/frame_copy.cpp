#include "isp/python/frame_copy.h"

namespace lowlux::python {

RawFrame without_samples(const RawFrame& frame) {
  RawFrame out;
  const RawDn& raw = frame.raw;
  out.raw.layout = raw.layout;
  out.raw.phase = raw.phase;
  out.raw.active = raw.active;
  out.raw.default_crop = raw.default_crop;
  out.raw.masked = raw.masked;
  out.raw.masked_is_stated = raw.masked_is_stated;
  out.raw.black_tag = raw.black_tag;
  out.raw.white_dn = raw.white_dn;
  out.raw.info = raw.info;
  out.colour = frame.colour;
  out.noise = frame.noise;
  out.noise_ratio = frame.noise_ratio;
  out.corrections = frame.corrections;
  out.source_tags = frame.source_tags;
  out.warnings = frame.warnings;
  return out;
}

RawFrame clone(const RawFrame& frame) {
  RawFrame out = without_samples(frame);
  out.raw.dn = frame.raw.dn.clone();
  out.raw.dn_float = frame.raw.dn_float.clone();
  return out;
}

}  // namespace lowlux::python
