#include "capture/file/decoder_process.h"

#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <numeric>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

namespace lowlux::capture {
namespace {

using Bytes = std::span<const std::byte>;

std::unique_ptr<DecodedHeader> header_of(int width, int height, int samples = 1) {
  auto header = std::make_unique<DecodedHeader>();
  *header = {};
  header->outcome = DecodeOutcome::decoded;
  header->raw_width = width;
  header->raw_height = height;
  header->samples = samples;
  return header;
}

/// Width from the first byte of the file, ten rows, samples 0, 1, 2, ...
void count_up(Bytes file, const ReadLimits& /*limits*/, DecodeSink& sink) {
  const int width = std::to_integer<int>(file[0]);
  std::vector<std::uint16_t> row(width);
  for (int y = 0; y < 10; ++y) {
    std::iota(row.begin(), row.end(), static_cast<std::uint16_t>(y * width));
    sink.write_samples(row.data(), row.size());
  }
  sink.finish(*header_of(width, 10));
}

Result<DecodedRaw> run(DecodeFunction decode, const ReadLimits& limits = {}) {
  const std::byte file[1] = {std::byte{7}};
  return decode_contained(file, limits, decode);
}

std::string message_of(const Result<DecodedRaw>& result) { return result ? "accepted" : result.error().message; }

TEST(DecoderProcess, SamplesArriveInOrder) {
  const auto raw = run(count_up);
  ASSERT_TRUE(raw);
  EXPECT_EQ(raw->samples.width(), 7);
  EXPECT_EQ(raw->samples.height(), 10);
  for (int i = 0; i < 70; ++i) EXPECT_EQ(raw->samples.data()[i], i);
}

TEST(DecoderProcess, ACrashBecomesAnErrorWithItsSignal) {
  const auto aborted = run([](Bytes, const ReadLimits&, DecodeSink&) { std::abort(); });
  ASSERT_FALSE(aborted);
  EXPECT_EQ(aborted.error().code, ErrorCode::malformed);
  EXPECT_EQ(aborted.error().message,
            "the decoder crashed on this file (signal 6): the file is damaged or the decoder has a fault");
  const auto segmentation = run([](Bytes, const ReadLimits&, DecodeSink&) { raise(SIGSEGV); });
  EXPECT_NE(message_of(segmentation).find("signal 11"), std::string::npos);
}

TEST(DecoderProcess, AHandlerOfThisProcessDoesNotHideTheCrash) {
  static std::atomic<int> handled{0};
  struct sigaction ours {
  }, before{};
  ours.sa_handler = [](int) { ++handled; };
  sigaction(SIGSEGV, &ours, &before);
  const auto result = run([](Bytes, const ReadLimits&, DecodeSink&) { raise(SIGSEGV); });
  sigaction(SIGSEGV, &before, nullptr);
  EXPECT_NE(message_of(result).find("signal 11"), std::string::npos);
  EXPECT_EQ(handled, 0);
}

TEST(DecoderProcess, AnExceptionAndAnEarlyExitBecomeErrors) {
  EXPECT_NE(
      message_of(run([](Bytes, const ReadLimits&, DecodeSink&) { throw std::runtime_error("x"); })).find("failed"),
      std::string::npos);
  EXPECT_NE(message_of(run([](Bytes, const ReadLimits&, DecodeSink&) { _exit(0); })).find("failed"), std::string::npos);
  EXPECT_NE(message_of(run([](Bytes, const ReadLimits&, DecodeSink&) { _exit(7); })).find("failed"), std::string::npos);
  EXPECT_NE(message_of(run([](Bytes, const ReadLimits&, DecodeSink&) {})).find("failed"), std::string::npos);
}

TEST(DecoderProcess, AnEndlessLoopIsStoppedAtTheTimeLimit) {
  const ReadLimits limits{.max_decode_cpu_s = 1};
  const auto start = std::chrono::steady_clock::now();
  const auto result = run(
      [](Bytes, const ReadLimits&, DecodeSink&) {
        volatile unsigned turns = 0;
        for (;;) turns = turns + 1;
      },
      limits);
  EXPECT_NE(message_of(result).find("time limit of 1 s"), std::string::npos) << message_of(result);
  EXPECT_LT(std::chrono::steady_clock::now() - start, std::chrono::seconds(20));
}

TEST(DecoderProcess, ADecoderThatWaitsForeverIsStoppedByTheClock) {
  const ReadLimits limits{.max_decode_cpu_s = 1};
  const auto result = run(
      [](Bytes, const ReadLimits&, DecodeSink&) {
        for (;;) pause();
      },
      limits);
  EXPECT_NE(message_of(result).find("time limit"), std::string::npos) << message_of(result);
}

TEST(DecoderProcess, RunningOutOfMemoryIsSaidAsSuch) {
  const auto result = run([](Bytes, const ReadLimits&, DecodeSink&) { throw std::bad_alloc(); });
  ASSERT_FALSE(result);
  EXPECT_EQ(result.error().code, ErrorCode::too_large);
}

TEST(DecoderProcess, ADecoderHungryForMemoryIsStoppedEarly) {
  if (!decoder_memory_is_limited()) GTEST_SKIP() << "a sanitizer needs the address space";
  const auto result = run(
      [](Bytes, const ReadLimits&, DecodeSink& sink) {
        constexpr std::size_t block = std::size_t{64} << 20;
        for (int i = 0; i < 64; ++i) {
          auto* taken = new volatile char[block];  // 4 GiB in all, of which only a page each is touched
          taken[0] = 1;
        }
        sink.finish(*header_of(10, 10));
      },
      {.max_pixels = 1'000'000});
  ASSERT_FALSE(result);
  EXPECT_EQ(result.error().code, ErrorCode::too_large) << message_of(result);
}

TEST(DecoderProcess, MoreSamplesThanTheLimitAllowsEndTheDecoder) {
  const ReadLimits limits{.max_pixels = 1000};
  const auto result = run(
      [](Bytes, const ReadLimits&, DecodeSink& sink) {
        const std::vector<std::uint16_t> row(1000);
        for (;;) sink.write_samples(row.data(), row.size());
      },
      limits);
  EXPECT_FALSE(result);
}

TEST(DecoderProcess, FiguresOfTheDecoderAreNotTrusted) {
  const auto impossible = [](Bytes, const ReadLimits&, DecodeSink& sink) { sink.finish(*header_of(-5, 10)); };
  EXPECT_NE(message_of(run(impossible)).find("impossible size of -5 x 10"), std::string::npos);
  const auto vast = [](Bytes, const ReadLimits&, DecodeSink& sink) { sink.finish(*header_of(65535, 65535)); };
  EXPECT_NE(message_of(run(vast)).find("impossible size"), std::string::npos);
  const auto channels = [](Bytes, const ReadLimits&, DecodeSink& sink) { sink.finish(*header_of(10, 10, 1000000)); };
  EXPECT_NE(message_of(run(channels)).find("impossible size"), std::string::npos);
  const auto empty = [](Bytes, const ReadLimits&, DecodeSink& sink) { sink.finish(*header_of(100, 100)); };
  EXPECT_NE(message_of(run(empty)).find("fewer samples"), std::string::npos);
  const auto unknown = [](Bytes, const ReadLimits&, DecodeSink& sink) {
    auto header = header_of(10, 10);
    header->outcome = static_cast<DecodeOutcome>(4711);
    sink.finish(*header);
  };
  EXPECT_NE(message_of(run(unknown)).find("failed"), std::string::npos);
}

TEST(DecoderProcess, TextsOfTheDecoderAreEndedAndPrintable) {
  const auto result = run([](Bytes, const ReadLimits&, DecodeSink& sink) {
    auto header = std::make_unique<DecodedHeader>();
    std::memset(header.get(), 'x', sizeof *header);
    header->outcome = DecodeOutcome::unsupported;
    header->reason[1] = '\n';
    sink.finish(*header);
  });
  ASSERT_FALSE(result);
  EXPECT_EQ(result.error().message.substr(0, 3), "x x");
  EXPECT_EQ(result.error().message.size(), sizeof(DecodedHeader::reason) - 1);
}

TEST(DecoderProcess, TheDecoderPrintsNothingAndHoldsNoFileOfOurs) {
  std::array<int, 2> ends{};
  ASSERT_EQ(pipe(ends.data()), 0);
  static int write_end = -1;
  write_end = ends[1];
  const auto result = run([](Bytes file, const ReadLimits& limits, DecodeSink& sink) {
    if (write(write_end, "x", 1) == 1) _exit(1);
    count_up(file, limits, sink);
  });
  EXPECT_TRUE(result) << message_of(result);
  close(ends[0]);
  close(ends[1]);
}

TEST(DecoderProcess, ManyThreadsCanDecodeAtOnce) {
  std::atomic<int> good{0};
  std::vector<std::thread> threads;
  threads.reserve(8);
  for (int t = 0; t < 8; ++t) {
    threads.emplace_back([&good] {
      for (int i = 0; i < 10; ++i) {
        const auto raw = run(count_up);
        if (raw && raw->samples.at(6, 9) == 69) ++good;
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(good, 80);
}

TEST(DecoderProcess, ChildrenIgnoredByTheProgramStillDeliver) {
  struct sigaction ignore {
  }, before{};
  ignore.sa_handler = SIG_IGN;
  sigaction(SIGCHLD, &ignore, &before);
  const auto raw = run(count_up);
  const auto crashed = run([](Bytes, const ReadLimits&, DecodeSink&) { std::abort(); });
  sigaction(SIGCHLD, &before, nullptr);
  EXPECT_TRUE(raw);
  EXPECT_FALSE(crashed);
}

TEST(DecoderProcess, NoChildIsLeftBehind) {
  run(count_up).value();
  EXPECT_EQ(waitpid(-1, nullptr, WNOHANG), -1);
  EXPECT_EQ(errno, ECHILD);
}

}  // namespace
}  // namespace lowlux::capture
