#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace lowlux::cli {

/// Describes the machine on which times were measured. Values that the system does not report are absent.
struct Machine {
  std::optional<std::string> cpu;
  int processors = 0;   // online
  int threads = 0;      // used by the command, unless its text states otherwise
  std::string kernels;  // instruction set of the vector kernels: "AVX2"
  std::optional<double> memory_gib;
  std::string system;    // "Linux 6.1.0-18-amd64 x86_64"
  std::string compiler;  // "GCC 12.2.0", and whether assertions are on
  std::string lowlux;    // version
};

/// Returns the model of the first processor in the text of /proc/cpuinfo: "model name", on boards without one "Model".
std::optional<std::string> cpu_model(std::string_view cpuinfo);

/// Describes this machine. @param cpuinfo  a file like /proc/cpuinfo; it need not exist
Machine this_machine(int threads, const std::string& cpuinfo = "/proc/cpuinfo");

/// Returns "0.1.0".
std::string version_number();
/// Returns the version, the raw decoder and the kernels' instruction set, one line each.
std::string version_text();

}  // namespace lowlux::cli
