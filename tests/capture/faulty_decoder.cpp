// Decoders for tests, by name: faulty_decoder NAME [WORD], and behind them the arguments of decoder_program.h.
#include <unistd.h>

#include <csignal>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <memory>
#include <new>
#include <numeric>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "capture/decoder/decoder_program.h"

namespace lowlux::capture {
namespace {

using Bytes = std::span<const std::byte>;

std::string word_of_command;

void finish(int width, int height, int samples = 1, DecodeOutcome outcome = DecodeOutcome::decoded) {
  auto header = std::make_unique<DecodedHeader>();
  *header = {};
  header->outcome = outcome;
  header->raw_width = width;
  header->raw_height = height;
  header->samples = samples;
  DecodeSink(result_descriptor).finish(*header);
}

/// Width from the first byte of the file, ten rows, samples 0, 1, 2, ...
void count_up(Bytes file, const ReadLimits& /*limits*/, DecodeSink& sink) {
  const int width = std::to_integer<int>(file[0]);
  std::vector<std::uint16_t> row(width);
  for (int y = 0; y < 10; ++y) {
    std::iota(row.begin(), row.end(), static_cast<std::uint16_t>(y * width));
    sink.write_samples(row.data(), row.size());
  }
  finish(width, 10);
}

void loop_forever(Bytes /*file*/, const ReadLimits& /*limits*/, DecodeSink& /*sink*/) {
  volatile unsigned turns = 0;
  for (;;) turns = turns + 1;
}

void wait_forever(Bytes /*file*/, const ReadLimits& /*limits*/, DecodeSink& /*sink*/) {
  for (;;) pause();
}

void take_memory(Bytes /*file*/, const ReadLimits& /*limits*/, DecodeSink& /*sink*/) {
  constexpr std::size_t block = std::size_t{64} << 20;
  for (int i = 0; i < 64; ++i) {
    auto* taken = new volatile char[block];  // 4 GiB in all, of which only a page each is touched
    taken[0] = 1;
  }
  finish(10, 10);
}

void write_forever(Bytes /*file*/, const ReadLimits& /*limits*/, DecodeSink& sink) {
  const std::vector<std::uint16_t> row(1000);
  for (;;) sink.write_samples(row.data(), row.size());
}

void write_texts(Bytes /*file*/, const ReadLimits& /*limits*/, DecodeSink& sink) {
  auto header = std::make_unique<DecodedHeader>();
  std::memset(static_cast<void*>(header.get()), 'x', sizeof *header);
  header->outcome = DecodeOutcome::unsupported;
  header->reason[1] = '\n';
  sink.finish(*header);
}

/// Fails if it can write to the descriptor it is given.
void write_elsewhere(Bytes file, const ReadLimits& limits, DecodeSink& sink) {
  if (write(std::stoi(word_of_command), "x", 1) == 1) _exit(1);
  count_up(file, limits, sink);
}

void raise_signal(Bytes file, const ReadLimits& limits, DecodeSink& sink) {
  raise(std::stoi(word_of_command));
  count_up(file, limits, sink);
}

/// Fails if the signals of a terminal's programs reach it.
void need_own_group(Bytes file, const ReadLimits& limits, DecodeSink& sink) {
  if (getpgrp() != getpid()) _exit(1);
  count_up(file, limits, sink);
}

/// Takes the C library's lock for time zones, as LibRaw does.
void ask_the_time_zone(Bytes file, const ReadLimits& limits, DecodeSink& sink) {
  std::tm time{.tm_mday = 1, .tm_year = 100};
  std::mktime(&time);
  count_up(file, limits, sink);
}

struct Decoder {
  std::string_view name;
  DecodeFunction decode;
};

constexpr Decoder decoders[] = {
    {"count up", count_up},
    {"abort", [](Bytes, const ReadLimits&, DecodeSink&) { std::abort(); }},
    {"segmentation fault", [](Bytes, const ReadLimits&, DecodeSink&) { raise(SIGSEGV); }},
    {"processor time", [](Bytes, const ReadLimits&, DecodeSink&) { raise(SIGXCPU); }},
    {"killed", [](Bytes, const ReadLimits&, DecodeSink&) { raise(SIGKILL); }},
    {"exception", [](Bytes, const ReadLimits&, DecodeSink&) { throw std::runtime_error("x"); }},
    {"exit 0", [](Bytes, const ReadLimits&, DecodeSink&) { _exit(0); }},
    {"exit 7", [](Bytes, const ReadLimits&, DecodeSink&) { _exit(7); }},
    {"exit 127", [](Bytes, const ReadLimits&, DecodeSink&) { _exit(127); }},
    {"raise", raise_signal},
    {"own group", need_own_group},
    {"nothing", [](Bytes, const ReadLimits&, DecodeSink&) {}},
    {"loop", loop_forever},
    {"wait", wait_forever},
    {"bad_alloc", [](Bytes, const ReadLimits&, DecodeSink&) { throw std::bad_alloc(); }},
    {"memory", take_memory},
    {"many samples", write_forever},
    {"negative size", [](Bytes, const ReadLimits&, DecodeSink&) { finish(-5, 10); }},
    {"vast size", [](Bytes, const ReadLimits&, DecodeSink&) { finish(65535, 65535); }},
    {"many channels", [](Bytes, const ReadLimits&, DecodeSink&) { finish(10, 10, 1000000); }},
    {"no samples", [](Bytes, const ReadLimits&, DecodeSink&) { finish(100, 100); }},
    {"unknown outcome",
     [](Bytes, const ReadLimits&, DecodeSink&) { finish(10, 10, 1, static_cast<DecodeOutcome>(4711)); }},
    {"texts", write_texts},
    {"write elsewhere", write_elsewhere},
    {"time zone", ask_the_time_zone},
};

}  // namespace
}  // namespace lowlux::capture

int main(int count, char** arguments) {
  using namespace lowlux::capture;
  const std::span<char* const> all(arguments, static_cast<std::size_t>(count));
  if (all.size() < 3) return EXIT_FAILURE;
  word_of_command = all[2];
  if (all[1] == std::string_view("other version")) run_decoder(all.first(all.size() - 1), decoders[0].decode);
  for (const Decoder& decoder : decoders) {
    if (decoder.name == all[1]) run_decoder(all, decoder.decode);
  }
  return EXIT_FAILURE;
}
