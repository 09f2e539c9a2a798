#pragma once

#include <vector>

#include "isp/base/executor.h"
#include "isp/base/frame.h"
#include "isp/base/result.h"
#include "isp/pipeline/options.h"

namespace lowlux::isp {

/// Measures the current speed of the machine, which varies with other load and with temperature. A fixed workload,
/// developing a frame of 0.8 MP with denoise::Level::standard, is the unit of times that are to be compared.
class SpeedProbe {
 public:
  SpeedProbe();

  /// Returns the time of one run. Errors: those of develop().
  Result<double> seconds(Executor& executor);
  /// Returns the median of all runs so far.
  double median_s() const;

 private:
  RawFrame frame_;
  DevelopOptions options_;
  std::vector<double> taken_s_;
};

/// Returns the median of seven runs, after one that does not count.
Result<double> pace_now(SpeedProbe& pace, Executor& executor);

}  // namespace lowlux::isp
