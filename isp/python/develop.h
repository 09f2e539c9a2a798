#pragma once

#include <pybind11/pybind11.h>

namespace lowlux::python {

/// Adds develop and denoise, and merge.
void add_develop(pybind11::module_& module);

}  // namespace lowlux::python
