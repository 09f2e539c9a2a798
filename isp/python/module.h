#pragma once

#include <pybind11/pybind11.h>

/// The functions of `import lowlux`, added to the module group by group.
namespace lowlux::python {

/// Adds develop and denoise, and merge.
void add_develop(pybind11::module_& module);

/// Adds simulate and compare.
void add_simulate(pybind11::module_& module);

/// Adds calibrations, and reading and writing of profiles.
void add_calibrate(pybind11::module_& module);

/// Adds bench: the stage `methods` of the command's verb.
void add_bench(pybind11::module_& module);

}  // namespace lowlux::python
