#include "capture/file/decoder_process.h"

#include <fcntl.h>
#include <pthread.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/time.h>
#include <sys/types.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <new>
#include <optional>
#include <string>
#include <system_error>
#include <utility>

namespace lowlux::capture {
namespace {

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
#define LOWLUX_SANITIZED 1
#elif defined(__has_feature)
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer) || __has_feature(memory_sanitizer)
#define LOWLUX_SANITIZED 1
#endif
#endif
#if defined(LOWLUX_SANITIZED)
constexpr bool can_limit_address_space = false;  // shadow memory takes terabytes of it
#else
constexpr bool can_limit_address_space = true;
#endif

// Samples as decoders hold them (LibRaw: up to four 16-bit values a pixel), their tables, and the heap's own needs.
constexpr std::uint64_t decoder_bytes_per_pixel = 8;
constexpr std::uint64_t decoder_base_bytes = std::uint64_t{256} << 20;
constexpr int wall_clock_factor = 5;
constexpr int result_file = 3;  // descriptor of the result in the child

class FileDescriptor {
 public:
  explicit FileDescriptor(int fd) : fd_(fd) {}
  ~FileDescriptor() {
    if (fd_ >= 0) close(fd_);
  }
  FileDescriptor(const FileDescriptor&) = delete;
  FileDescriptor& operator=(const FileDescriptor&) = delete;
  int get() const { return fd_; }

