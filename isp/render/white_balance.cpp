#include "isp/render/white_balance.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <span>
#include <utility>
#include <vector>

#include "isp/base/text.h"
#include "isp/model/colour/correlated_colour_temperature.h"
#include "isp/render/block_statistics.h"

namespace lowlux::isp {
namespace {

std::string rounded(double value) { return std::to_string(std::lround(value)); }

Vector3 scaled_to_one(const Vector3& v) {
  const double largest = *std::max_element(v.begin(), v.end());
  return {v[0] / largest, v[1] / largest, v[2] / largest};
}

WhiteBalance balance_of(const CameraColour& colour, const Vector3& neutral, WhiteSource source) {
  WhiteBalance out{scaled_to_one(neutral), std::nullopt, source, {}};
  if (colour.calibrations.empty()) return out;  // white_of_neutral would fail and allocate an error message
  if (const auto white = white_of_neutral(colour, neutral)) out.white = *white;
  return out;
}

Result<WhiteBalance> balance_of_white(const CameraColour& colour, const Xy& xy, WhiteSource source) {
  const auto neutral = neutral_of_white(colour, xy);
  if (!neutral) return tl::make_unexpected(neutral.error());
  const auto temperature = colour_temperature_of(xy);
  WhiteBalance out{*neutral, std::nullopt, source, {}};
  if (temperature) out.white = WhitePoint{xy, temperature->cct_k, temperature->duv};
  return out;
}

struct GreyEstimate {
  Vector3 neutral{};
  int blocks = 0;
};

/// Computes shades of grey over the blocks that qualify. The values are at most 1: sums of their powers stay finite.
GreyEstimate shades_of_grey(const RgbView<const float>& blocks, double block_noise, const AutoWhiteOptions& options,
                            std::span<float> memory) {
  std::array<double, 3> floor{};
  for (int c = 0; c < 3; ++c) {
    auto end = memory.begin();
    for (int y = 0; y < blocks[c].height; ++y) end = std::copy_n(blocks[c].row(y), blocks[c].width, end);
    floor[c] = std::fmax(options.signal_to_scatter * black_scatter_reordering({memory.begin(), end}),
                         options.signal_to_noise * block_noise);
  }
  GreyEstimate estimate;
  for (int y = 0; y < blocks[0].height; ++y) {
    for (int x = 0; x < blocks[0].width; ++x) {
      const Vector3 rgb{blocks[0].at(x, y), blocks[1].at(x, y), blocks[2].at(x, y)};
      bool qualifies = true;
      for (int c = 0; c < 3; ++c) qualifies = qualifies && rgb[c] > floor[c] && rgb[c] <= options.clipped;
      if (!qualifies) continue;
      for (int c = 0; c < 3; ++c) estimate.neutral[c] += std::pow(rgb[c], options.norm);
      ++estimate.blocks;
    }
  }
  for (double& channel : estimate.neutral) channel = std::pow(channel / std::max(1, estimate.blocks), 1 / options.norm);
  return estimate;
}

/// Returns the nearest white that a light can have, by `options`; nullopt if `white` is one already.
std::optional<Xy> held_to_lights(const WhitePoint& white, const AutoWhiteOptions& options) {
  const double kelvin = std::clamp(white.cct_k, options.min_k, options.max_k);
  const auto usual = white_of_temperature(kelvin);
  const auto usual_temperature = usual ? colour_temperature_of(*usual) : std::nullopt;
  if (!usual_temperature) return std::nullopt;
  const double usual_duv = usual_temperature->duv;
  const double duv = std::clamp(white.duv, usual_duv - options.max_duv, usual_duv + options.max_duv);
  if (kelvin == white.cct_k && duv == white.duv) return std::nullopt;
  return planckian_xy(kelvin, duv);
}

WhiteBalance fallback(const CameraColour& colour, const std::string& reason) {
  if (auto as_shot = as_shot_white_balance(colour)) {
    as_shot->reason = reason + "; as shot instead";
    return *std::move(as_shot);
  }
  if (auto daylight = balance_of_white(colour, white_d65, WhiteSource::daylight)) {
    daylight->reason = reason + "; daylight (D65) instead";
    return *std::move(daylight);
  }
  return {{1, 1, 1}, std::nullopt, WhiteSource::none, reason + "; no colour matrix either: channels are not changed"};
}

}  // namespace

std::string_view name_of(WhiteSource source) {
  switch (source) {
    case WhiteSource::as_shot:
      return "as-shot";
    case WhiteSource::estimated:
      return "auto";
    case WhiteSource::temperature:
      return "temperature";
    case WhiteSource::daylight:
      return "daylight";
    case WhiteSource::preset:
      return "preset";
    case WhiteSource::gains:
      return "gains";
    case WhiteSource::picked:
      return "picked";
    case WhiteSource::none:
      break;
  }
  return "none";
}

std::string_view name_of(WhitePreset preset) {
  switch (preset) {
    case WhitePreset::daylight:
      return "daylight";
    case WhitePreset::cloudy:
      return "cloudy";
    case WhitePreset::shade:
      return "shade";
    case WhitePreset::tungsten:
      return "tungsten";
    case WhitePreset::fluorescent:
      return "fluorescent";
    case WhitePreset::flash:
      break;
  }
  return "flash";
}

Xy white_of(WhitePreset preset) {
  switch (preset) {
    case WhitePreset::cloudy:
      return {0.31272, 0.32903};  // D65
    case WhitePreset::shade:
      return {0.29902, 0.31485};  // D75
    case WhitePreset::tungsten:
      return {0.44758, 0.40745};  // A
    case WhitePreset::fluorescent:
      return {0.3721, 0.3751};  // FL2
    case WhitePreset::daylight:
    case WhitePreset::flash:
      break;
  }
  return {0.33243, 0.34744};  // D55
}

Result<WhiteBalance> as_shot_white_balance(const CameraColour& colour) {
  if (colour.as_shot_neutral) {
    const Vector3& neutral = *colour.as_shot_neutral;
    for (const double channel : neutral) {
      if (!std::isfinite(channel) || channel <= 0) {
        return fail(ErrorCode::malformed,
                    "the file's neutral contains a value that is not positive: use --wb auto or --wb 5500",
                    "AsShotNeutral");
      }
    }
    return balance_of(colour, neutral, WhiteSource::as_shot);
  }
  if (colour.as_shot_white_xy) {
    return balance_of_white(colour, {(*colour.as_shot_white_xy)[0], (*colour.as_shot_white_xy)[1]},
                            WhiteSource::as_shot);
  }
  return fail(ErrorCode::insufficient, "the file states no white balance: use --wb auto or --wb 5500", "AsShotNeutral");
}

Result<WhiteBalance> white_balance_of_temperature(const CameraColour& colour, double kelvin, double tint) {
  auto xy = white_of_temperature(kelvin);
  if (!xy) {
    return fail(ErrorCode::invalid_argument,
                "a colour temperature must be in " + rounded(white_min_k) + ".." + rounded(white_max_k) + " K, found " +
                    number_text(kelvin),
                "white balance");
  }
  if (tint != 0) {
    const auto untinted = colour_temperature_of(*xy);
    xy = untinted ? planckian_xy(untinted->cct_k, untinted->duv + tint / tint_per_duv) : std::nullopt;
    if (!(std::fabs(tint) <= max_tint) || !xy) {
      return fail(ErrorCode::invalid_argument,
                  "no light has a tint of " + number_text(tint) + " at " + number_text(kelvin) + " K", "white balance");
    }
  }
  return balance_of_white(colour, *xy, WhiteSource::temperature);
}

Result<WhiteBalance> white_balance_of_preset(const CameraColour& colour, WhitePreset preset) {
  return balance_of_white(colour, white_of(preset), WhiteSource::preset);
}

WhiteBalance white_balance_of_neutral(const CameraColour& colour, const Vector3& neutral, WhiteSource source) {
  return balance_of(colour, neutral, source);
}

WhiteEstimate estimate_white(const RgbView<const float>& blocks, double block_noise, const CameraColour& colour,
                             const AutoWhiteOptions& options, std::span<float> memory) {
  const GreyEstimate estimate = shades_of_grey(blocks, block_noise, options, memory);
  WhiteEstimate out{.blocks = estimate.blocks};
  if (estimate.blocks < options.min_blocks) return out;
  out.balance = balance_of(colour, estimate.neutral, WhiteSource::estimated);
  if (!out.balance.white) {
    out.remark = "automatic white balance is not limited to plausible lights: the colour matrix is missing or unusable";
    return out;
  }
  const auto held = held_to_lights(*out.balance.white, options);
  if (!held) return out;
  if (auto limited = balance_of_white(colour, *held, WhiteSource::estimated)) {
    out.balance = *std::move(limited);
    out.remark = "automatic white balance was limited to a plausible light";
  } else {
    out.remark =
        "automatic white balance is not limited to plausible lights: the colour matrices do not reach the nearest one";
  }
  return out;
}

WhiteBalance auto_white_balance(const RgbView<const float>& blocks, double block_noise, const CameraColour& colour,
                                const AutoWhiteOptions& options) {
  std::vector<float> memory(static_cast<std::size_t>(blocks[0].width) * blocks[0].height);
  WhiteEstimate found = estimate_white(blocks, block_noise, colour, options, memory);
  if (found.blocks < options.min_blocks) {
    return fallback(colour, "only " + std::to_string(found.blocks) +
                                " of the image's blocks are neither black nor clipped, too few to estimate the white");
  }
  found.balance.reason = found.remark;
  return std::move(found.balance);
}

}  // namespace lowlux::isp
