#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace lowlux::cli {

/// What times were measured on. Absent is what the system does not tell.
struct Machine {
  std::optional<std::string> cpu;
  int processors = 0;   // online
  int threads = 0;      // that the command uses, where its text does not say otherwise
  std::string kernels;  // instruction set of the vector kernels: "AVX2"
  std::optional<double> memory_gib;
  std::string system;    // "Linux 6.1.0-18-amd64 x86_64"
  std::string compiler;  // "GCC 12.2.0", and whether assertions are on
  std::string lowlux;    // version
};

/// The model of the first processor in the text of /proc/cpuinfo: "model name", on boards without one "Model".
std::optional<std::string> cpu_model(std::string_view cpuinfo);

/// This machine. @param cpuinfo  a file like /proc/cpuinfo; it need not exist
Machine this_machine(int threads, const std::string& cpuinfo = "/proc/cpuinfo");

/// "0.1.0".
std::string version_number();
/// The version, the raw decoder and the kernels' instruction set, one line each.
std::string version_text();

}  // namespace lowlux::cli
