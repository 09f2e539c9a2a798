#include "isp/cli/shared/report.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "calib/profile/profile_use.h"
#include "isp/base/camera_profile.h"
#include "isp/cli/shared/lines.h"
#include "isp/model/colour/camera_colour.h"
#include "isp/model/sensor/scene_luminance.h"
#include "isp/raw/black_point.h"
#include "isp/raw/to_linear.h"

namespace lowlux::cli {
namespace {

std::string rect_text(const Rect& r) { return fmt::format("{} x {} at ({}, {})", r.width, r.height, r.x, r.y); }

void add_layout(Lines& out, const RawDn& raw) {
  const bool rgb = raw.layout == SensorLayout::linear_rgb;
  const std::string layout = raw.from_x_trans ? "X-Trans, interpolated at reading"
                             : rgb            ? "demosaiced RGB"
                                              : calib::mosaic_of(raw);
  const std::string floats = raw.is_float() ? ", floating-point" : "";
  out.add("readout", fmt::format("{} x {}, {}{}", raw.row_samples() / (rgb ? 3 : 1), raw.rows(), layout, floats));
  out.add("active area", rect_text(raw.active));
  if (raw.default_crop != Rect{0, 0, raw.active.width, raw.active.height})
    out.add("default crop", rect_text(raw.default_crop));
  for (const Rect& r : raw.masked) out.add(raw.masked_is_stated ? "masked" : "border", rect_text(r));
  if (raw.info.orientation != Orientation::normal)
    out.add("orientation", fmt::format("EXIF {}", static_cast<int>(raw.info.orientation)));
}

void add_black(Lines& out, const RawFrame& frame) {
  const RawDn& raw = frame.raw;
  const isp::MaskedBlack measured = isp::masked_black_of(frame);
  out.add("black [DN]", fmt::format("{:>9} {:>9} {:>9} {:>9}", "site 00", "site 01", "site 10", "site 11"));
  if (raw.black_tag) {
    const int last = raw.black_tag->samples - 1;
    const auto tag = [&](int site) {
      return raw.black_tag->at(std::min(site & 1, raw.active.width - 1), std::min(site >> 1, raw.active.height - 1),
                               std::min(site, last));
    };
    out.add("  tag", fmt::format("{:9.2f} {:9.2f} {:9.2f} {:9.2f}", tag(0), tag(1), tag(2), tag(3)));
  } else {
    out.add("  tag", raw.is_black_zero_by_default ? "none, the default is 0" : "none");
  }
  if (!measured.black) {
    out.add("  measured", fmt::format("not: {}", measured.refusal));
    return;
  }
  const BlackPoint& b = *measured.black;
  const auto row = [&](const char* label, const PerSite<double>& v) {
    out.add(label, fmt::format("{:9.2f} {:9.2f} {:9.2f} {:9.2f}", v[0], v[1], v[2], v[3]));
  };
  row("  measured", b.pedestal_dn);
  row("  std. error", b.pedestal_standard_error_dn);
  row("  noise", b.noise_std_dn);
  out.add("  measured on", fmt::format("masked pixels {}: pedestal including dark charge", rect_text(measured.region)));
}

void add_noise(Lines& out, const RawFrame& frame) {
  if (!frame.noise) {
    out.add("noise profile", "none: the gain is unknown, values are fractions of white");
    return;
  }
  const NoiseProfile& n = *frame.noise;
  out.add("noise profile",
          fmt::format("variance = {:.3g} x + {:.3g} (green, x = 1 at white)", n.scale[1], n.offset[1]));
  if (const auto electrons = isp::electrons_at_white(frame.raw, n)) {
    const double green = 1 / n.scale[1];
    out.add("  says", fmt::format("{:.0f} e- at white, read noise {:.1f} e- (green)", green,
                                  std::sqrt(std::max(0.0, n.offset[1])) * green));
  }
  if (frame.noise_ratio) out.add("  differs", ratio_text(*frame.noise_ratio));
}

void add_exposure(Lines& out, const FrameInfo& info) {
  const auto value = [](const std::optional<double>& v, const char* unit) {
    return v ? fmt::format("{:g}{}", *v, unit) : std::string("not stated");
  };
  out.add("exposure",
          fmt::format("{}, {}, ISO {}", info.exposure_s ? exposure_text(*info.exposure_s) : "time not stated",
                      info.f_number ? f_number_text(*info.f_number) : "f-number not stated", value(info.iso, "")));
  out.add("temperature", value(info.temperature_c, " C"));
  if (const auto luminance = isp::saturation_luminance_cd_m2(info)) {
    out.add("luminance", fmt::format("saturates at about {:.3g} cd/m2 (estimated from f-number, ISO and exposure time)",
                                     *luminance));
  } else {
    out.add("luminance", "unknown: the estimate needs exposure time, f-number and ISO");
  }
}

void add_colour(Lines& out, const CameraColour& colour) {
  static constexpr const char* sources[] = {"none", "from the file", "from the decoder's table", "from the profile"};
  out.add("colour", fmt::format("{} calibration{} {}", colour.calibrations.size(),
                                colour.calibrations.size() == 1 ? "" : "s", sources[static_cast<int>(colour.source)]));
  for (const ColourCalibration& c : colour.calibrations) {
    const Matrix3& m = c.xyz_to_camera;
    out.add("  matrix", fmt::format("{:.4f} {:.4f} {:.4f}  {:.4f} {:.4f} {:.4f}  {:.4f} {:.4f} {:.4f}{}", m[0][0],
                                    m[0][1], m[0][2], m[1][0], m[1][1], m[1][2], m[2][0], m[2][1], m[2][2],
                                    c.cct_k > 0 ? fmt::format("  at {:.0f} K", c.cct_k)
                                                : std::string("  (illuminant not stated)")));
  }
  if (!colour.as_shot_neutral) {
    out.add("as-shot white", "not stated");
    return;
  }
  const Vector3& n = *colour.as_shot_neutral;
  const auto white = isp::white_of_neutral(colour, n);
  out.add("as-shot white",
          fmt::format("camera RGB {:.4f} {:.4f} {:.4f}{}", n[0], n[1], n[2],
                      white ? fmt::format(", {:.0f} K, duv {:+.4f}", white->cct_k, white->duv) : std::string()));
}

}  // namespace

std::string times_text(const std::vector<isp::StageTime>& times) {
  std::string text;
  double total = 0;
  for (const isp::StageTime& time : times) {
    text += fmt::format("  {:<20} {:8.1f} ms\n", time.stage, 1e3 * time.seconds);
    total += time.seconds;
  }
  return text + fmt::format("  {:<20} {:8.1f} ms\n", "sum", 1e3 * total);
}

std::string info_text(const std::string& file, const RawFrame& frame, const std::optional<NoiseOrigin>& noise) {
  Lines out;
  const FrameInfo& info = frame.raw.info;
  out.add("camera", camera_name(info.make, info.model) + (info.date_time.empty() ? "" : ", " + info.date_time));
  add_layout(out, frame.raw);
  add_black(out, frame);
  out.add("white [DN]",
          fmt::format("{:g} {:g} {:g}", frame.raw.white_dn[0], frame.raw.white_dn[1], frame.raw.white_dn[2]));
  add_noise(out, frame);
  if (noise) out.add("noise model", origin_text(*noise));
  add_exposure(out, info);
  add_colour(out, frame.colour);
  const RawCorrections& c = frame.corrections;
  out.add("corrections", fmt::format("{} gain maps, {} radial gains, {} named defects", c.gain_maps.size(),
                                     c.radial_gains.size(), c.defects.size()));
  for (const std::string& warning : frame.warnings) out.add("warning", warning);
  return one_line(file) + "\n" + out.text();
}

std::string error_line(const std::string& file, const Error& error) {
  std::string text = fmt::format("lowlux: {}: {}", file, error.message);
  if (!error.where.empty() && error.where != file && error.message.find(error.where) == std::string::npos) {
    text += fmt::format(" ({})", error.where);
  }
  return one_line(std::move(text));
}

namespace {

constexpr double longest_fraction_s = 0.25001;

/// Returns a number with at most `decimals` decimals.
std::string rounded(double value, int decimals) {
  const double scale = std::pow(10, decimals);
  return fmt::format("{}", std::round(value * scale) / scale);
}

}  // namespace

std::string exposure_text(double exposure_s) {
  if (exposure_s > 0 && exposure_s < longest_fraction_s) return fmt::format("1/{:.0f} s", 1 / exposure_s);
  return rounded(exposure_s, 1) + " s";
}

std::string f_number_text(double f_number) { return "f/" + rounded(f_number, f_number < 1 ? 2 : 1); }

std::array<double, 3> ratio_range(const NoiseRatio& ratio) {
  const auto [least, most] = std::minmax_element(ratio.ratio.data(), ratio.ratio.data() + ratio.ratio.size());
  return {static_cast<double>(*least), median_ratio(&ratio), static_cast<double>(*most)};
}

std::string ratio_text(const NoiseRatio& ratio) {
  const auto [least, median, most] = ratio_range(ratio);
  return fmt::format("{:.3g} to {:.3g} times this variance in blocks of {} px, median {:.3g}", least, most,
                     ratio.block_px, median);
}

}  // namespace lowlux::cli
