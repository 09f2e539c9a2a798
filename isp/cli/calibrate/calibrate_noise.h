#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "calib/flat/pair_statistics.h"
#include "isp/base/frame.h"
#include "isp/base/result.h"

namespace lowlux::cli {

/// Holds the statistics of two frames of one light, and their files.
struct FramePair {
  calib::PairStatistics statistics;
  std::vector<std::string> files;
};

/// Pairs frames as they arrive: each waits for one of its gain, exposure time and level.
class FramePairs {
 public:
  /// @param darks  define black: levels of light are compared above their mean; empty where the frames are darks
  explicit FramePairs(std::span<const FramePair> darks = {}) : darks_(darks) {}

  /// Adds a frame. Its partner is the waiting frame with the nearest level, if it is within 2 % above black or half a
  /// code. Errors: those of calib::measure_pair; more than 32 waiting frames.
  Result<void> add(RawDn frame, const std::string& file);

  const std::vector<FramePair>& pairs() const { return pairs_; }

  /// Returns the files without a partner.
  std::vector<std::string> alone() const;

 private:
  struct Waiting {
    RawDn frame;
    double mean_dn;
    std::string file;
  };
  double black_dn(const std::optional<double>& iso) const;
  std::vector<Waiting>::iterator partner_of(const RawDn& frame, double mean_dn);

  std::span<const FramePair> darks_;
  std::vector<FramePair> pairs_;
  std::vector<Waiting> waiting_;
};

}  // namespace lowlux::cli
