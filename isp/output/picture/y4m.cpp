#include "isp/output/picture/y4m.h"

#include <poll.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cassert>
#include <cerrno>
#include <chrono>
#include <climits>
#include <cmath>
#include <numeric>
#include <optional>
#include <string_view>
#include <system_error>

namespace lowlux::isp {
namespace {

using std::chrono::steady_clock;

constexpr int wait_ms = 100;
constexpr std::chrono::seconds patience{1};  // wait for a reader that reads nothing, after `stop` is set

struct Fraction {
  long long numerator;
  long long denominator;
};

Fraction fraction_of(double rate_hz) {
  if (rate_hz == std::round(rate_hz)) return {std::llround(rate_hz), 1};
  // Drivers report 29.97 for 30000 / 1001.
  const double television = std::round(rate_hz * 1.001) * 1000 / 1001;
  if (std::fabs(television - rate_hz) < 0.005 && television > 0) return {std::llround(television * 1001), 1001};
  const long long thousandths = std::max(1LL, std::llround(rate_hz * 1000));
  const long long common = std::gcd(thousandths, 1000LL);
  return {thousandths / common, 1000 / common};
}

/// Returns the bytes to write at once: a pipe reported as ready has space for PIPE_BUF bytes (POSIX, write()); a
/// regular file never blocks its writer.
std::size_t piece_of(int file) {
  struct stat found {};
  return fstat(file, &found) == 0 && S_ISREG(found.st_mode) ? std::size_t{1} << 30 : PIPE_BUF;
}

void add_row(const std::uint8_t* row, int width, std::vector<char>& out) { out.insert(out.end(), row, row + width); }

void add_every_second(const PlaneView<const std::uint8_t>& plane, int first, std::vector<char>& out) {
  for (int y = 0; y < plane.height; ++y) {
    const std::uint8_t* const row = plane.row(y);
    for (int x = first; x < plane.width; x += 2) out.push_back(static_cast<char>(row[x]));
  }
}

}  // namespace

std::string y4m_header(const Y4mFormat& format) {
  const Fraction rate = fraction_of(format.frame_rate_hz);
  return "YUV4MPEG2 W" + std::to_string(format.width) + " H" + std::to_string(format.height) + " F" +
         std::to_string(rate.numerator) + ":" + std::to_string(rate.denominator) +
         " Ip A1:1 C420jpeg XCOLORRANGE=LIMITED\n";
}

Y4mWriter::Y4mWriter(int file, const Y4mFormat& format) : file_(file), piece_bytes_(piece_of(file)), format_(format) {
  const auto luma = static_cast<std::size_t>(format.width) * static_cast<std::size_t>(format.height);
  bytes_.reserve(luma + (luma / 2) + static_cast<std::size_t>(format.width + format.height) + 128);
}

Result<Y4mWriter::Written> Y4mWriter::write(PlaneView<const std::uint8_t> luma, PlaneView<const std::uint8_t> chroma,
                                            const std::atomic<bool>& stop) {
  assert(luma.width == format_.width && luma.height == format_.height);
  assert(chroma.width == 2 * ((luma.width + 1) / 2) && chroma.height == (luma.height + 1) / 2);
  bytes_.clear();
  const std::string header = begun_ ? std::string() : y4m_header(format_);
  constexpr std::string_view frame = "FRAME\n";
  bytes_.insert(bytes_.end(), header.begin(), header.end());
  bytes_.insert(bytes_.end(), frame.begin(), frame.end());
  for (int y = 0; y < luma.height; ++y) add_row(luma.row(y), luma.width, bytes_);
  add_every_second(chroma, 0, bytes_);
  add_every_second(chroma, 1, bytes_);
  begun_ = true;
  return write_all(stop);
}

Result<Y4mWriter::Written> Y4mWriter::write_all(const std::atomic<bool>& stop) {
  std::optional<steady_clock::time_point> until;
  for (std::size_t done = 0; done < bytes_.size();) {
    if (stop && !until) until = steady_clock::now() + patience;
    if (until && steady_clock::now() >= *until) return Written::interrupted;
    pollfd ready{.fd = file_, .events = POLLOUT, .revents = 0};
    if (poll(&ready, 1, wait_ms) <= 0) continue;
    const ssize_t written = ::write(file_, bytes_.data() + done, std::min(piece_bytes_, bytes_.size() - done));
    if (written >= 0) {
      done += static_cast<std::size_t>(written);
      if (written > 0) until.reset();
      continue;
    }
    if (errno == EPIPE) return Written::reader_left;
    if (errno == EINTR || errno == EAGAIN) continue;
    return fail(ErrorCode::unwritable, "the video cannot be written: " + std::generic_category().message(errno));
  }
  return Written::whole;
}

}  // namespace lowlux::isp
