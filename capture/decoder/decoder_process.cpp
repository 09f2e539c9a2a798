#include "capture/decoder/decoder_process.h"

#include <dlfcn.h>
#include <fcntl.h>
#include <link.h>
#include <spawn.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <optional>
#include <system_error>
#include <utility>

#include "capture/decoder/decoder_program.h"
#include "capture/file/pass_on.h"
#include "isp/base/text.h"

namespace lowlux::capture {
namespace {

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

/// Returns an empty file in memory, whose number the child does not use otherwise; -1 on failure.
int memory_file(const char* name) {
  const FileDescriptor low(memfd_create(name, MFD_CLOEXEC));
  return low.get() < 0 ? -1 : fcntl(low.get(), F_DUPFD_CLOEXEC, std::max(result_descriptor, file_descriptor) + 1);
}

Error system_error(const std::string& what, int number) {
  return {ErrorCode::unreadable, what + ": " + std::system_category().message(number), {}};
}

/// Returns the environment of this process, and for the C library of a decoder the setting to ask for huge pages as
/// prefer_huge_pages() does, unless the user has settings of their own.
std::vector<char*> decoder_environment() {
  static char huge_pages[] = "GLIBC_TUNABLES=glibc.malloc.hugetlb=1";
  std::vector<char*> out;
  for (char** variable = environ; *variable != nullptr; ++variable) out.push_back(*variable);
  // NOLINTNEXTLINE(concurrency-mt-unsafe): nothing here sets variables
  if (std::getenv("GLIBC_TUNABLES") == nullptr) out.push_back(huge_pages);
  out.push_back(nullptr);
  return out;
}

/// Starts a program with default signal handling, and with no open files except its two. It has a process group of its
/// own: signals of a terminal reach the caller alone.
Result<pid_t> start(const std::vector<std::string>& command, int file, int result) {
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  for (int standard = 0; standard < 3; ++standard) {
    posix_spawn_file_actions_addopen(&actions, standard, "/dev/null", O_RDWR, 0);
  }
  posix_spawn_file_actions_adddup2(&actions, result, result_descriptor);
  posix_spawn_file_actions_adddup2(&actions, file, file_descriptor);
  posix_spawnattr_t attributes;
  posix_spawnattr_init(&attributes);
  sigset_t all, none;
  sigfillset(&all);
  sigemptyset(&none);
  posix_spawnattr_setsigdefault(&attributes, &all);
  posix_spawnattr_setsigmask(&attributes, &none);
  posix_spawnattr_setpgroup(&attributes, 0);
  posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETSIGDEF | POSIX_SPAWN_SETSIGMASK | POSIX_SPAWN_SETPGROUP);
  std::vector<char*> words;
  words.reserve(command.size() + 1);
  for (const std::string& word : command) words.push_back(const_cast<char*>(word.c_str()));
  words.push_back(nullptr);
  std::vector<char*> environment = decoder_environment();
  pid_t child = 0;
  const int failed = posix_spawn(&child, words[0], &actions, &attributes, words.data(), environment.data());
  posix_spawnattr_destroy(&attributes);
  posix_spawn_file_actions_destroy(&actions);
  if (failed != 0) return tl::make_unexpected(system_error("the decoder " + command[0] + " cannot start", failed));
  return child;
}

/// Exit of a child process.
struct Ended {
  std::optional<int> status;  // nullopt if other code of this process has collected it already
  rusage used{};
  double elapsed_s = 0;
};

Ended wait_for(pid_t child, std::chrono::steady_clock::time_point begin) {
  Ended out;
  int status = 0;
  pid_t found = -1;
  do found = wait4(child, &status, 0, &out.used);
  while (found < 0 && errno == EINTR);
  if (found == child) out.status = status;
  out.elapsed_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  return out;
}

std::string seconds_text(double seconds) { return number_text(std::round(10 * seconds) / 10) + " s"; }

double cpu_s(const rusage& used) {
  const auto seconds = [](const timeval& time) {
    return static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_usec);
  };
  return seconds(used.ru_utime) + seconds(used.ru_stime);
}

/// Returns the Error of a child that a signal ended.
Error ended_by(int number, const Ended& ended, const ReadLimits& limits) {
  if (number == SIGXCPU || (number == SIGKILL && cpu_s(ended.used) >= limits.max_decode_cpu_s)) {
    return {ErrorCode::malformed,
            "the decoder was stopped at its limit of processor time, after " + seconds_text(cpu_s(ended.used)) +
                ": the file is damaged or far too large",
            {}};
  }
  if (number == SIGALRM) {
    return {ErrorCode::malformed,
            "the decoder was stopped after " + seconds_text(ended.elapsed_s) + ", of which it used the processor for " +
                seconds_text(cpu_s(ended.used)) + ": the computer is overloaded, or the decoder has a fault",
            {}};
  }
  if (number == SIGKILL) {
    return {ErrorCode::too_large,
            "the decoder was killed after " + seconds_text(ended.elapsed_s) +
                ": the system is short of memory, or a user ended it; read fewer files at a time",
            {}};
  }
  return {ErrorCode::malformed,
          "the decoder crashed on this file (signal " + std::to_string(number) +
              "): the file is damaged or the decoder has a fault",
          {}};
}

constexpr int cannot_load_exit = 127;  // of the dynamic linker

