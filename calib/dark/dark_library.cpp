#include "calib/dark/dark_library.h"

#include <algorithm>
#include <cmath>
#include <tuple>
#include <utility>

#include <fmt/format.h>

namespace lowlux::calib {
namespace {

bool belongs_to(const FrameSetting& stack, const FrameSetting& frame) {
  return stack.exposure_s == frame.exposure_s && same_temperature(stack.temperature_c, frame.temperature_c);
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
  if (stacks_.size() == max_settings_) {
    return fail(ErrorCode::too_large,
                fmt::format("the dark frames have more than {} exposure times and temperatures, which would take too "
                            "much memory; give fewer",
                            max_settings_));
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

namespace {

constexpr std::size_t max_gains = 16, max_settings = 32;

auto order_of(const DarkGroup& g) {
  return std::tuple(g.setting.temperature_c.value_or(0), g.setting.exposure_s.value_or(0));
}

}  // namespace

Result<void> DarkSorter::add(const RawDn& frame) {
  auto setting = setting_of(frame);
  if (!setting) return tl::make_unexpected(setting.error());
  if (!gains_.empty()) {
    FrameSetting first = gains_.front().first;
    first.iso = setting->iso;
    if (auto same = check_same_camera(first, *setting, "this frame"); !same) return same;
  }
  const auto found =
      std::find_if(gains_.begin(), gains_.end(), [&](const Gain& g) { return g.first.iso == setting->iso; });
  if (found != gains_.end()) return found->darks.add(frame);
  if (gains_.size() == max_gains) {
    return fail(
        ErrorCode::too_large,
        fmt::format("the darks have more than {} gain settings; calibrate them in parts with --add-to", max_gains));
  }
  Gain added{std::move(*setting), DarkLibrary(max_settings)};
  if (auto stacked = added.darks.add(frame); !stacked) return stacked;
  gains_.push_back(std::move(added));
  return {};
}

std::vector<DarkSet> DarkSorter::sets() const {
  std::vector<DarkSet> out;
  out.reserve(gains_.size());
  for (const Gain& gain : gains_) {
    DarkSet& set = out.emplace_back(DarkSet{gain.first.iso, gain.darks.groups()});
    std::sort(set.groups.begin(), set.groups.end(),
              [](const DarkGroup& a, const DarkGroup& b) { return order_of(a) < order_of(b); });
  }
  std::sort(out.begin(), out.end(), [](const DarkSet& a, const DarkSet& b) { return a.iso < b.iso; });
  return out;
}

}  // namespace lowlux::calib
