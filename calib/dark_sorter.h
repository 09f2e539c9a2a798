#pragma once

#include <optional>
#include <vector>

#include "calib/black_figures.h"
#include "calib/dark_stack.h"
#include "isp/base/frame.h"
#include "isp/base/result.h"

namespace lowlux::calib {

/// Dark frames of one gain setting.
struct DarkSet {
  std::optional<double> iso;
  std::vector<DarkGroup> groups;               // of two frames or more, by rising temperature and exposure time
  std::optional<BlackFigures> single;          // where there is but one frame
  std::optional<FrameSetting> single_setting;  // likewise
};

/// Puts dark frames together by gain, exposure time and temperature as they come: 10 bytes for each pixel of each
/// setting, however many frames.
class DarkSorter {
 public:
  /// Errors: those of DarkStack::add; another camera or size than the first frame; more than 64 settings.
  Result<void> add(const RawDn& frame);

  /// By rising ISO. Errors: one frame of a setting where there are others of that gain; those of measure_black for a
  /// single frame.
  Result<std::vector<DarkSet>> sets() const;

 private:
  struct Entry {
    FrameSetting setting;
    DarkStack stack;
    Result<BlackFigures> first;  // of the first frame
  };
  std::vector<Entry> entries_;
};

}  // namespace lowlux::calib
