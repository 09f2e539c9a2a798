#include "calib/dark_library.h"

#include <cmath>
#include <utility>

#include <fmt/format.h>

namespace lowlux::calib {
namespace {

bool belongs_to(const FrameSetting& stack, const FrameSetting& frame) {
  if (stack.exposure_s != frame.exposure_s) return false;
  if (stack.temperature_c.has_value() != frame.temperature_c.has_value()) return false;
  return !stack.temperature_c || std::fabs(*stack.temperature_c - *frame.temperature_c) <= same_temperature_c;
}

}  // namespace

Result<void> DarkLibrary::add(const RawDn& raw) {
  const auto setting = setting_of(raw);
  if (!setting) return tl::make_unexpected(setting.error());
  if (!stacks_.empty()) {
    if (auto same = check_same_camera(stacks_.front().setting(), *setting, "the dark frame"); !same) return same;
  }
  for (DarkStack& stack : stacks_) {
    if (belongs_to(stack.setting(), *setting)) return stack.add(raw);
  }
  if (stacks_.size() == most_settings_) {
    return fail(ErrorCode::too_large,
                fmt::format("the dark frames have more than {} exposure times and temperatures, which would take too "
                            "much memory; give fewer",
                            most_settings_));
  }
  DarkStack stack;
  if (auto added = stack.add(raw); !added) return added;
  stacks_.push_back(std::move(stack));
  return {};
}

std::vector<DarkGroup> DarkLibrary::groups() const {
  std::vector<DarkGroup> out;
  out.reserve(stacks_.size());
  for (const DarkStack& stack : stacks_) out.push_back(stack.average());
  return out;
}

}  // namespace lowlux::calib
