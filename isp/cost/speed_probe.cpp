#include "isp/cost/speed_probe.h"

#include "isp/cost/timing_frame.h"
#include "isp/metrics/statistics.h"
#include "isp/pipeline/develop.h"

namespace lowlux::isp {

SpeedProbe::SpeedProbe() : frame_(timing_frame({1024, 768}, {20, 20})) {
  options_.denoise.mode = DenoiseChoice::Mode::level;
  options_.denoise.level = denoise::Level::standard;
  options_.effects.emplace();
}

Result<double> SpeedProbe::seconds(Executor& executor) {
  const Result<Developed> developed = develop(frame_, options_, executor);
  if (!developed) return tl::make_unexpected(developed.error());
  double sum = 0;
  for (const StageTime& time : developed->plan.times) sum += time.seconds;
  taken_s_.push_back(sum);
  return sum;
}

double SpeedProbe::median_s() const { return median(taken_s_); }

Result<double> pace_now(SpeedProbe& pace, Executor& executor) {
  std::vector<double> taken_s;
  for (int run = 0; run < 8; ++run) {
    Result<double> seconds = pace.seconds(executor);
    if (!seconds) return seconds;
    if (run > 0) taken_s.push_back(*seconds);
  }
  return median(taken_s);
}

}  // namespace lowlux::isp
