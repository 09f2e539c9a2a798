#pragma once

#include <string>
#include <vector>

#include <pybind11/pybind11.h>

namespace lowlux::python {

/// Returns a text that may hold names of files, or what a file states, in any bytes: those that are not UTF-8 become
/// what os.fsdecode makes of them.
inline pybind11::str str_of(const std::string& text) {
  return pybind11::reinterpret_steal<pybind11::str>(
      PyUnicode_DecodeFSDefaultAndSize(text.data(), static_cast<Py_ssize_t>(text.size())));
}

/// Returns a list of such texts.
inline pybind11::list strs_of(const std::vector<std::string>& texts) {
  pybind11::list out;
  for (const std::string& text : texts) out.append(str_of(text));
  return out;
}

}  // namespace lowlux::python