 private:
  int fd_;
};

bool write_all(int fd, const void* data, std::size_t bytes, std::uint64_t offset) {
  const char* at = static_cast<const char*>(data);
  while (bytes > 0) {
    const ssize_t done = pwrite(fd, at, bytes, static_cast<off_t>(offset));
    if (done < 0 && errno == EINTR) continue;
    if (done <= 0) return false;
    at += done;
    offset += static_cast<std::uint64_t>(done);
    bytes -= static_cast<std::size_t>(done);
  }
  return true;
}

bool read_all(int fd, void* data, std::size_t bytes, std::uint64_t offset) {
  char* at = static_cast<char*>(data);
  while (bytes > 0) {
    const ssize_t done = pread(fd, at, bytes, static_cast<off_t>(offset));
    if (done < 0 && errno == EINTR) continue;
    if (done <= 0) return false;
    at += done;
    offset += static_cast<std::uint64_t>(done);
    bytes -= static_cast<std::size_t>(done);
  }
  return true;
}

/// Address space this process uses now [bytes]; 0 if the system does not tell.
std::uint64_t address_space_in_use() {
  const FileDescriptor statm(open("/proc/self/statm", O_RDONLY | O_CLOEXEC));
  char text[64] = {};
  if (statm.get() < 0 || read(statm.get(), text, sizeof text - 1) <= 0) return 0;
  return std::strtoull(text, nullptr, 10) * static_cast<std::uint64_t>(sysconf(_SC_PAGESIZE));
}

struct ChildLimits {
  rlim_t cpu_s;
  unsigned wall_s;
  rlim_t address_space;  // RLIM_INFINITY: not limited
  rlim_t file_bytes;
};

ChildLimits child_limits(const ReadLimits& limits, std::size_t file_bytes) {
  const double cpu_s = std::clamp(std::ceil(limits.max_decode_cpu_s), 1.0, 86400.0);
  const std::uint64_t pixels = static_cast<std::uint64_t>(std::max<std::int64_t>(limits.max_pixels, 0));
  ChildLimits out{};
  out.cpu_s = static_cast<rlim_t>(cpu_s);
  out.wall_s = static_cast<unsigned>(cpu_s) * wall_clock_factor;
  out.file_bytes = sizeof(DecodedHeader) + pixels * 3 * sizeof(std::uint16_t);
  const std::uint64_t in_use = address_space_in_use();
  out.address_space = RLIM_INFINITY;
  if (can_limit_address_space && in_use > 0) {
    out.address_space = in_use + decoder_base_bytes + file_bytes + pixels * decoder_bytes_per_pixel;
  }
  return out;
}

void lower_limit(int resource, rlim_t soft, rlim_t hard) {
  struct rlimit current {};
  if (getrlimit(static_cast<__rlimit_resource>(resource), &current) != 0) return;
  struct rlimit wanted {};
  wanted.rlim_max = std::min(hard, current.rlim_max);
  wanted.rlim_cur = std::min(soft, wanted.rlim_max);
  setrlimit(static_cast<__rlimit_resource>(resource), &wanted);
}

/// Cuts what the child could do by accident: signal handlers and descriptors of the parent, output, time, memory.
void confine(const ChildLimits& limits, int result) {
  for (int number = 1; number < NSIG; ++number) signal(number, SIG_DFL);
  sigset_t none;
  sigemptyset(&none);
  pthread_sigmask(SIG_SETMASK, &none, nullptr);
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  prctl(PR_SET_DUMPABLE, 0);

  if (dup2(result, result_file) < 0) _exit(1);
  const int nothing = open("/dev/null", O_RDWR);
  for (int standard = 0; standard < result_file; ++standard) dup2(nothing, standard);
  close_range(result_file + 1, ~0U, 0);

  lower_limit(RLIMIT_CORE, 0, 0);
  lower_limit(RLIMIT_CPU, limits.cpu_s, limits.cpu_s + 1);
  lower_limit(RLIMIT_FSIZE, limits.file_bytes, limits.file_bytes);
  if (limits.address_space != RLIM_INFINITY) lower_limit(RLIMIT_AS, limits.address_space, limits.address_space);
  // Also what ends a child that waits for a lock some other thread of the parent held when the child was made.
  alarm(limits.wall_s);
}

[[noreturn]] void run_child(std::span<const std::byte> file, const ReadLimits& limits, const ChildLimits& child,
                            int result, DecodeFunction decode) {
  confine(child, result);
  DecodeSink sink(result_file);
  try {
    decode(file, limits, sink);
  } catch (const std::bad_alloc&) {
    DecodedHeader header{};
    header.outcome = DecodeOutcome::out_of_memory;
    sink.finish(header);
  } catch (...) {
    _exit(1);
  }
  _exit(0);
}

/// Status of the ended child; nullopt if another part of the program has collected it already.
std::optional<int> wait_for(pid_t child) {
  int status = 0;
  while (waitpid(child, &status, 0) < 0) {
    if (errno != EINTR) return std::nullopt;
  }
  return status;
}

std::string seconds_text(double seconds) {
  char text[32];
  std::snprintf(text, sizeof text, "%.3g s", seconds);
  return text;
}

/// The Error of a child that did not end by itself; nullopt if it did.
std::optional<Error> abnormal_end(int status, const ReadLimits& limits) {
  if (WIFEXITED(status) && WEXITSTATUS(status) == 0) return std::nullopt;
  if (WIFSIGNALED(status)) {
    const int number = WTERMSIG(status);
    if (number == SIGXCPU || number == SIGALRM || number == SIGKILL) {
      return Error{ErrorCode::malformed,
                   "the decoder was stopped after the time limit of " + seconds_text(limits.max_decode_cpu_s) +
                       ": the file is damaged or far too large",
                   {}};
    }
    return Error{ErrorCode::malformed,
                 "the decoder crashed on this file (signal " + std::to_string(number) +
                     "): the file is damaged or the decoder has a fault",
                 {}};
  }
  return Error{
      ErrorCode::malformed, "the decoder failed on this file: the file is damaged or the decoder has a fault", {}};
}

template <std::size_t n>
void end_text(char (&text)[n]) {
  text[n - 1] = '\0';
  for (char* at = text; *at != '\0'; ++at) {
    if (*at < ' ' || *at > '~') *at = ' ';
  }
}

std::string size_text(const DecodedHeader& h) {
  return std::to_string(h.raw_width) + " x " + std::to_string(h.raw_height);
}

/// The Error of what the decoder reports; nullopt if it decoded something that fits in the limits.
std::optional<Error> reported_failure(const DecodedHeader& h, const ReadLimits& limits) {
  const std::string reason = h.reason;
  switch (h.outcome) {
    case DecodeOutcome::decoded:
      break;
    case DecodeOutcome::unsupported:
    case DecodeOutcome::not_raw:
      return Error{ErrorCode::unsupported, reason, {}};
    case DecodeOutcome::damaged:
      return Error{ErrorCode::malformed, reason, {}};
    case DecodeOutcome::too_large:
      return Error{ErrorCode::too_large,
                   "the raw image of " + size_text(h) + " pixels is over the limit of " +
                       std::to_string(limits.max_pixels) + " pixels",
                   {}};
    case DecodeOutcome::out_of_memory:
      return Error{
          ErrorCode::too_large, "the decoder ran out of the memory it may use: the file is damaged or too large", {}};
    default:
      return Error{
          ErrorCode::malformed, "the decoder failed on this file: the file is damaged or the decoder has a fault", {}};
  }
  const bool sizes_fit = h.raw_width > 0 && h.raw_height > 0 && h.raw_width <= 65535 && h.raw_height <= 65535 &&
                         (h.samples == 1 || h.samples == 3) &&
                         std::int64_t{h.raw_width} * h.raw_height <= limits.max_pixels;
  if (!sizes_fit) return Error{ErrorCode::malformed, "the decoder reports an impossible size of " + size_text(h), {}};
  return std::nullopt;
}

Result<DecodedRaw> collect(int result, const ReadLimits& limits) {
  DecodedRaw raw;
  DecodedHeader& h = raw.header;
  if (!read_all(result, &h, sizeof h, 0)) {
    h = {};
    h.outcome = DecodeOutcome::crashed;
  }
  end_text(h.reason);
  end_text(h.make);
  end_text(h.model);
  end_text(h.software);
  if (auto error = reported_failure(h, limits)) return tl::make_unexpected(*std::move(error));
  raw.samples = Plane<std::uint16_t>(h.raw_width * h.samples, h.raw_height);
  if (!read_all(result, raw.samples.data(), raw.samples.size() * sizeof(std::uint16_t), sizeof h)) {
    return fail(ErrorCode::malformed, "the decoder delivered fewer samples than the image has");
  }
  return raw;
}

}  // namespace

