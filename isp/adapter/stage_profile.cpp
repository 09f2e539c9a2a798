#include "isp/adapter/stage_profile.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <limits>
#include <utility>

#include <fmt/format.h>

#include "calib/profile/gain_interpolation.h"
#include "calib/profile/profile_io.h"
#include "calib/profile/profile_use.h"

namespace lowlux::isp {
namespace {

constexpr double shortest_frame_s = 0.04;
constexpr double hot_deviations = 6;

double between(double a, double b, double share) { return a + share * (b - a); }
double between_logs(double a, double b, double share) {
  return a > 0 && b > 0 ? std::exp(between(std::log(a), std::log(b), share)) : between(a, b, share);
}

/// Returns four ISO speeds for each octave from 2^-3 to 2^14 times 100, and the profile's own.
std::vector<double> iso_grid(const CameraProfile& profile) {
  std::vector<double> out;
  out.reserve(69 + profile.gains.size());
  for (int quarter = -12; quarter <= 56; ++quarter) out.push_back(calib::unit_iso * std::exp2(quarter / 4.0));
  for (const GainProfile& gain : profile.gains) {
    if (gain.iso) out.push_back(*gain.iso);
  }
  std::ranges::sort(out);
  return out;
}

/// Returns the dark current as calib::profile_at does: none if the pedestal includes it.
std::array<double, 3> dark_current_of(const GainProfile& gain) {
  const bool in_pedestal = gain.pedestal_holds == BlackPoint::Holds::pedestal_and_dark;
  return in_pedestal ? std::array<double, 3>{} : gain.sensor->dark_current_e_per_s;
}

/// Returns the dark doubling temperature as calib::profile_at does: if the darks state no temperature, their charge is
/// used at every temperature.
double dark_doubling_of(const GainProfile& gain) {
  const bool temperature_unknown = gain.dark_exposure_s && !gain.dark_temperature_c;
  return temperature_unknown ? std::numeric_limits<double>::infinity() : gain.sensor->dark_doubling_c;
}

/// Returns the text of a regular file, up to one byte more than the largest profile. Opening any other kind of file
/// must not wait for a writer.
Result<std::string> text_of_profile(const std::string& file) {
  const int fd = open(file.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK | O_NOCTTY);
  struct stat status {};
  const bool regular = fd >= 0 && fstat(fd, &status) == 0 && S_ISREG(status.st_mode);
  std::string text(regular ? calib::largest_profile_bytes + 1 : 0, '\0');
  std::size_t have = 0;
  ssize_t got = 1;
  while (got > 0 && have < text.size()) {
    got = ::read(fd, text.data() + have, text.size() - have);
    if (got < 0 && errno == EINTR)
      got = 1;
    else if (got > 0)
      have += static_cast<std::size_t>(got);
  }
  if (fd >= 0) close(fd);
  if (fd >= 0 && !regular) return fail(ErrorCode::unreadable, "the profile is not a regular file", file);
  if (fd < 0 || got < 0) return fail(ErrorCode::unreadable, "the profile cannot be read", file);
  text.resize(have);
  return text;
}

}  // namespace

Result<StageProfile> StageProfile::read(const std::string& file) {
  const auto text = text_of_profile(file);
  if (!text) return tl::make_unexpected(text.error());
  auto profile = calib::parse_profile(*text);
  if (!profile) return fail(profile.error().code, profile.error().message, file);
  auto out = of(*std::move(profile));
  if (!out) out.error().where = file;
  return out;
}

Result<StageProfile> StageProfile::of(CameraProfile profile) {
  StageProfile out;
  out.profile_ = std::move(profile);
  return out;
}

Result<void> StageProfile::prepare(const RawFormat& format, BayerPhase phase) {
  const bool monochrome = profile_.mosaic == "monochrome";
  const bool mono_stream = format.layout == SensorLayout::monochrome;
  if (!profile_.mosaic.empty() && monochrome != mono_stream) {
    return fail(ErrorCode::malformed,
                fmt::format("the profile was measured on a sensor that is {}, but the stream is {}", profile_.mosaic,
                            mono_stream ? "monochrome" : "a mosaic"));
  }
  format_ = format;
  phase_ = phase;
  rows_.clear();
  if (profile_.gains.empty()) return {};
  const std::vector<double> grid = iso_grid(profile_);
  rows_.reserve(grid.size());
  for (const double iso : grid) {
    const auto found = calib::gain_at_iso(profile_, iso);
    if (!found) return tl::make_unexpected(found.error());
    const GainProfile& gain = found->gain;
    if (!gain.sensor) {
      rows_.clear();
      return {};
    }
    Row row{.iso = iso,
            .gain_dn_per_e = gain.sensor->system_gain_dn_per_e,
            .read_noise_e = gain.sensor->read_noise_e,
            .dark_current_e_per_s = dark_current_of(gain),
            .dark_temperature_c = gain.sensor->dark_temperature_c,
            .dark_doubling_c = dark_doubling_of(gain),
            .codes = std::exp2(format.bits - gain.sensor->bits),
            .dark_is_apart = gain.pedestal_holds == BlackPoint::Holds::pedestal_only};
    if (gain.pedestal_dn) {
      row.pedestal_dn.emplace();
      for (int site = 0; site < 4; ++site) (*row.pedestal_dn)[site] = (*gain.pedestal_dn)[site].value;
    }
    rows_.push_back(row);
  }
  return {};
}

std::optional<StageSensor> StageProfile::at(std::optional<double> analogue_gain, std::optional<double> exposure_s,
                                            std::optional<double> temperature_c) const {
  if (rows_.empty()) return std::nullopt;
  const double stated_iso =
      analogue_gain ? calib::unit_iso * *analogue_gain : calib::only_iso(profile_).value_or(calib::unit_iso);
  const double iso = std::clamp(stated_iso, rows_.front().iso, rows_.back().iso);
  auto above = std::ranges::upper_bound(rows_, iso, {}, &Row::iso);
  if (above == rows_.end()) --above;
  const Row &b = *above, &a = above == rows_.begin() ? b : *(above - 1);
  const double share = b.iso > a.iso ? std::log(iso / a.iso) / std::log(b.iso / a.iso) : 0;
  const Row& nearer = share < 0.5 ? a : b;
  const double codes = nearer.codes;
  StageSensor out{.gain_dn_per_e = codes * between_logs(a.gain_dn_per_e, b.gain_dn_per_e, share)};
  out.read_noise_dn = out.gain_dn_per_e * between_logs(a.read_noise_e, b.read_noise_e, share);
  const double warmer_c = temperature_c.value_or(nearer.dark_temperature_c) - nearer.dark_temperature_c;
  const double charge_s = exposure_s.value_or(0) * std::exp2(warmer_c / nearer.dark_doubling_c);
  for (int site = 0; site < 4; ++site) {
    const bool bayer = format_.layout == SensorLayout::bayer;
    const auto colour = bayer ? static_cast<std::size_t>(colour_at(phase_, site & 1, site >> 1)) : 1;
    out.dark_e[site] = nearer.dark_current_e_per_s[colour] * charge_s;
  }
  out.dark_is_apart = a.dark_is_apart && b.dark_is_apart;
  if (a.pedestal_dn && b.pedestal_dn) {
    out.pedestal_dn.emplace();
    for (int site = 0; site < 4; ++site) {
      (*out.pedestal_dn)[site] = codes * between((*a.pedestal_dn)[site], (*b.pedestal_dn)[site], share);
    }
  }
  return out;
}

std::vector<ColourCalibration> StageProfile::calibrations() const { return calib::calibrations_of(profile_); }

std::vector<HotPixelFigure> StageProfile::hot_pixels() const {
  std::vector<HotPixelFigure> out;
  for (const GainProfile& gain : profile_.gains) {
    if (!gain.sensor) continue;
    for (const HotPixelFigure& hot : gain.hot_pixels) {
      if (hot.excess_e_per_s * shortest_frame_s > hot_deviations * gain.sensor->read_noise_e) out.push_back(hot);
    }
  }
  const auto place = [](const HotPixelFigure& hot) { return std::pair(hot.y, hot.x); };
  std::ranges::sort(out, {}, place);
  const auto same = [&](const HotPixelFigure& a, const HotPixelFigure& b) { return place(a) == place(b); };
  out.erase(std::unique(out.begin(), out.end(), same), out.end());
  return out;
}

}  // namespace lowlux::isp
