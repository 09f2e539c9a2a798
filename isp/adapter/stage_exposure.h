#pragma once

#include <optional>
#include <vector>

#include "isp/adapter/lowlux_stage.h"
#include "isp/base/cfa.h"
#include "isp/base/frame.h"
#include "isp/base/packed/raw_format.h"
#include "isp/model/sensor/exposure_controller.h"
#include "isp/raw/measure/exposure_meter.h"

namespace lowlux::isp {

/// Advises on exposure time and gain of the coming frames of a stream, by ExposureController.
class StageExposure {
 public:
  /// @param gains  those of factors()
  StageExposure(const RawFormat& format, std::vector<GainStep> gains);

  /// Returns the analogue gains of which the advice is one: sixteenths of 1 EV from 1 to 1e4.
  static std::vector<double> factors();

  /// Measures a frame, and fills in the advice if exposure time, gain and limits are valid in `params`. Allocates
  /// nothing.
  /// @param black  of the sites of the active area, dark charge included; of bounds the lowest since reset() counts
  /// @return whether there is advice
  bool advise(const RawDn& raw, MeteredBlack black, const lowlux_stage_params& params, lowlux_stage_result& out);

  /// Forgets the light and the bounds of black.
  void reset();

 private:
  ExposureMeter meter_;
  ExposureController controller_;
  std::optional<PerSite<double>> lowest_dn_;  // lowest upper bound of the pedestal
  bool is_running_ = false;
};

/// Returns the fault in the limits of an exposure; null if there is none.
const char* fault_of_limits(const lowlux_stage_params& params);

}  // namespace lowlux::isp