bool DecodeSink::write_samples(const std::uint16_t* samples, std::size_t count) {
  const std::size_t bytes = count * sizeof *samples;
  if (!write_all(file_, samples, bytes, offset_)) return false;
  offset_ += bytes;
  return true;
}

void DecodeSink::finish(const DecodedHeader& header) const { write_all(file_, &header, sizeof header, 0); }

bool decoder_memory_is_limited() { return can_limit_address_space; }

Result<DecodedRaw> decode_contained(std::span<const std::byte> file, const ReadLimits& limits, DecodeFunction decode) {
  const FileDescriptor result(memfd_create("lowlux-decoded", MFD_CLOEXEC));
  if (result.get() < 0) {
    return fail(ErrorCode::unreadable,
                std::string("no memory file for the decoder: ") + std::system_category().message(errno));
  }
  const ChildLimits child = child_limits(limits, file.size());

  // No handler of this process may run in the child before it has been reset there.
  sigset_t all, before;
  sigfillset(&all);
  pthread_sigmask(SIG_SETMASK, &all, &before);
  const pid_t pid = fork();
  if (pid == 0) run_child(file, limits, child, result.get(), decode);
  const int fork_error = errno;
  pthread_sigmask(SIG_SETMASK, &before, nullptr);
  if (pid < 0) {
    return fail(ErrorCode::unreadable,
                std::string("the decoder process cannot start: ") + std::system_category().message(fork_error));
  }
  if (const auto status = wait_for(pid)) {
    if (auto error = abnormal_end(*status, limits)) return tl::make_unexpected(*std::move(error));
  }
  return collect(result.get(), limits);
}

}  // namespace lowlux::capture
