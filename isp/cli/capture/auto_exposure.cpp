#include "isp/cli/capture/auto_exposure.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>

#include <fmt/format.h>

#include "calib/noise/exposure_gains.h"
#include "calib/profile/gain_interpolation.h"
#include "isp/base/camera_profile.h"
#include "isp/base/packed/raw_format.h"
#include "isp/cli/shared/exit_code.h"
#include "isp/cli/shared/profile_option.h"

namespace lowlux::cli {
namespace {

constexpr double usual_frame_rate_hz = 30;
constexpr double usual_clipped_fraction = 1e-3;
constexpr double first_exposure_s = 0.01;
constexpr int latency_of_controls = 4;  // frames from a setting to its effect, at most
constexpr double max_black = 0.25;      // of white: no camera has a higher pedestal

Result<isp::ExposureLimits> limits_of(const CaptureArgs& args, const capture::CameraFormat& format,
                                      const capture::ExposureControls& controls) {
  const AutoExposureArgs& asked = args.auto_exposure;
  isp::ExposureLimits out;
  out.times = {controls.min_s, controls.max_s, controls.step_s};
  out.longest_s = asked.longest_s.value_or(1 / format.frame_rate_hz.value_or(usual_frame_rate_hz));
  if (args.request.frame_rate_hz) out.longest_s = std::min(out.longest_s, 1 / *args.request.frame_rate_hz);
  if (out.longest_s < out.times.min_s) {
    return fail(ErrorCode::invalid_argument,
                fmt::format("is shorter than the camera's shortest exposure of {:g} s", out.times.min_s),
                "--max-exposure");
  }
  out.max_factor = asked.max_gain.value_or(out.max_factor);
  const auto least = std::ranges::min_element(controls.gains, {}, &capture::CameraGain::factor);
  if (least != controls.gains.end() && out.max_factor < least->factor) {
    return fail(ErrorCode::invalid_argument, fmt::format("is below the camera's smallest gain of {:g}", least->factor),
                "--max-gain");
  }
  out.mains = asked.mains.value_or(isp::Mains::either);
  out.clipped_fraction = asked.clipped_fraction.value_or(usual_clipped_fraction);
  return out;
}

/// Returns the profile of --profile; nothing without one.
Result<std::optional<CameraProfile>> profile_of(const CaptureArgs& args) {
  if (args.develop.profile.empty()) return std::optional<CameraProfile>();
  auto profile = read_profile(args.develop.profile);
  if (!profile) return tl::make_unexpected(with_file(profile.error(), args.develop.profile));
  return std::optional(*std::move(profile));
}

/// Returns the black level of --black, in the order of the sites.
std::optional<PerSite<double>> known_black(const CaptureArgs& args) {
  const isp::BlackRequest& black = args.develop.options.black;
  if (black.choice != isp::BlackChoice::given) return std::nullopt;
  PerSite<double> out{};
  std::ranges::copy(black.given_dn, out.begin());
  return out;
}

}  // namespace

AutoExposure::AutoExposure(capture::Camera& camera, isp::ExposureController::Setup setup,
                           std::vector<capture::CameraGain> gains, std::optional<PerSite<double>> black_dn)
    : camera_(camera),
      gains_(std::move(gains)),
      black_dn_(std::move(black_dn)),
      clipped_fraction_(setup.limits.clipped_fraction),
      controller_(std::move(setup)),
      meter_(camera.format().raw),
      row_(static_cast<std::size_t>(camera.format().width)) {}

Result<std::unique_ptr<AutoExposure>> AutoExposure::make(const CaptureArgs& args, capture::Camera& camera) {
  const capture::CameraFormat& format = camera.format();
  auto controls = camera.take_exposure();
  if (!controls) return tl::make_unexpected(controls.error());
  auto limits = limits_of(args, format, *controls);
  if (!limits) return tl::make_unexpected(limits.error());
  auto profile = profile_of(args);
  if (!profile) return tl::make_unexpected(profile.error());
  std::vector<double> factors;
  factors.reserve(controls->gains.size());
  for (const capture::CameraGain& gain : controls->gains) factors.push_back(gain.factor);
  if (factors.empty()) {
    const auto iso = *profile ? calib::only_iso(**profile) : std::nullopt;
    factors.push_back(args.request.analogue_gain.value_or(iso.value_or(calib::unit_iso) / calib::unit_iso));
  }
  const double white_dn = largest_code(format.raw);
  auto gains = calib::exposure_gains(factors, format.raw, white_dn, *profile ? &**profile : nullptr);
  if (!gains) return tl::make_unexpected(with_file(gains.error(), args.develop.profile));
  isp::ExposureController::Setup setup{
      .gains = *std::move(gains),
      .limits = *limits,
      .at = {isp::allowed_time_s(std::min(first_exposure_s, limits->longest_s), *limits), 0},
      .latency_frames = latency_of_controls + args.request.buffers};
  std::unique_ptr<AutoExposure> out(
      new AutoExposure(camera, std::move(setup), std::move(controls->gains), known_black(args)));
  if (auto first = out->set(out->controller_.setting()); !first) return tl::make_unexpected(first.error());
  return out;
}

Result<void> AutoExposure::set(const isp::ExposureSetting& setting) {
  capture::CameraExposure exposure{.exposure_s = setting.exposure_s, .gain = std::nullopt};
  if (!gains_.empty()) exposure.gain = gains_[setting.gain];
  const auto had_s = camera_.set_exposure(exposure);
  if (!had_s) return tl::make_unexpected(had_s.error());
  controller_.was_set(*had_s);
  return {};
}

isp::MeteredBlack AutoExposure::black_of(const capture::FrameFacts& facts) {
  if (black_dn_) return {*black_dn_};
  isp::MeteredBlack out;
  const RawFormat& format = camera_.format().raw;
  if (facts.black_level_dn) {
    for (int site = 0; site < 4; ++site) out.dn[site] = (*facts.black_level_dn)[black_channel_of(site, format.phase)];
    return out;
  }
  const PerSite<double> darkest = meter_.darkest_dn();
  if (!darkest_dn_) darkest_dn_.emplace().fill(max_black * largest_code(format));
  for (int site = 0; site < 4; ++site) (*darkest_dn_)[site] = std::min((*darkest_dn_)[site], darkest[site]);
  return {*darkest_dn_, true};
}

isp::MeteredCodes AutoExposure::meter(const capture::CameraFrame& frame) {
  const capture::CameraFormat& format = camera_.format();
  meter_.clear();
  for (int y = 0; y < format.height; ++y) {
    if (!isp::is_metered_row(y, format.height)) continue;
    unpack_row(format.raw, frame.bytes.data() + static_cast<std::size_t>(y) * format.stride_bytes, format.width,
               row_.data());
    meter_.add_row(row_.data(), format.width, y);
  }
  return meter_.codes(black_of(frame.facts), largest_code(format.raw), clipped_fraction_);
}

std::optional<isp::StatedExposure> AutoExposure::stated_by(const capture::FrameFacts& facts) const {
  const bool positive = facts.exposure_s.value_or(0) > 0 && facts.analogue_gain.value_or(gains_.empty() ? 1 : 0) > 0;
  if (!positive) return std::nullopt;
  const double own = controller_.gains()[controller_.setting().gain].factor;
  return isp::StatedExposure{*facts.exposure_s, gains_.empty() ? own : *facts.analogue_gain};
}

Result<void> AutoExposure::take(capture::CameraFrame& frame) {
  ++frames_;
  const auto stated = stated_by(frame.facts);
  if (!stated && !controller_.awaits()) {
    frame.facts.exposure_s = controller_.setting().exposure_s;
    if (!gains_.empty()) frame.facts.analogue_gain = gains_[controller_.setting().gain].factor;
  }
  const auto wanted = controller_.take(meter(frame), stated);
  if (controller_.settled()) found_ = true;
  return wanted ? set(*wanted) : Result<void>();
}

ExposureState AutoExposure::state() const {
  const isp::ExposureSetting& setting = controller_.setting();
  ExposureState out{.exposure_s = setting.exposure_s,
                    .gain = std::nullopt,
                    .snr_db = isp::decibel(controller_.choice().snr),
                    .limit = controller_.choice().limit,
                    .clips = controller_.choice().clips,
                    .changes = controller_.changes()};
  if (!gains_.empty()) out.gain = gains_[setting.gain].factor;
  return out;
}

}  // namespace lowlux::cli
