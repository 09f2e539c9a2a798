#include "isp/python/module.h"

#include <pybind11/pybind11.h>

#include "isp/cli/shared/machine.h"
#include "isp/python/failure.h"
#include "isp/python/raw_image.h"
#include "isp/raw/kernel/raw_to_rgb.h"

PYBIND11_MODULE(_lowlux, module) {
  if (!lowlux::isp::cpu_runs_raw_to_rgb()) {
    throw pybind11::import_error("this processor lacks SSSE3, which the kernels of lowlux need");
  }
  module.attr("__version__") = lowlux::cli::version_number();
  lowlux::python::register_failures();
  lowlux::python::add_raw_image(module);
  lowlux::python::add_develop(module);
  lowlux::python::add_simulate(module);
  lowlux::python::add_calibrate(module);
  lowlux::python::add_bench(module);
}
