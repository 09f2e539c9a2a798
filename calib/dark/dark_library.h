#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "calib/dark/dark_stack.h"
#include "isp/base/frame.h"
#include "isp/base/result.h"

namespace lowlux::calib {

/// Dark frames of one camera and gain, sorted by exposure time and temperature as they are added: one DarkStack for
/// each setting.
class DarkLibrary {
 public:
  /// @param max_settings  maximum number of pairs of exposure time and temperature; each takes 10 bytes for each pixel
  explicit DarkLibrary(std::size_t max_settings = 8) : max_settings_(max_settings) {}

  /// Adds a frame to the stack of its exposure time whose first frame is within a degree. Errors: those of DarkStack;
  /// another camera, size, mosaic, white level or gain than the first frame's; more settings than allowed.
  Result<void> add(const RawDn& raw);

  /// Returns the groups in the order of their first frames. Of a single frame the variances are 0 and without meaning.
  std::vector<DarkGroup> groups() const;

 private:
  std::size_t max_settings_;
  std::vector<DarkStack> stacks_;
};

/// Dark frames of one gain setting, by rising temperature and exposure time.
struct DarkSet {
  std::optional<double> iso;
  std::vector<DarkGroup> groups;
};

/// Dark frames of one camera, sorted by gain, exposure time and temperature as they are added.
class DarkSorter {
 public:
  /// Adds a frame. Errors: those of DarkLibrary::add; more than 16 gain settings.
  Result<void> add(const RawDn& frame);

  /// Returns the sets by rising ISO.
  std::vector<DarkSet> sets() const;

 private:
  struct Gain {
    FrameSetting first;
    DarkLibrary darks;
  };
  std::vector<Gain> gains_;
};

}  // namespace lowlux::calib
