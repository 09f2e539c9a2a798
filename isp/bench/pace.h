#pragma once

#include <vector>

#include "isp/base/executor.h"
#include "isp/base/frame.h"
#include "isp/base/result.h"
#include "isp/pipeline/options.h"

namespace lowlux::isp {

/// How fast the machine is at the moment: others use it too, and it slows down when it is hot. A fixed piece of work,
/// a frame of 0.8 MP developed with denoise::Level::standard, is the unit of times that are to be compared.
class Pace {
 public:
  Pace();

  /// Of one run. Errors: those of develop().
  Result<double> seconds(Executor& executor);
  /// The median of all runs so far.
  double usual_s() const;

 private:
  RawFrame frame_;
  DevelopOptions options_;
  std::vector<double> taken_s_;
};

/// Median of seven runs, after one that does not count.
Result<double> pace_now(Pace& pace, Executor& executor);

}  // namespace lowlux::isp