/// Returns the Error of a child that did not exit normally; nullopt if it did.
std::optional<Error> abnormal_end(const Ended& ended, const ReadLimits& limits) {
  if (!ended.status || (WIFEXITED(*ended.status) && WEXITSTATUS(*ended.status) == 0)) return std::nullopt;
  if (WIFSIGNALED(*ended.status)) return ended_by(WTERMSIG(*ended.status), ended, limits);
  if (WEXITSTATUS(*ended.status) == wrong_protocol_exit) {
    return Error{ErrorCode::unreadable,
                 "the decoder is of another version of lowlux: start lowlux again, or install it again",
                 {}};
  }
  if (WEXITSTATUS(*ended.status) == no_memory_exit) {
    return Error{ErrorCode::too_large, "there is not enough memory for the decoder to read this file", {}};
  }
  if (WEXITSTATUS(*ended.status) == cannot_load_exit) {
    return Error{
        ErrorCode::unreadable,
        "the decoder cannot be loaded: is LibRaw installed, and is there memory for it? lowlux-decode says more",
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

/// Returns the Error that the decoder reports; nullopt if it decoded data within the limits.
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
  if (!read_all(result, std::as_writable_bytes(std::span(&h, 1)), 0)) {
    h = {};
    h.outcome = DecodeOutcome::crashed;
  }
  end_text(h.reason);
  end_text(h.make);
  end_text(h.model);
  end_text(h.software);
  if (auto error = reported_failure(h, limits)) return tl::make_unexpected(*std::move(error));
  const std::uint64_t sample_bytes = std::uint64_t{sizeof(std::uint16_t)} * h.raw_width * h.samples * h.raw_height;
  struct stat delivered {};
  if (fstat(result, &delivered) != 0 || static_cast<std::uint64_t>(delivered.st_size) < sizeof h + sample_bytes) {
    return fail(ErrorCode::malformed, "the decoder delivered fewer samples than the image has");
  }
  raw.samples = Plane<std::uint16_t>(h.raw_width * h.samples, h.raw_height);
  if (!read_all(result, std::as_writable_bytes(std::span(raw.samples.data(), raw.samples.size())), sizeof h)) {
    return fail(ErrorCode::unreadable, "the decoder's samples cannot be read");
  }
  return raw;
}

/// Returns the folder of the library or program that contains this code.
Result<std::filesystem::path> own_folder() {
  Dl_info info{};
  void* found = nullptr;
  const bool known = dladdr1(reinterpret_cast<void*>(&own_folder), &info, &found, RTLD_DL_LINKMAP) != 0;
  const char* const name = known ? static_cast<const link_map*>(found)->l_name : "";  // "" is the program itself
  std::error_code failed;
  if (*name != '\0' && *name != '/') {
    return fail(ErrorCode::unreadable,
                std::string("the library ") + name +
                    " was loaded by a relative path, so its folder is not known: load it by an absolute path");
  }
  // The link to the program names its folder even if its file has been replaced since.
  const auto file = *name != '\0' ? std::filesystem::canonical(name, failed)
                                  : std::filesystem::read_symlink("/proc/self/exe", failed);
  if (failed) return fail(ErrorCode::unreadable, "the folder of lowlux's library is not known: is /proc mounted?");
  return file.parent_path();
}

}  // namespace

Result<DecodedRaw> decode_contained(std::span<const std::byte> file, const ReadLimits& limits,
                                    std::vector<std::string> command) {
  const FileDescriptor result(memory_file("lowlux-decoded"));
  std::optional<FileDescriptor> copy(std::in_place, memory_file("lowlux-raw"));
  if (result.get() < 0 || copy->get() < 0) {
    return tl::make_unexpected(system_error("a memory file for the decoder cannot be created", errno));
  }
  if (!write_all(copy->get(), file, 0)) {
    return fail(ErrorCode::too_large, "there is not enough memory to hand this file to the decoder");
  }
  command.push_back(std::to_string(decode_protocol));
  command.push_back(std::to_string(getpid()));
  command.push_back(std::to_string(limits.max_pixels));
  command.push_back(number_text(limits.max_decode_cpu_s));
  const auto begin = std::chrono::steady_clock::now();
  const auto child = start(command, copy->get(), result.get());
  if (!child) return tl::make_unexpected(child.error());
  copy.reset();
  if (auto error = abnormal_end(wait_for(*child, begin), limits)) return tl::make_unexpected(*std::move(error));
  return collect(result.get(), limits);
}

Result<DecodedRaw> decode_contained(std::span<const std::byte> file, const ReadLimits& limits, DecoderProgram program) {
  auto folder = own_folder();
  if (!folder) return pass_on(folder);
  const std::string name = program == DecoderProgram::libraw ? "lowlux-decode" : "lowlux-decode-jxl";
  for (const auto& place : {*folder / name, *folder / "lowlux" / name}) {
    if (access(place.c_str(), X_OK) == 0) return decode_contained(file, limits, std::vector{place.string()});
  }
  std::string message = "the program " + name + " is neither in " + folder->string() + " nor in lowlux/ there: ";
  if (program == DecoderProgram::libraw) return fail(ErrorCode::unreadable, message + "install lowlux again");
  return fail(ErrorCode::unsupported, message + "JPEG XL needs a build of lowlux with libjxl (libjxl-dev)");
}

}  // namespace lowlux::capture
