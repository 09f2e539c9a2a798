#pragma once

#include <string>

#include <gst/gst.h>

#include "isp/adapter/lowlux_stage.h"

namespace lowlux::gst {

/// Holds what the properties of an element state.
struct Properties {
  // These are settings of the stage, used when the element starts, and white when the caps are set.
  std::string profile;
  int threads = 0;
  int level = LOWLUX_STAGE_LEVEL_STANDARD;
  int demosaic = LOWLUX_STAGE_DEMOSAIC_DEFAULT;
  int look = LOWLUX_STAGE_LOOK_CAMERA;
  bool temporal = false;
  bool tone = true;
  double field_of_view_deg = 0;
  double white_level_dn = 0;
  // These apply to each frame; values below their ranges mean not known.
  double black_level_dn = -1;
  double exposure_s = 0;
  double analogue_gain = 0;
  double noise_gain_dn_per_e = 0;
  double noise_read_dn = -1;
  double red_gain = 0;
  double blue_gain = 0;
  double saturation = 1;
  double exposure_ev = -100;
  double lux = -1;
  double f_number = 0;
  double budget_ms = 0;
  bool posts_messages = false;

  lowlux_stage_settings settings() const;
  lowlux_stage_params params() const;
  /// Returns the white level for lowlux_stage_input; 0 if it is not stated.
  double stated_white_dn() const;
  /// Returns that a property has no effect because the one it requires is not known, in words; nullptr: none is.
  const char* without_effect() const;
};

/// Adds the properties to a class of elements; set_property and get_property have to be set before.
void install_properties(GObjectClass* element_class);

/// Sets or gets one property. @return false: there is none of this number
bool set_property(Properties& properties, guint id, const GValue* value);
bool get_property(const Properties& properties, guint id, GValue* value);

}  // namespace lowlux::gst
