// Times unpack_row over whole frames against memcpy of as many bytes, in and out counted, in one run.
//   unpack_bench [--rounds N, at least 15]
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <memory>
#include <vector>

#include "isp/base/packed/raw_format.h"
#include "isp/metrics/statistics.h"

namespace {

using namespace lowlux;

struct Size {
  int width;
  int height;
};

struct Packing {
  const char* name;
  RawFormat format;
};

constexpr RawFormat mono(int bits, RawPacking packing) { return {bits, packing, SensorLayout::monochrome}; }

constexpr Packing packings[] = {{"8", mono(8, RawPacking::byte)},
                                {"16, little endian", mono(16, RawPacking::little16)},
                                {"16, big endian", mono(16, RawPacking::big16)},
                                {"10P", mono(10, RawPacking::csi2)},
                                {"12P", mono(12, RawPacking::csi2)},
                                {"14P", mono(14, RawPacking::csi2)},
                                {"10 IPU3", {10, RawPacking::ipu3}},
                                {"Y10B", mono(10, RawPacking::bits_msb_first)}};

double cpu_clock_ns() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return 1e9 * static_cast<double>(now.tv_sec) + static_cast<double>(now.tv_nsec);
}

/// One packing at one size, beside a copy that moves as many bytes.
class Task {
 public:
  Task(const Packing& packing, Size size)
      : packing_(packing),
        size_(size),
        stride_((row_bytes(packing.format, size.width) + 63) / 64 * 64),
        in_(stride_ * size.height, std::byte{0x5a}),
        out_(static_cast<std::size_t>(size.width) * size.height),
        moved_bytes_(row_bytes(packing.format, size.width) * size.height + sizeof(out_[0]) * out_.size()),
        copy_from_(moved_bytes_ / 2, std::byte{1}),
        copy_to_(moved_bytes_ / 2, std::byte{2}) {}

  void run() {
    const double start = cpu_clock_ns();
    for (int y = 0; y < size_.height; ++y) {
      unpack_row(packing_.format, in_.data() + stride_ * y, size_.width,
                 out_.data() + static_cast<std::size_t>(size_.width) * y);
    }
    const double between = cpu_clock_ns();
    std::memcpy(copy_to_.data(), copy_from_.data(), copy_to_.size());
    unpack_ns_.push_back(between - start);
    copy_ns_.push_back(cpu_clock_ns() - between);
  }

  /// What was measured up to now was to warm up.
  void forget() { unpack_ns_.clear(), copy_ns_.clear(); }

  void print() const {
    const double unpack_ns = isp::median(unpack_ns_), copy_ns = isp::median(copy_ns_);
    const auto bytes = static_cast<double>(moved_bytes_);
    std::printf("%-18s %5d x %4d | %8.3f %8.2f %8.2f %8.2f\n", packing_.name, size_.width, size_.height,
                1e-6 * unpack_ns, bytes / unpack_ns, bytes / copy_ns, unpack_ns / copy_ns);
  }

 private:
  Packing packing_;
  Size size_;
  std::size_t stride_;
  std::vector<std::byte> in_;
  std::vector<std::uint16_t> out_;
  std::size_t moved_bytes_;
  std::vector<std::byte> copy_from_, copy_to_;
  std::vector<double> unpack_ns_{}, copy_ns_{};
};

}  // namespace

int main(int argc, char** argv) {
  const int rounds = argc == 3 && std::strcmp(argv[1], "--rounds") == 0 ? std::atoi(argv[2]) : 31;
  if ((argc != 1 && argc != 3) || rounds < 15) {
    return std::fprintf(stderr, "usage: unpack_bench [--rounds N, at least 15]\n"), 2;
  }
  std::vector<std::unique_ptr<Task>> tasks;
  for (const Size size : {Size{1920, 1080}, Size{3280, 2464}}) {
    for (const Packing& packing : packings) tasks.push_back(std::make_unique<Task>(packing, size));
  }
  for (int round = -2; round < rounds; ++round) {
    for (const auto& task : tasks) {
      if (round == 0) task->forget();
      task->run();
    }
  }
  std::printf("target %s, %d rounds, medians of CPU time of one core; bytes in and out are counted\n\n",
              unpack_target(), rounds);
  std::printf("%-18s %12s | %8s %8s %8s %8s\n", "packing", "size", "ms", "GB/s", "memcpy", "x memcpy");
  for (const auto& task : tasks) task->print();
  return 0;
}
