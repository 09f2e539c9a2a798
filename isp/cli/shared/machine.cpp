#include "isp/cli/shared/machine.h"

#include <algorithm>
#include <fstream>
#include <iterator>

#include <fmt/format.h>
#include <sys/utsname.h>
#include <unistd.h>

#include "capture/decoder/decoder_name.h"
#include "isp/raw/kernel/raw_to_rgb.h"

namespace lowlux::cli {
namespace {

constexpr std::streamsize max_cpuinfo = 1 << 16;  // bytes; the first processor is at the start, a board at the end
constexpr std::string_view blanks = " \t\r";

std::string_view trimmed(std::string_view text) {
  const std::size_t first = text.find_first_not_of(blanks);
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(blanks) + 1 - first);
}

/// Returns the text after the first "KEY :" at the beginning of a line.
std::optional<std::string> value_of(std::string_view key, std::string_view text) {
  while (!text.empty()) {
    const std::string_view line = text.substr(0, text.find('\n'));
    const std::size_t colon = line.find(':');
    if (colon != std::string_view::npos && trimmed(line.substr(0, colon)) == key) {
      const std::string_view value = trimmed(line.substr(colon + 1));
      if (!value.empty()) return std::string(value);
    }
    text.remove_prefix(std::min(line.size() + 1, text.size()));
  }
  return std::nullopt;
}

std::string beginning_of(const std::string& file) {
  std::ifstream in(file, std::ios::binary);
  std::string text(static_cast<std::size_t>(max_cpuinfo), '\0');
  in.read(text.data(), max_cpuinfo);
  text.resize(static_cast<std::size_t>(in.gcount()));
  return text;
}

std::string system_text() {
  utsname names{};
  if (uname(&names) != 0) return "unknown";
  return fmt::format("{} {} {}", names.sysname, names.release, names.machine);
}

std::optional<double> memory_gib() {
  const long pages = sysconf(_SC_PHYS_PAGES), page_bytes = sysconf(_SC_PAGESIZE);
  if (pages <= 0 || page_bytes <= 0) return std::nullopt;
  return static_cast<double>(pages) * static_cast<double>(page_bytes) / (1 << 30);
}

std::string compiler_text() {
#ifdef __clang__
  std::string text = "Clang " __clang_version__;
#else
  std::string text = "GCC " __VERSION__;
#endif
#ifndef NDEBUG
  text += ", with assertions";
#endif
  return std::string(trimmed(text));
}

}  // namespace

std::optional<std::string> cpu_model(std::string_view cpuinfo) {
  if (auto name = value_of("model name", cpuinfo)) return name;
  return value_of("Model", cpuinfo);
}

Machine this_machine(int threads, const std::string& cpuinfo) {
  const long processors = sysconf(_SC_NPROCESSORS_ONLN);
  return {.cpu = cpu_model(beginning_of(cpuinfo)),
          .processors = processors > 0 ? static_cast<int>(processors) : threads,
          .threads = threads,
          .kernels = isp::raw_to_rgb_target(),
          .memory_gib = memory_gib(),
          .system = system_text(),
          .compiler = compiler_text(),
          .lowlux = version_number()};
}

std::string version_number() { return LOWLUX_VERSION; }

std::string version_text() {
  return fmt::format("lowlux {}\nraw decoder: {}\nkernels: {}", version_number(), capture::decoder_name(),
                     isp::raw_to_rgb_target());
}

}  // namespace lowlux::cli
