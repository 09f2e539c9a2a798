#pragma once

namespace lowlux {

/// Holds a measured figure and its standard error, both in the unit of the variable's name.
struct Estimate {
  double value = 0;
  double standard_error = 0;  // at least 0
  friend bool operator==(const Estimate&, const Estimate&) = default;
};

}  // namespace lowlux
