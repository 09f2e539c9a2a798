#include "calib/dark_sorter.h"

#include <algorithm>
#include <cmath>
#include <tuple>
#include <utility>

#include <fmt/format.h>

namespace lowlux::calib {
namespace {

constexpr std::size_t most_settings = 64;
constexpr double same_temperature_c = 1;

bool belongs(const FrameSetting& a, const FrameSetting& b) {
  if (a.iso != b.iso || a.exposure_s != b.exposure_s) return false;
  if (a.temperature_c.has_value() != b.temperature_c.has_value()) return false;
  return !a.temperature_c || std::fabs(*a.temperature_c - *b.temperature_c) <= same_temperature_c;
}

auto order_of(const FrameSetting& s) {
  return std::tuple(s.iso.value_or(0), s.temperature_c.value_or(0), s.exposure_s.value_or(0));
}

}  // namespace

Result<void> DarkSorter::add(const RawDn& frame) {
  auto setting = setting_of(frame);
  if (!setting) return tl::make_unexpected(setting.error());
  const auto found =
      std::find_if(entries_.begin(), entries_.end(), [&](const Entry& e) { return belongs(e.setting, *setting); });
  if (found != entries_.end()) return found->stack.add(frame);
  if (!entries_.empty()) {
    FrameSetting first = entries_.front().setting;
    first.iso = setting->iso;
    if (auto same = check_same_camera(first, *setting, "this frame"); !same) return same;
  }
  if (entries_.size() == most_settings) {
    return fail(ErrorCode::too_large, fmt::format("the darks have more than {} settings of gain, exposure time and "
                                                  "temperature; calibrate them in parts with --add-to",
                                                  most_settings));
  }
  Entry added{std::move(*setting), {}, measure_black(frame)};
  if (added.setting.exposure_s) {
    if (auto stacked = added.stack.add(frame); !stacked) return stacked;
  }
  entries_.push_back(std::move(added));
  return {};
}

Result<std::vector<DarkSet>> DarkSorter::sets() const {
  std::vector<const Entry*> sorted;
  sorted.reserve(entries_.size());
  for (const Entry& e : entries_) sorted.push_back(&e);
  std::sort(sorted.begin(), sorted.end(),
            [](const Entry* a, const Entry* b) { return order_of(a->setting) < order_of(b->setting); });
  std::vector<DarkSet> out;
  for (const Entry* entry : sorted) {
    const bool is_new = out.empty() || out.back().iso != entry->setting.iso;
    if (is_new) out.push_back({.iso = entry->setting.iso});
    DarkSet& set = out.back();
    if (entry->stack.frames() >= 2) {
      set.groups.push_back(*entry->stack.group());
    } else if (!entry->first) {
      return tl::make_unexpected(entry->first.error());
    } else {
      set.single = *entry->first;
      set.single_setting = entry->setting;
    }
    if (set.single && (set.groups.size() > 0 || !is_new)) {
      return fail(ErrorCode::insufficient,
                  fmt::format("there is one dark frame at {:g} s; noise needs two of each exposure time",
                              set.single_setting->exposure_s.value_or(0)));
    }
  }
  return out;
}

}  // namespace lowlux::calib
