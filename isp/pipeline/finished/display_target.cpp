#include "isp/pipeline/finished/display_target.h"

namespace lowlux::isp {

MeasuredTable retarget_table(const RetargetMap& map, Executor& executor) {
  return tabulated_to([&map](const Vector3& code) { return map(code).code; }, retarget_table_tolerance, executor);
}

Result<DisplayTarget> display_target(const RetargetOptions& options, Executor& executor) {
  const auto map = retargeting(options);
  if (!map) return tl::make_unexpected(map.error());
  return DisplayTarget{options.source_cd_m2, options.display_cd_m2, coefficients_name(options),
                       retarget_table(*map, executor)};
}

}  // namespace lowlux::isp
