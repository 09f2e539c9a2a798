#pragma once

#include <pybind11/pybind11.h>

namespace lowlux::python {

/// Adds simulate and compare.
void add_simulate(pybind11::module_& module);

/// Adds calibrations, and reading and writing of profiles.
void add_calibrate(pybind11::module_& module);

}  // namespace lowlux::python
