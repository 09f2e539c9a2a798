#pragma once

#include <optional>
#include <vector>

#include "calib/dark_library.h"
#include "calib/dark_stack.h"
#include "isp/base/frame.h"
#include "isp/base/result.h"

namespace lowlux::calib {

/// Dark frames of one gain setting, by rising temperature and exposure time.
struct DarkSet {
  std::optional<double> iso;
  std::vector<DarkGroup> groups;
};

/// Dark frames of one camera, sorted by gain, exposure time and temperature as they come.
class DarkSorter {
 public:
  /// Errors: those of DarkLibrary::add; more than 16 gain settings.
  Result<void> add(const RawDn& frame);

  /// By rising ISO.
  std::vector<DarkSet> sets() const;

 private:
  struct Gain {
    FrameSetting first;
    DarkLibrary darks;
  };
  std::vector<Gain> gains_;
};

}  // namespace lowlux::calib
