#include "isp/cli/develop/memory_gate.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <filesystem>
#include <string>
#include <thread>
#include <vector>

#include "isp/pipeline/render/pipeline_memory.h"
#include "tests/support/scratch_directory.h"

namespace lowlux::cli {
namespace {

// Eight workers, files of one size: the most that were inside at once, and what is said of it.
struct Crowd {
  int most = 0;
  std::optional<std::string> text;
};

Crowd crowd(double limit_bytes, std::size_t file_bytes) {
  MemoryGate gate(limit_bytes);
  std::atomic<int> inside{0}, most{0};
  {
    std::vector<std::jthread> workers;
    for (int i = 0; i < 8; ++i) {
      workers.emplace_back([&] {
        for (int file = 0; file < 4; ++file) {
          gate.enter();
          const int now = ++inside;
          for (int before = most; before < now && !most.compare_exchange_weak(before, now);) continue;
          gate.report_size(file_bytes);
          std::this_thread::sleep_for(std::chrono::milliseconds(10));
          --inside;
          gate.leave();
        }
      });
    }
  }
  return {most, gate.limit_text()};
}

TEST(MemoryGate, AsManyFilesAsMemoryHoldsAndAlwaysOne) {
  const Crowd three = crowd(3.9e6, 1'200'000);
  EXPECT_EQ(three.most, 3);
  EXPECT_EQ(three.text, "3 files in parallel, limited by memory: about 1 MB for each, 4 MB for all");
  EXPECT_EQ(crowd(1e6, 5'000'000).most, 1);
  const Crowd all = crowd(1e9, 1'000);
  EXPECT_GT(all.most, 3);
  EXPECT_FALSE(all.text.has_value());
}

TEST(MemoryGate, StatesHowManyFilesShareTheProcessors) {
  MemoryGate gate(3.9e6);
  EXPECT_EQ(gate.parallel_files(8), 1) << "the others wait for the first size";
  gate.enter();
  gate.report_size(1'200'000);
  EXPECT_EQ(gate.parallel_files(8), 3);
  EXPECT_EQ(gate.parallel_files(2), 2);
  gate.report_size(5'000'000);
  EXPECT_EQ(gate.parallel_files(8), 1);
  gate.leave();
}

// A file that cannot be read has no size: the others are not kept waiting for it.
TEST(MemoryGate, FilesWithoutASizeComeOneByOne) {
  MemoryGate gate(1e9);
  for (int i = 0; i < 3; ++i) {
    gate.enter();
    gate.leave();
  }
  EXPECT_FALSE(gate.limit_text().has_value());
}

// What `lowlux develop` was measured to take above `lowlux --version`: 38 bytes a pixel at 12 MP (8 bits, noise
// reduced), 46 as floats, 46 as an eye sees it; scripts/memory-peak holds 100 MP below 1 GiB. The gate keeps a fifth in
// reserve.
TEST(ExpectedBytes, AreWhatDevelopingTakes) {
  const auto frame = [](int width, int height) {
    RawDn raw;
    raw.dn = Plane<std::uint16_t>(width, height);
    raw.active = raw.default_crop = {0, 0, width, height};
    return raw;
  };
  const RawDn raw = frame(4000, 3000);
  isp::DevelopOptions options;
  options.denoise.mode = isp::DenoiseChoice::Mode::automatic;
  const auto per_pixel = [&] { return static_cast<double>(isp::expected_bytes(raw, options, 2)) / 12e6; };
  EXPECT_NEAR(per_pixel(), 38, 0.2 * 38);
  options.look.look = isp::Look::eye;
  EXPECT_NEAR(per_pixel(), 46, 0.2 * 46);
  options.look.look = isp::Look::camera;
  EXPECT_LT(isp::expected_bytes(frame(12000, 8334), options, 2), std::size_t{1} << 30);
  options.samples = SampleType::f32;
  EXPECT_NEAR(per_pixel(), 46, 0.2 * 46);
  options.denoise.mode = isp::DenoiseChoice::Mode::off;
  EXPECT_LT(per_pixel(), 30);
}

class AvailableMemory : public testing::Test {
 protected:
  void write(const std::string& name, const std::string& text) {
    std::filesystem::create_directories(std::filesystem::path(scratch_.file(name)).parent_path());
    scratch_.write(name, text);
  }
  std::optional<double> available() { return available_memory(scratch_.file("proc"), scratch_.file("groups")); }

  test::ScratchDirectory scratch_;
};

TEST_F(AvailableMemory, IsWhatTheSystemAndItsControlGroupsLeave) {
  EXPECT_FALSE(available().has_value());
  write("proc/meminfo", "MemTotal:       16000 kB\nMemAvailable:    9000 kB\n");
  EXPECT_EQ(available(), 9000 * 1024.0);
  write("proc/self/cgroup", "0::/user/job\n");
  write("groups/user/job/memory.max", "max\n");
  write("groups/user/job/memory.current", "1000000\n");
  EXPECT_EQ(available(), 9000 * 1024.0);
  write("groups/user/memory.max", "5000000\n");  // of a group above it
  write("groups/user/memory.current", "4000000\n");
  write("groups/user/memory.stat", "anon 3000000\ninactive_file 500000\n");
  EXPECT_EQ(available(), 1500000);
  write("groups/user/memory.current", "6000000\n");
  EXPECT_EQ(available(), 0);
}

TEST_F(AvailableMemory, KnowsTheFirstVersionOfControlGroupsToo) {
  write("proc/meminfo", "MemAvailable:    9000 kB\n");
  write("proc/self/cgroup", "5:cpu,cpuacct:/\n4:memory:/job\n");
  write("groups/memory/job/memory.limit_in_bytes", "3000000\n");
  write("groups/memory/job/memory.usage_in_bytes", "1000000\n");
  write("groups/memory/job/memory.stat", "total_inactive_file 250000\n");
  EXPECT_EQ(available(), 2250000);
  const auto here = available_memory();
  ASSERT_TRUE(here.has_value());
  EXPECT_GT(*here, 0);
}

}  // namespace
}  // namespace lowlux::cli
