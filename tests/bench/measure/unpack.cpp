// Times unpack_row over whole frames against memcpy of as many bytes, in and out counted, in one run.
#include <cstdio>
#include <cstring>
#include <memory>
#include <vector>

#include "isp/base/packed/raw_format.h"
#include "tests/bench/measure/measure.h"

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

/// One packing at one size, and memory for a copy that moves as many bytes.
struct Frame {
  Frame(const Packing& of, Size at)
      : packing(of),
        size(at),
        stride((row_bytes(of.format, at.width) + 63) / 64 * 64),
        in(stride * at.height, std::byte{0x5a}),
        out(static_cast<std::size_t>(at.width) * at.height),
        moved_bytes(row_bytes(of.format, at.width) * at.height + sizeof(out[0]) * out.size()),
        copy_from(moved_bytes / 2, std::byte{1}),
        copy_to(moved_bytes / 2, std::byte{2}) {}

  void unpack() {
    for (int y = 0; y < size.height; ++y) {
      unpack_row(packing.format, in.data() + stride * y, size.width,
                 out.data() + static_cast<std::size_t>(size.width) * y);
    }
  }
  void copy() { std::memcpy(copy_to.data(), copy_from.data(), copy_to.size()); }

  Packing packing;
  Size size;
  std::size_t stride;
  std::vector<std::byte> in;
  std::vector<std::uint16_t> out;
  std::size_t moved_bytes;
  std::vector<std::byte> copy_from, copy_to;
};

void print_row(const Frame& frame, const test::Task& unpack, const test::Task& copy) {
  const double unpack_ns = 1e6 * unpack.median_cpu_ms(), copy_ns = 1e6 * copy.median_cpu_ms();
  const auto bytes = static_cast<double>(frame.moved_bytes);
  std::printf("%-18s %5d x %4d | %8.3f %8.2f %8.2f %8.2f\n", frame.packing.name, frame.size.width, frame.size.height,
              1e-6 * unpack_ns, bytes / unpack_ns, bytes / copy_ns, unpack_ns / copy_ns);
}

}  // namespace

int lowlux::test::measure_unpack(Arguments& arguments) {
  const int rounds = arguments.option("--rounds", 31, 15);
  arguments.end();
  std::vector<std::unique_ptr<Frame>> frames;
  std::vector<Task> tasks;
  for (const Size size : {Size{1920, 1080}, Size{3280, 2464}}) {
    for (const Packing& packing : packings) {
      Frame* const frame = frames.emplace_back(std::make_unique<Frame>(packing, size)).get();
      tasks.push_back({packing.name, [frame] { frame->unpack(); }});
      tasks.push_back({"memcpy", [frame] { frame->copy(); }});
    }
  }
  time_in_turn(tasks, rounds);
  std::printf("target %s, %d rounds, medians of CPU time of one core; bytes in and out are counted\n\n",
              unpack_target(), rounds);
  std::printf("%-18s %12s | %8s %8s %8s %8s\n", "packing", "size", "ms", "GB/s", "memcpy", "x memcpy");
  for (std::size_t i = 0; i < frames.size(); ++i) print_row(*frames[i], tasks[2 * i], tasks[2 * i + 1]);
  return 0;
}
