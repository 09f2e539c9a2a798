#include "isp/gstreamer/properties.h"

#include <algorithm>
#include <array>
#include <cstdint>

namespace lowlux::gst {
namespace {

constexpr auto always =
    static_cast<GParamFlags>(G_PARAM_READWRITE | G_PARAM_STATIC_STRINGS | GST_PARAM_MUTABLE_PLAYING);
constexpr auto before_start =
    static_cast<GParamFlags>(G_PARAM_READWRITE | G_PARAM_STATIC_STRINGS | GST_PARAM_MUTABLE_READY);

/// Describes a number that is a property.
struct Number {
  const char* name;
  const char* nick;
  const char* help;
  double least, most;
  double Properties::*member;
  GParamFlags flags = always;
};

constexpr std::array<Number, 14> numbers{{
    {"field-of-view", "Field of view",
     "Field of view of the longer side of the image [degrees]; 0: 50. For the look of the eye", 0, 180,
     &Properties::field_of_view_deg, before_start},
    {"white-level", "White level",
     "Code at which pixels of the frames are saturated; below 0.001: the largest code of the format", 0, 65535,
     &Properties::white_level_dn, before_start},
    {"black-level", "Black level", "Black level in codes of the frames; below 0: that of the profile, else measured",
     -1, 65535, &Properties::black_level_dn},
    {"exposure-time", "Exposure time", "Exposure time of the frames [s]; below 1e-7: not known", 0, 1e5,
     &Properties::exposure_s},
    {"analogue-gain", "Analogue gain",
     "Analogue gain of the frames, 1 is ISO 100 of the profile; below 0.1: not known, the profile's only setting or 1",
     0, 1e4, &Properties::analogue_gain},
    {"noise-gain", "System gain",
     "Codes per electron; below 1e-6: that of the profile, else measured. Requires noise-read", 0, 65535,
     &Properties::noise_gain_dn_per_e},
    {"noise-read", "Read noise",
     "Standard deviation of a pixel without light, in codes; below 0: not known. Requires noise-gain", -1, 65535,
     &Properties::noise_read_dn},
    {"red-gain", "Gain of red", "Gain of red for white, relative to green; below 0.001: estimated. Requires blue-gain",
     0, 1e3, &Properties::red_gain},
    {"blue-gain", "Gain of blue",
     "Gain of blue for white, relative to green; below 0.001: estimated. Requires red-gain", 0, 1e3,
     &Properties::blue_gain},
    {"saturation", "Saturation", "Saturation of the colours; 0: grey, 1: unchanged", 0, 4, &Properties::saturation},
    {"exposure-ev", "Exposure of the image", "Gain of the image [EV]; below -10: automatic", -100, 20,
     &Properties::exposure_ev},
    {"lux", "Illuminance", "Illuminance of the scene [lx], for the look of the eye; 0 or less: not known", -1, 1e6,
     &Properties::lux},
    {"f-number", "F-number", "F-number of the lens, for the look of the eye; below 0.1: not known", 0, 100,
     &Properties::f_number},
    {"budget-ms", "Time limit of a frame",
     "Time limit for a frame [ms], to which noise reduction is reduced in steps; below 0.01: no limit", 0, 1e6,
     &Properties::budget_ms},
}};

// Other properties follow the numbers, whose identifiers are 1 and on.
enum OtherId : guint {
  id_profile = numbers.size() + 1,
  id_threads,
  id_level,
  id_demosaic,
  id_look,
  id_temporal,
  id_tone,
  id_post_messages
};

GType level_type() {
  static const std::array<GEnumValue, 5> values{{{LOWLUX_STAGE_LEVEL_NONE, "No noise reduction", "none"},
                                                 {LOWLUX_STAGE_LEVEL_DRAFT, "Draft, the fastest", "draft"},
                                                 {LOWLUX_STAGE_LEVEL_STANDARD, "Standard", "standard"},
                                                 {LOWLUX_STAGE_LEVEL_HIGH, "High, the slowest", "high"},
                                                 {0, nullptr, nullptr}}};
  static const GType type = g_enum_register_static("LowluxLevel", values.data());
  return type;
}

GType demosaic_type() {
  static const std::array<GEnumValue, 6> values{
      {{LOWLUX_STAGE_DEMOSAIC_DEFAULT, "Encoded Malvar", "default"},
       {LOWLUX_STAGE_DEMOSAIC_MALVAR, "Malvar's filters in linear light", "malvar"},
       {LOWLUX_STAGE_DEMOSAIC_ENCODED_MALVAR, "Malvar's filters on encoded values", "encoded-malvar"},
       {LOWLUX_STAGE_DEMOSAIC_RESIDUAL, "Residual interpolation", "residual"},
       {LOWLUX_STAGE_DEMOSAIC_RESIDUAL_MEDIAN, "Residual interpolation, colours by medians", "residual-median"},
       {0, nullptr, nullptr}}};
  static const GType type = g_enum_register_static("LowluxDemosaic", values.data());
  return type;
}

GType look_type() {
  static const std::array<GEnumValue, 3> values{
      {{LOWLUX_STAGE_LOOK_CAMERA, "As a camera shows the scene", "camera"},
       {LOWLUX_STAGE_LOOK_EYE, "As an observer on site would perceive the scene", "eye"},
       {0, nullptr, nullptr}}};
  static const GType type = g_enum_register_static("LowluxLook", values.data());
  return type;
}

constexpr double min_white_level = 1e-3;
constexpr double min_noise_gain = 1e-6, min_noise_read = 0, min_colour_gain = 1e-3;  // that are known

}  // namespace

void install_properties(GObjectClass* element_class) {
  const Properties defaults;
  guint id = 1;
  for (const Number& number : numbers) {
    g_object_class_install_property(element_class, id++,
                                    g_param_spec_double(number.name, number.nick, number.help, number.least,
                                                        number.most, defaults.*number.member, number.flags));
  }
  const auto install = [&](guint other, GParamSpec* spec) {
    g_object_class_install_property(element_class, other, spec);
  };
  install(id_profile, g_param_spec_string("profile", "Profile", "File of `lowlux calibrate`: noise, black, colour",
                                          nullptr, before_start));
  install(id_threads, g_param_spec_int("threads", "Threads", "Number of threads for a frame; 0: 2", 0, 8,
                                       defaults.threads, before_start));
  install(id_level,
          g_param_spec_enum("level", "Level", "Highest level of noise reduction; the noise must be known or measurable",
                            level_type(), defaults.level, before_start));
  install(id_demosaic, g_param_spec_enum("demosaic", "Demosaicing",
                                         "Most expensive method by which missing colours are interpolated",
                                         demosaic_type(), defaults.demosaic, before_start));
  install(id_look, g_param_spec_enum("look", "Look", "Rendering: that of a camera or of the eye", look_type(),
                                     defaults.look, before_start));
  install(id_temporal, g_param_spec_boolean("temporal", "Temporal noise reduction", "Previous frames contribute",
                                            static_cast<gboolean>(defaults.temporal), before_start));
  install(id_tone,
          g_param_spec_boolean("tone", "Tone curve", "The standard curve; off: linear light in sRGB's encoding",
                               static_cast<gboolean>(defaults.tone), before_start));
  install(id_post_messages, g_param_spec_boolean("post-messages", "Post messages",
                                                 "Posts a message \"lowlux\" for each frame, with its processing",
                                                 static_cast<gboolean>(defaults.posts_messages), always));
}

bool set_property(Properties& properties, guint id, const GValue* value) {
  if (id >= 1 && id <= numbers.size()) {
    properties.*numbers[id - 1].member = g_value_get_double(value);
    return true;
  }
  switch (id) {
    case id_profile: {
      const char* name = g_value_get_string(value);
      properties.profile = name == nullptr ? "" : name;
      return true;
    }
    case id_threads:
      properties.threads = g_value_get_int(value);
      return true;
    case id_level:
      properties.level = g_value_get_enum(value);
      return true;
    case id_demosaic:
      properties.demosaic = g_value_get_enum(value);
      return true;
    case id_look:
      properties.look = g_value_get_enum(value);
      return true;
    case id_temporal:
      properties.temporal = g_value_get_boolean(value) != FALSE;
      return true;
    case id_tone:
      properties.tone = g_value_get_boolean(value) != FALSE;
      return true;
    case id_post_messages:
      properties.posts_messages = g_value_get_boolean(value) != FALSE;
      return true;
    default:
      return false;
  }
}

bool get_property(const Properties& properties, guint id, GValue* value) {
  if (id >= 1 && id <= numbers.size()) {
    g_value_set_double(value, properties.*numbers[id - 1].member);
    return true;
  }
  switch (id) {
    case id_profile:
      g_value_set_string(value, properties.profile.empty() ? nullptr : properties.profile.c_str());
      return true;
    case id_threads:
      g_value_set_int(value, properties.threads);
      return true;
    case id_level:
      g_value_set_enum(value, properties.level);
      return true;
    case id_demosaic:
      g_value_set_enum(value, properties.demosaic);
      return true;
    case id_look:
      g_value_set_enum(value, properties.look);
      return true;
    case id_temporal:
      g_value_set_boolean(value, static_cast<gboolean>(properties.temporal));
      return true;
    case id_tone:
      g_value_set_boolean(value, static_cast<gboolean>(properties.tone));
      return true;
    case id_post_messages:
      g_value_set_boolean(value, static_cast<gboolean>(properties.posts_messages));
      return true;
    default:
      return false;
  }
}

lowlux_stage_settings Properties::settings() const {
  lowlux_stage_settings out{};
  out.size = sizeof out;
  out.threads = threads;
  out.profile_file = profile.empty() ? nullptr : profile.c_str();
  out.most_denoise = level;
  out.temporal = temporal ? 1 : 0;
  out.look = look;
  out.tone = tone ? 1 : 0;
  out.field_of_view_deg = field_of_view_deg;
  out.demosaic = demosaic;
  return out;
}

double Properties::stated_white_dn() const { return white_level_dn < min_white_level ? 0 : white_level_dn; }

// Values below the minimum of the stage are not stated.
lowlux_stage_params Properties::params() const {
  lowlux_stage_params out{};
  out.size = sizeof out;
  const auto state = [&](bool known, std::uint32_t bit) {
    if (known) out.valid |= bit;
  };
  std::fill_n(out.black_level, 4, static_cast<float>(black_level_dn));
  state(black_level_dn >= 0, LOWLUX_STAGE_HAS_BLACK);
  out.exposure_s = exposure_s;
  state(exposure_s >= 1e-7, LOWLUX_STAGE_HAS_EXPOSURE);
  out.analogue_gain = static_cast<float>(analogue_gain);
  state(analogue_gain >= 0.1, LOWLUX_STAGE_HAS_ANALOGUE_GAIN);
  out.noise_gain = static_cast<float>(noise_gain_dn_per_e);
  out.noise_read = static_cast<float>(noise_read_dn);
  state(noise_gain_dn_per_e >= min_noise_gain && noise_read_dn >= min_noise_read, LOWLUX_STAGE_HAS_NOISE);
  out.colour_gains[0] = static_cast<float>(red_gain);
  out.colour_gains[1] = static_cast<float>(blue_gain);
  state(red_gain >= min_colour_gain && blue_gain >= min_colour_gain, LOWLUX_STAGE_HAS_COLOUR_GAINS);
  out.saturation = static_cast<float>(saturation);
  state(true, LOWLUX_STAGE_HAS_SATURATION);
  out.exposure_ev = static_cast<float>(exposure_ev);
  state(exposure_ev >= -10, LOWLUX_STAGE_HAS_EXPOSURE_VALUE);
  out.lux = static_cast<float>(lux);
  state(lux > 0, LOWLUX_STAGE_HAS_LUX);
  out.f_number = static_cast<float>(f_number);
  state(f_number >= 0.1, LOWLUX_STAGE_HAS_F_NUMBER);
  out.budget_ms = static_cast<float>(budget_ms);
  state(budget_ms >= 0.01, LOWLUX_STAGE_HAS_BUDGET);
  return out;
}

const char* Properties::without_effect() const {
  const bool red = red_gain >= min_colour_gain, blue = blue_gain >= min_colour_gain;
  if (red && !blue) return "red-gain has no effect: it requires blue-gain";
  if (blue && !red) return "blue-gain has no effect: it requires red-gain";
  const bool gain = noise_gain_dn_per_e >= min_noise_gain, read = noise_read_dn >= min_noise_read;
  if (gain && !read) return "noise-gain has no effect: it requires noise-read";
  if (read && !gain) return "noise-read has no effect: it requires noise-gain";
  return nullptr;
}

}  // namespace lowlux::gst
