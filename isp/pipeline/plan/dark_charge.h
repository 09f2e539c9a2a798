#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "isp/base/frame.h"
#include "isp/pipeline/options.h"
#include "isp/pipeline/plan/levels.h"
#include "isp/pipeline/plan/rendering.h"
#include "isp/raw/measure/thumbnail.h"

namespace lowlux::isp {

/// States what is known of the dark charge of a frame, and what was done about it.
struct DarkCharge {
  enum class State : std::uint8_t {
    not_examined,    // gain or exposure time is not known, noise was reduced before, or the frame is not a mosaic
    not_expected,    // too small to matter at this exposure time and temperature, or in the light of this frame
    in_black_point,  // measured or computed: the black point that is subtracted holds it
    estimated,       // the frame itself shows it significantly: it is subtracted unless a planner leaves it in
    unknown          // it may matter, and stays in
  } state = State::not_examined;
  std::optional<double> mean_e;            // mean over pixels, where it is known or estimated
  PerSite<double> charge_e{};              // charge of each site, where mean_e is set
  std::optional<double> standard_error_e;  // error of mean_e, without that of the gain; absent for published figures
  PerSite<double> estimated_e{};           // State::estimated: charge of each site
  std::optional<double> alpha;             // result of signal_fraction_at_median
  /// State::unknown: the largest fraction of the charge of the median block that may be dark charge, that of the
  /// darkest blocks, which hold no more.
  std::optional<double> max_fraction;
  std::string reason;  // reason of the state, as text
};

/// Finds the dark charge of a frame. Where the black point holds only a pedestal, the gain is known and the exposure
/// was long, it is estimated from the frame itself (estimate_dark_charge), if `options.estimate_dark`;
/// `options.series_dark_e` replaces the estimate, whatever the exposure. A significant estimate must also be within
/// 1000 e-/s at 25 C, doubling every 7 C: three times the highest dark current of the sensors in
/// isp/model/data/sensors.csv.
/// @param thumbnail  dark charge included
DarkCharge find_dark_charge(const RawFrame& frame, const RawLevels& levels, const Thumbnail& thumbnail,
                            const DevelopOptions& options);

/// Returns the ratio of the dark charge of one frame to that of another of the same sensor, by exposure times and,
/// where both are stated, temperatures (doubling every 7 C). Precondition: both state their exposure times.
double dark_charge_ratio(const FrameInfo& of, const FrameInfo& to);

/// Returns the warning of State::unknown; empty in other states.
std::string warning_of(const DarkCharge& dark, const FrameInfo& info);

/// Returns the thumbnail without the dark charge that is known and still in the codes, which is not light, in fractions
/// of light_at_white_e; its light_range is light_range_of().
Thumbnail light_of(const Thumbnail& thumbnail, const RawFrame& frame, const RawLevels& levels);

/// Returns Thumbnail::light_range: a pixel is saturated by light and dark charge together, so that white is less light
/// than the exposure alone states (saturation_luminance_cd_m2). It is 1 where the pedestal is not tagged, and for raws
/// that were written without their dark charge, which do not state how large it was.
double light_range_of(const RawFrame& frame, const RawLevels& levels);

/// Returns alpha of thesis Eq. 4.24 for the median of the light of the blocks: the fraction of X + Y + Z that is light,
/// were the dark charge not subtracted; 1 - alpha of the saturation would then be lost. Without colour matrices it is
/// the fraction of the sum of camera RGB. nullopt without a gain, or where the light is not positive.
/// @param charge_e  dark charge of each site: channels of unequal dark current have their own
std::optional<double> signal_fraction_at_median(const RawFrame& frame, const RawLevels& levels,
                                                const Rendering& rendering, const Thumbnail& light,
                                                const PerSite<double>& charge_e);

}  // namespace lowlux::isp
