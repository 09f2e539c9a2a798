#include "isp/pipeline/develop.h"

#include <utility>

#include "isp/pipeline/plan/plan_develop.h"
#include "isp/pipeline/render/pipeline.h"
#include "isp/pipeline/stage_clock.h"

namespace lowlux::isp {

Result<Developed> develop(const RawFrame& frame, const DevelopOptions& options, Executor& executor) {
  RawElectrons charge;
  Result<DevelopPlan> plan = plan_develop(frame, options, executor, &charge);
  if (!plan) return tl::make_unexpected(std::move(plan.error()));
  Developed out{Picture{}, std::move(*plan), {}, {}};
  StageClock clock(out.plan.times);
  out.picture = make_picture(out.plan);
  Pipeline pipeline(executor);
  pipeline.render(frame, out.plan, out.picture, std::move(charge));
  if (options.denoise.maps) out.noise_maps = pipeline.take_noise_maps();
  if (auto map = pipeline.take_seeing_map()) {
    out.seeing_map = std::move(map->probability);
    out.plan.rendering.look->retina->seen_fraction = map->seen_fraction;
  }
  clock.lap("render");
  return out;
}

}  // namespace lowlux::isp
