#include "isp/pipeline/display_target.h"

namespace lowlux::isp {

Result<DisplayTarget> display_target(const RetargetOptions& options, Executor& executor) {
  const auto map = retargeting(options);
  if (!map) return tl::make_unexpected(map.error());
  const CodeMap codes = [&map](const Vector3& code) { return (*map)(code).code; };
  return DisplayTarget{options.source_cd_m2, options.display_cd_m2, coefficients_name(options),
                       tabulated_to(codes, retarget_table_tolerance, executor)};
}

}  // namespace lowlux::isp
