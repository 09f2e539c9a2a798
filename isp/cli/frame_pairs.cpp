#include "isp/cli/frame_pairs.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include <fmt/format.h>

#include "calib/frame_setting.h"

namespace lowlux::cli {
namespace {

constexpr double same_level = 0.02;  // of the light; what drifts by more than 1 % is refused later
constexpr double same_level_dn = 0.5;
constexpr std::size_t most_waiting = 32;

}  // namespace

double FramePairs::black_dn(const std::optional<double>& iso) const {
  double sum = 0, n = 0;
  for (const FramePair& dark : darks_) {
    if (dark.statistics.setting.iso != iso) continue;
    for (const calib::SiteStatistics& site : dark.statistics.site) sum += site.mean_dn;
    n += static_cast<double>(dark.statistics.site.size());
  }
  return n > 0 ? sum / n : 0;
}

std::vector<FramePairs::Waiting>::iterator FramePairs::partner_of(const RawDn& frame, double mean_dn) {
  double nearest = std::max(same_level_dn, same_level * std::fabs(mean_dn - black_dn(frame.info.iso)));
  auto partner = waiting_.end();
  for (auto w = waiting_.begin(); w != waiting_.end(); ++w) {
    const FrameInfo& info = w->frame.info;
    if (info.iso != frame.info.iso || info.exposure_s != frame.info.exposure_s) continue;
    const double apart = std::fabs(w->mean_dn - mean_dn);
    if (apart > nearest) continue;
    nearest = apart;
    partner = w;
  }
  return partner;
}

Result<void> FramePairs::add(RawDn frame, const std::string& file) {
  const double mean = calib::mean_dn(frame);
  const auto partner = partner_of(frame, mean);
  if (partner == waiting_.end()) {
    if (waiting_.size() == most_waiting) {
      return fail(ErrorCode::insufficient,
                  fmt::format("{} frames found no partner of the same exposure time and level; take two of each light",
                              most_waiting),
                  file);
    }
    waiting_.push_back({std::move(frame), mean, file});
    return {};
  }
  auto pair = calib::measure_pair(partner->frame, frame);
  if (!pair) return fail(pair.error().code, pair.error().message, file);
  pairs_.push_back({std::move(*pair), {partner->file, file}});
  waiting_.erase(partner);
  return {};
}

std::vector<std::string> FramePairs::alone() const {
  std::vector<std::string> files;
  files.reserve(waiting_.size());
  for (const Waiting& w : waiting_) files.push_back(w.file);
  return files;
}

}  // namespace lowlux::cli
