#pragma once

#include <pybind11/pybind11.h>

namespace lowlux::python {

/// Makes NumPy convert values without warnings and errors of its own while the object exists, in this thread: what does
/// not fit becomes infinite or NaN, which lowlux reports itself.
class QuietNumpy {
 public:
  QuietNumpy() : state_(pybind11::module_::import("numpy").attr("errstate")(pybind11::arg("all") = "ignore")) {
    state_.attr("__enter__")();
  }
  ~QuietNumpy() {
    PyObject* const left = PyObject_CallMethod(state_.ptr(), "__exit__", "OOO", Py_None, Py_None, Py_None);
    if (left == nullptr) PyErr_Clear();  // the caller's exception, if there is one, matters more
    Py_XDECREF(left);
  }
  QuietNumpy(const QuietNumpy&) = delete;
  QuietNumpy& operator=(const QuietNumpy&) = delete;

 private:
  pybind11::object state_;
};

}  // namespace lowlux::python
