#include "isp/pipeline/merge/frame_loader.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>
#include <utility>

#include <fmt/format.h>

#include "isp/base/camera_profile.h"
#include "isp/pipeline/plan/dark_charge.h"
#include "isp/pipeline/plan/noise_facts.h"
#include "isp/pipeline/plan/plan_develop.h"

namespace lowlux::isp {
namespace {

constexpr double max_noise_ratio = 1.2;  // of the variance of frames of one ISO
constexpr double max_dark_ratio = 2;     // of the variance without light, of frames whose range differs
constexpr double max_saturated = 0.5;    // share of the sites of a reference
constexpr int counted_rows = 8;          // of so many, two are counted

bool differ(const std::optional<double>& a, const std::optional<double>& b) {
  if (!a || !b) return a.has_value() != b.has_value();
  return std::fabs(*a - *b) > 1e-3 * std::max(std::fabs(*a), std::fabs(*b));
}

std::string camera_of(const FrameInfo& info) {
  const std::string name = camera_name(info.make, info.model);
  return name.empty() ? "an unnamed camera" : name;
}
CameraName name_of(const FrameInfo& info) { return {info.make, info.model}; }

/// Returns why a frame cannot be merged with the reference; nullopt if it can.
std::optional<std::string> difference_to(const RawDn& reference, const RawDn& frame) {
  if (!is_same_camera(name_of(reference.info), name_of(frame.info))) {
    return fmt::format("it was taken with {}, the reference with {}", camera_of(frame.info), camera_of(reference.info));
  }
  if (reference.layout != frame.layout || reference.phase != frame.phase) {
    return "its mosaic is not that of the reference";
  }
  const Rect &a = reference.active, &b = frame.active;
  if (a.width != b.width || a.height != b.height) {
    return fmt::format("it has {} x {} pixels, the reference {} x {}", b.width, b.height, a.width, a.height);
  }
  if (a.x != b.x || a.y != b.y) {
    return fmt::format("its active area begins at {}, {}, that of the reference at {}, {}", b.x, b.y, a.x, a.y);
  }
  return std::nullopt;
}

/// Returns the noise of the reference in the units of a frame of the same gain [DN/e-], whose black or white level may
/// differ: a raw value of 1 stands for another charge then.
Result<std::optional<NoiseProfile>> noise_at_levels(const FrameToMerge& reference, const FrameToMerge& to) {
  std::optional<NoiseProfile> out = reference.frame.noise;
  if (!out) return out;
  const Result<BlackPoint> reference_black = choose_black_point(reference.frame, reference.options);
  if (!reference_black) return tl::make_unexpected(reference_black.error());
  const Result<BlackPoint> black = choose_black_point(to.frame, to.options);
  if (!black) return tl::make_unexpected(black.error());
  const double ratio = mean_range_dn(reference.frame.raw, *reference_black) / mean_range_dn(to.frame.raw, *black);
  for (double& scale : out->scale) scale *= ratio;
  for (double& offset : out->offset) offset *= ratio * ratio;
  return out;
}

/// Returns the level of saturation that a frame shows.
std::optional<SaturationLevel> saturation_of(const FrameToMerge& to) {
  const Result<BlackPoint> black = choose_black_point(to.frame, to.options);
  return black ? choose_saturation(to.frame, *black, to.options) : std::nullopt;
}

/// Returns the share of saturated sites, of some rows.
double saturated_fraction(const RawDn& raw, const std::optional<SaturationLevel>& level) {
  PerSite<double> limit_dn{};
  for (int site = 0; site < 4; ++site) limit_dn[site] = saturated_fraction_of_white * white_at(raw, site);
  if (level) limit_dn.fill(level->from_dn());
  double saturated = 0, sites = 0;
  with_samples(raw, [&](const auto& samples) {
    const Rect& active = raw.active;
    for (int y = 0; y < active.height; ++y) {
      if (y % counted_rows > 1) continue;
      const auto* const row = samples.row(active.y + y) + active.x;
      for (int x = 0; x < active.width; ++x) {
        saturated += static_cast<double>(row[x]) >= limit_dn[site_of(x, y)] ? 1 : 0;
      }
      sites += active.width;
    }
  });
  return sites > 0 ? saturated / sites : 0;
}

std::string iso_text(const std::optional<double>& iso) { return iso ? fmt::format("{:g}", *iso) : "not stated"; }

bool is_within(double ratio, double max_ratio) { return ratio > 1 / max_ratio && ratio < max_ratio; }

/// Returns whether both frames state their noise, and differently: one of them was processed. A mean of N frames with
/// about N times their range, such as that of 4 frames of 14 bits in 16 bits, has their noise per light, but not
/// without light.
/// @param of_reference  noise of the reference; `expected` is the same in the units of the frame
bool noise_differs(const std::optional<NoiseProfile>& of_reference, const std::optional<NoiseProfile>& expected,
                   const std::optional<NoiseProfile>& noise) {
  const auto is_stated = [](const auto& n) { return n && n->source != NoiseProfile::Source::picture; };
  if (!is_stated(expected) || !is_stated(noise)) return false;
  if (!is_within(noise->scale[1] / expected->scale[1], max_noise_ratio)) return true;
  const bool has_same_range = is_within(expected->scale[1] / of_reference->scale[1], max_noise_ratio);
  return !has_same_range && expected->offset[1] > 0 &&
         !is_within(noise->offset[1] / expected->offset[1], max_dark_ratio);
}

}  // namespace

Error at_frame(Error error, const std::string& name) {
  if (error.where.empty()) error.where = name;
  return error;
}

FrameLoader::~FrameLoader() {
  if (next_.valid()) next_.wait();
}

Result<FrameElectrons> FrameLoader::read_reference(int index) {
  Result<FrameToMerge> frame = read_(index, true);
  if (!frame) return tl::make_unexpected(frame.error());
  clock_.lap(waiting_stage);
  with_gain_ = true;
  DevelopOptions options = frame->options;
  if (!surveyed_.empty()) {
    const FrameSaturation& own = surveyed_[static_cast<std::size_t>(index)];
    options.find_saturation = false;
    options.series_saturation = own.level ? own.level : lowest_saturation(own.iso);
  }
  Result<FrameElectrons> electrons = frame_electrons(frame->frame, options, executor_, with_gain_);
  if (!electrons) return tl::make_unexpected(at_frame(electrons.error(), frame->name));
  clock_.lap("black and noise");
  reference_ = *std::move(frame);
  saturation_.reset();
  if (electrons->saturation) saturation_ = {*electrons->saturation, electrons->saturation_e};
  dark_.reset();
  if (electrons->dark_is_estimated) dark_ = SeriesDark{electrons->dark_charge_e, reference_.frame.raw.info, true};
  return electrons;
}

void FrameLoader::expect(std::vector<int> order) {
  if (next_.valid()) next_.wait();
  if (dark_ && !dark_->is_of_reference) dark_.reset();
  order_ = std::move(order);
  position_ = 0;
  begin();
}

void FrameLoader::begin() {
  if (position_ == order_.size()) return;
  next_ = std::async(std::launch::async, [this, index = order_[position_]] { return read_(index, false); });
}

Result<FrameElectrons> FrameLoader::next() {
  Result<FrameToMerge> read = next_.get();
  ++position_;
  begin();
  if (!read) return tl::make_unexpected(read.error());
  clock_.lap(waiting_stage);
  RawFrame& frame = read->frame;
  last_ = frame.raw.info;
  last_name_ = read->name;
  const FrameInfo& info = reference_.frame.raw.info;
  if (auto difference = difference_to(reference_.frame.raw, frame.raw)) {
    return tl::make_unexpected(at_frame({ErrorCode::invalid_argument, *std::move(difference), {}}, last_name_));
  }
  const bool same_gain = !differ(info.iso, last_.iso);
  if (!same_gain || differ(info.exposure_s, last_.exposure_s) || differ(info.f_number, last_.f_number)) {
    exposures_differ_ = true;
  }
  if (same_gain) {
    Result<std::optional<NoiseProfile>> expected = noise_at_levels(reference_, *read);
    if (!expected) return tl::make_unexpected(at_frame(expected.error(), last_name_));
    if (noise_differs(reference_.frame.noise, *expected, frame.noise)) {
      return tl::make_unexpected(
          at_frame({ErrorCode::invalid_argument,
                    "its noise is not that of the reference at the same ISO: only unprocessed raw files can be merged",
                    {}},
                   last_name_));
    }
    frame.noise = *std::move(expected);  // a profile that is measured in an image has an error of its own
  } else if (!frame.noise) {
    return tl::make_unexpected(at_frame(
        {ErrorCode::insufficient,
         fmt::format("its ISO ({}) is not that of the reference ({}), and the file does not state its noise: give a "
                     "profile of the camera (--profile, see calibrate noise), or merge frames of one ISO",
                     iso_text(last_.iso), iso_text(info.iso)),
         {}},
        last_name_));
  }
  Result<FrameElectrons> electrons = electrons_of(*read);
  if (!electrons) return tl::make_unexpected(at_frame(electrons.error(), last_name_));
  clock_.lap("black and noise");
  return electrons;
}

Result<int> FrameLoader::brightest(int count) {
  if (next_.valid()) next_.wait();  // frames are read one at a time
  surveyed_.clear();
  int found = 0;
  double max_light = -1;
  std::vector<FrameSaturation> surveyed;
  for (int index = 0; index < count; ++index) {
    Result<FrameToMerge> read = read_(index, false);
    if (!read) return tl::make_unexpected(read.error());
    clock_.lap(waiting_stage);
    const RawDn& raw = read->frame.raw;
    if (!raw.info.exposure_s) return 0;
    surveyed.push_back({raw.info.iso, saturation_of(*read)});
    const double light = *raw.info.exposure_s / std::pow(raw.info.f_number.value_or(1), 2);
    const bool is_brighter = light > max_light && saturated_fraction(raw, surveyed.back().level) <= max_saturated;
    clock_.lap("black and noise");
    if (!is_brighter) continue;
    found = index;
    max_light = light;
  }
  surveyed_ = std::move(surveyed);
  return found;
}

std::optional<SaturationLevel> FrameLoader::lowest_saturation(const std::optional<double>& iso) const {
  std::optional<SaturationLevel> out;
  for (const FrameSaturation& shown : surveyed_) {
    if (!shown.level || differ(shown.iso, iso)) continue;
    if (!out || shown.level->from_dn() < out->from_dn()) out = shown.level;
  }
  return out;
}

Result<FrameElectrons> FrameLoader::electrons_of(const FrameToMerge& read) {
  DevelopOptions options = read.options;
  const bool is_like_reference = !differ(reference_.frame.raw.info.exposure_s, last_.exposure_s);
  if (options.estimate_dark && is_like_reference && !(dark_ && dark_->is_of_reference)) options.estimate_dark = false;
  if (options.estimate_dark && dark_ && last_.exposure_s) {
    const double ratio = dark_charge_ratio(last_, dark_->info);
    PerSite<double>& charge_e = options.series_dark_e.emplace(dark_->charge_e);
    for (double& charge : charge_e) charge *= ratio;
  }
  const bool has_gain_of_reference = !differ(reference_.frame.raw.info.iso, last_.iso);
  if (has_gain_of_reference && saturation_) options.series_saturation = saturation_->level;
  if (!surveyed_.empty()) {
    options.find_saturation = false;
    if (!has_gain_of_reference) options.series_saturation = lowest_saturation(last_.iso);
  }
  Result<FrameElectrons> out = frame_electrons(read.frame, options, executor_, with_gain_);
  if (out && out->dark_is_estimated && !dark_) dark_ = SeriesDark{out->dark_charge_e, last_, false};
  if (out && out->saturation && has_gain_of_reference && !saturation_) {
    saturation_ = {*out->saturation, out->saturation_e};
  }
  return out;
}

Result<double> FrameLoader::stated_light() const {
  const FrameInfo& info = reference_.frame.raw.info;
  const auto states_time = [](const FrameInfo& of) { return of.exposure_s && *of.exposure_s > 0; };
  if (!states_time(info) || !states_time(last_)) {
    return tl::make_unexpected(
        at_frame({ErrorCode::insufficient, "frames of different exposure must state their exposure times", {}},
                 states_time(last_) ? reference_.name : last_name_));
  }
  double light = *last_.exposure_s / *info.exposure_s;
  if (info.f_number && last_.f_number) light *= std::pow(*info.f_number / *last_.f_number, 2);
  return light;
}

}  // namespace lowlux::isp
