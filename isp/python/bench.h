#pragma once

#include <pybind11/pybind11.h>

namespace lowlux::python {

/// Adds bench: the stage `methods` of the command's verb.
void add_bench(pybind11::module_& module);

}  // namespace lowlux::python
