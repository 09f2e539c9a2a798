#include "capture/decoder/decoder_process.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <csignal>
#include <ctime>
#include <string>
#include <thread>
#include <vector>

#include "capture/decoder/decoder_program.h"

namespace lowlux::capture {
namespace {

/// What becomes of a file of one byte, 7, under one of the decoders of faulty_decoder.cpp.
Result<DecodedRaw> run(const std::string& decoder, const ReadLimits& limits = {}, const std::string& word = "") {
  const std::byte file[1] = {std::byte{7}};
  return decode_contained(file, limits, {LOWLUX_FAULTY_DECODER, decoder, word});
}

std::string message_of(const Result<DecodedRaw>& result) { return result ? "accepted" : result.error().message; }

bool says(const Result<DecodedRaw>& result, const std::string& words) {
  return message_of(result).find(words) != std::string::npos;
}

TEST(DecoderProcess, SamplesArriveInOrder) {
  const auto raw = run("count up");
  ASSERT_TRUE(raw) << message_of(raw);
  EXPECT_EQ(raw->samples.width(), 7);
  EXPECT_EQ(raw->samples.height(), 10);
  for (int i = 0; i < 70; ++i) EXPECT_EQ(raw->samples.data()[i], i);
}

TEST(DecoderProcess, ACrashBecomesAnErrorWithItsSignal) {
  const auto aborted = run("abort");
  ASSERT_FALSE(aborted);
  EXPECT_EQ(aborted.error().code, ErrorCode::malformed);
  EXPECT_EQ(aborted.error().message,
            "the decoder crashed on this file (signal 6): the file is damaged or the decoder has a fault");
}

// A sanitizer has a handler of its own, which ends the program by exit.
TEST(DecoderProcess, AHandlerOfThisProcessDoesNotHideTheCrash) {
  static std::atomic<int> handled{0};
  struct sigaction ours {
  }, before{};
  ours.sa_handler = [](int) { ++handled; };
  sigaction(SIGSEGV, &ours, &before);
  const auto result = run("segmentation fault");
  sigaction(SIGSEGV, &before, nullptr);
  EXPECT_TRUE(says(result, decoder_memory_is_limited ? "signal 11" : "failed")) << message_of(result);
  EXPECT_EQ(handled, 0);
}

TEST(DecoderProcess, SignalsThatThisProcessBlocksOrIgnoresEndTheDecoder) {
  sigset_t all, before;
  sigfillset(&all);
  pthread_sigmask(SIG_SETMASK, &all, &before);
  struct sigaction ignore {
  }, handled{};
  ignore.sa_handler = SIG_IGN;
  sigaction(SIGXCPU, &ignore, &handled);
  const auto result = run("processor time", {.max_decode_cpu_s = 1});
  sigaction(SIGXCPU, &handled, nullptr);
  pthread_sigmask(SIG_SETMASK, &before, nullptr);
  EXPECT_TRUE(says(result, "stopped at its limit of processor time")) << message_of(result);
}

TEST(DecoderProcess, AnExceptionAndAnEarlyExitBecomeErrors) {
  for (const char* decoder : {"exception", "exit 0", "exit 7", "nothing"}) {
    EXPECT_TRUE(says(run(decoder), "failed")) << decoder;
  }
}

TEST(DecoderProcess, AnEndlessLoopIsStoppedAtTheTimeLimit) {
  EXPECT_EQ(message_of(run("processor time", {.max_decode_cpu_s = 1})),
            "the decoder was stopped at its limit of processor time, after 0 s: the file is damaged or far too large");
  // A busy computer may not give it that second within five by the clock.
  const auto result = run("loop", {.max_decode_cpu_s = 1});
  EXPECT_TRUE(says(result, "the decoder was stopped")) << message_of(result);
}

TEST(DecoderProcess, ADecoderThatWaitsForeverIsStoppedByTheClock) {
  const auto result = run("wait", {.max_decode_cpu_s = 1});
  EXPECT_TRUE(says(result, ", of which it used the processor for 0 s")) << message_of(result);
}

// The kernel ends by SIGKILL who takes the last of the memory: that is neither the time limit nor the file's fault.
TEST(DecoderProcess, AKilledDecoderIsNotReportedAsATimeLimitOrADamagedFile) {
  const auto result = run("killed");
  ASSERT_FALSE(result);
  EXPECT_EQ(result.error().code, ErrorCode::too_large);
  EXPECT_EQ(message_of(result).find("the decoder was killed after "), 0u) << message_of(result);
  EXPECT_TRUE(says(result, ": the system is short of memory"));
  EXPECT_FALSE(says(result, "limit") || says(result, "damaged"));
}

// What ends the programs of a terminal or a service is for the caller to decide on.
TEST(DecoderProcess, SignalsMeantForTheCallerLeaveTheDecoderAtWork) {
  for (const int number : {SIGINT, SIGTERM, SIGHUP, SIGQUIT}) {
    const auto result = run("raise", {}, std::to_string(number));
    EXPECT_TRUE(result) << number << ": " << message_of(result);
  }
  EXPECT_TRUE(run("own group")) << "a terminal's signals reach the decoder";
}

TEST(DecoderProcess, ADecoderThatCannotBeLoadedIsNoDamagedFile) {
  const auto result = run("exit 127");
  ASSERT_FALSE(result);
  EXPECT_EQ(result.error().code, ErrorCode::unreadable);
  EXPECT_TRUE(says(result, "cannot be loaded")) << message_of(result);
}

TEST(DecoderProcess, RunningOutOfMemoryIsSaidAsSuch) {
  const auto result = run("bad_alloc");
  ASSERT_FALSE(result);
  EXPECT_EQ(result.error().code, ErrorCode::too_large);
}

TEST(DecoderProcess, ADecoderHungryForMemoryIsStoppedEarly) {
  if (!decoder_memory_is_limited) GTEST_SKIP() << "a sanitizer needs the address space";
  const auto result = run("memory", {.max_pixels = 1'000'000});
  ASSERT_FALSE(result);
  EXPECT_EQ(result.error().code, ErrorCode::too_large) << message_of(result);
}

TEST(DecoderProcess, MoreSamplesThanTheLimitAllowsEndTheDecoder) {
  EXPECT_FALSE(run("many samples", {.max_pixels = 1000}));
}

TEST(DecoderProcess, FiguresOfTheDecoderAreNotTrusted) {
  EXPECT_TRUE(says(run("negative size"), "impossible size of -5 x 10"));
  EXPECT_TRUE(says(run("vast size"), "impossible size"));
  EXPECT_TRUE(says(run("many channels"), "impossible size"));
  EXPECT_TRUE(says(run("no samples"), "fewer samples"));
  EXPECT_TRUE(says(run("unknown outcome"), "failed"));
}

TEST(DecoderProcess, TextsOfTheDecoderAreEndedAndPrintable) {
  const auto result = run("texts");
  ASSERT_FALSE(result);
  EXPECT_EQ(result.error().message.substr(0, 3), "x x");
  EXPECT_EQ(result.error().message.size(), sizeof(DecodedHeader::reason) - 1);
}

TEST(DecoderProcess, TheDecoderHoldsNoFileOfOurs) {
  std::array<int, 2> ends{};
  ASSERT_EQ(pipe(ends.data()), 0);
  const int high = fcntl(ends[1], F_DUPFD, 100);  // none of the decoder's own, and not closed by exec
  const auto result = run("write elsewhere", {}, std::to_string(high));
  EXPECT_TRUE(result) << message_of(result);
  for (const int end : {ends[0], ends[1], high}) close(end);
}

TEST(DecoderProcess, AProcessWithoutStandardStreamsCanDecode) {
  const std::array<int, 3> kept{dup(0), dup(1), dup(2)};
  for (int standard = 0; standard < 3; ++standard) close(standard);
  const auto raw = run("count up");
  for (int standard = 0; standard < 3; ++standard) {
    dup2(kept[standard], standard);
    close(kept[standard]);
  }
  EXPECT_TRUE(raw) << message_of(raw);
}

TEST(DecoderProcess, AMissingDecoderAndOneOfAnotherVersionAreCalledThat) {
  const auto missing = decode_contained(std::as_bytes(std::span("x")), {}, {"/no/such/decoder"});
  ASSERT_FALSE(missing);
  EXPECT_EQ(missing.error().code, ErrorCode::unreadable);
  EXPECT_TRUE(says(missing, "the decoder /no/such/decoder cannot start: No such file"));
  EXPECT_TRUE(says(run("other version"), "the decoder is of another version of lowlux"))
      << message_of(run("other version"));
}

// A forked child would find the lock held for ever whenever a thread held it at the moment of the fork.
TEST(DecoderProcess, ALockThatAThreadHoldsIsNotHeldInTheDecoder) {
  std::atomic<bool> done{false};
  std::vector<std::thread> threads;
  threads.reserve(3);
  for (int t = 0; t < 3; ++t) {
    threads.emplace_back([&done] {
      std::tm time{};
      const std::time_t now = 0;
      while (!done) localtime_r(&now, &time);
    });
  }
  int good = 0;
  for (int i = 0; i < 30 && good == i; ++i) good += run("time zone", {.max_decode_cpu_s = 1}).has_value() ? 1 : 0;
  done = true;
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(good, 30);
}

TEST(DecoderProcess, ManyThreadsCanDecodeAtOnce) {
  std::atomic<int> good{0};
  std::vector<std::thread> threads;
  threads.reserve(8);
  for (int t = 0; t < 8; ++t) {
    threads.emplace_back([&good] {
      for (int i = 0; i < 10; ++i) {
        const auto raw = run("count up");
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
  const auto raw = run("count up");
  const auto crashed = run("abort");
  sigaction(SIGCHLD, &before, nullptr);
  EXPECT_TRUE(raw);
  EXPECT_FALSE(crashed);
}

TEST(DecoderProcess, NoChildIsLeftBehind) {
  run("count up").value();
  EXPECT_EQ(waitpid(-1, nullptr, WNOHANG), -1);
  EXPECT_EQ(errno, ECHILD);
}

}  // namespace
}  // namespace lowlux::capture
