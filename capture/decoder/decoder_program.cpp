#include "capture/decoder/decoder_program.h"

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <csignal>
#include <cstdlib>
#include <new>
#include <optional>
#include <string_view>

namespace lowlux::capture {
namespace {

// Samples as decoders hold them (LibRaw: up to four 16-bit values a pixel), with their tables and the heap's overhead.
constexpr std::uint64_t decoder_bytes_per_pixel = 8;
constexpr std::uint64_t decoder_base_bytes = std::uint64_t{256} << 20;

/// Returns the address space this process uses now [bytes]; 0 if the system does not report it.
std::uint64_t address_space_in_use() {
  const int statm = open("/proc/self/statm", O_RDONLY | O_CLOEXEC);
  char text[64] = {};
  const ssize_t length = statm < 0 ? 0 : read(statm, text, sizeof text - 1);
  if (statm >= 0) close(statm);
  if (length <= 0) return 0;
  return std::strtoull(text, nullptr, 10) * static_cast<std::uint64_t>(sysconf(_SC_PAGESIZE));
}

void lower_limit(int resource, rlim_t soft, rlim_t hard) {
  struct rlimit current {};
  if (getrlimit(static_cast<__rlimit_resource>(resource), &current) != 0) return;
  struct rlimit wanted {};
  wanted.rlim_max = std::min(hard, current.rlim_max);
  wanted.rlim_cur = std::min({soft, wanted.rlim_max, current.rlim_cur});
  setrlimit(static_cast<__rlimit_resource>(resource), &wanted);
}

/// Ends the program together with its caller, but not by signals that are meant for the caller.
void follow(pid_t caller) {
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  if (getppid() != caller) _exit(EXIT_FAILURE);  // the caller ended before
  for (const int number : {SIGINT, SIGTERM, SIGHUP, SIGQUIT}) signal(number, SIG_IGN);
}

/// Limits accidental effects of the program: descriptors of its caller, output, time, memory.
void confine(const ReadLimits& limits, std::uint64_t file_bytes) {
  prctl(PR_SET_DUMPABLE, 0);
  close_range(std::max(result_descriptor, file_descriptor) + 1, ~0U, 0);
  const auto cpu_s = static_cast<rlim_t>(std::clamp(std::ceil(limits.max_decode_cpu_s), 1.0, 86400.0));
  const auto pixels = static_cast<std::uint64_t>(std::max<std::int64_t>(limits.max_pixels, 0));
  const rlim_t result_bytes = sizeof(DecodedHeader) + pixels * 3 * sizeof(std::uint16_t);
  lower_limit(RLIMIT_CORE, 0, 0);
  lower_limit(RLIMIT_CPU, cpu_s, cpu_s + 1);
  lower_limit(RLIMIT_FSIZE, result_bytes, result_bytes);
  const std::uint64_t in_use = address_space_in_use();
  if (decoder_memory_is_limited && in_use > 0) {
    const rlim_t bytes = in_use + decoder_base_bytes + file_bytes + pixels * decoder_bytes_per_pixel;
    lower_limit(RLIMIT_AS, bytes, bytes);
  }
  alarm(static_cast<unsigned>(cpu_s) * wall_clock_factor);
}

template <class Number>
std::optional<Number> number_of(std::string_view text) {
  Number number{};
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return number;
}

struct Request {
  pid_t caller;
  ReadLimits limits;
};

std::optional<Request> request_of(std::span<char* const> arguments) {
  if (arguments.size() < 4) return std::nullopt;
  const auto last = arguments.last(4);
  if (number_of<std::uint64_t>(last[0]) != decode_protocol) return std::nullopt;
  const auto caller = number_of<pid_t>(last[1]);
  const auto pixels = number_of<std::int64_t>(last[2]);
  const auto cpu_s = number_of<double>(last[3]);
  if (!caller || !pixels || !cpu_s) return std::nullopt;
  return Request{*caller, {.max_pixels = *pixels, .max_decode_cpu_s = *cpu_s}};
}

/// Returns the mapped file; nullopt if there is none.
std::optional<std::span<const std::byte>> mapped_file() {
  struct stat status {};
  if (fstat(file_descriptor, &status) != 0 || status.st_size <= 0) return std::nullopt;
  const auto size = static_cast<std::size_t>(status.st_size);
  void* const mapped = mmap(nullptr, size, PROT_READ | PROT_WRITE, MAP_PRIVATE, file_descriptor, 0);
  if (mapped == MAP_FAILED) return std::nullopt;
  return std::span(static_cast<const std::byte*>(mapped), size);
}

}  // namespace

bool DecodeSink::write_samples(const std::uint16_t* samples, std::size_t count) {
  const auto bytes = std::as_bytes(std::span(samples, count));
  if (!write_all(file_, bytes, offset_)) return false;
  offset_ += bytes.size();
  return true;
}

void DecodeSink::finish(const DecodedHeader& header) const {
  write_all(file_, std::as_bytes(std::span(&header, 1)), 0);
}

void run_decoder(std::span<char* const> arguments, DecodeFunction decode) {
  const auto request = request_of(arguments);
  if (!request) _exit(wrong_protocol_exit);
  follow(request->caller);
  const auto file = mapped_file();
  if (!file) _exit(no_memory_exit);
  confine(request->limits, file->size());
  DecodeSink sink(result_descriptor);
  try {
    decode(*file, request->limits, sink);
  } catch (const std::bad_alloc&) {
    DecodedHeader header{};
    header.outcome = DecodeOutcome::out_of_memory;
    sink.finish(header);
  } catch (...) {
    _exit(EXIT_FAILURE);
  }
  _exit(EXIT_SUCCESS);
}

}  // namespace lowlux::capture
