// The stage's C functions with any settings, formats, parameters and frames: pictures in exactly sized memory, or an
// error that has a name. Then another stage that is called in any order, rightly and wrongly.
// Input: figures in the order they are asked for below; what is left after them is the frame, over and over, and once
// the first stage is done the figures of the second.
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "tests/fuzz/input.h"
#include "tests/fuzz/stage_calls.h"
#include "tests/fuzz/stage_draws.h"

namespace {

using namespace lowlux::test;

void check(int code) { require(code <= LOWLUX_STAGE_ADJUSTED && code > LOWLUX_STAGE_INTERNAL); }

void frame(lowlux_stage* stage, const lowlux_stage_input& in, const lowlux_stage_output& out, FuzzInput& bytes) {
  auto params = bytes.take<lowlux_stage_params>();
  params.size = sizeof params;
  params.valid &= LOWLUX_STAGE_HAS_ALL;
  const std::size_t stride = bytes.below(8) == 0 ? bytes.take<std::uint16_t>() : std::size_t{160};
  std::vector<std::uint8_t> codes(std::min<std::size_t>(stride * static_cast<std::size_t>(in.height), 1U << 20U));
  for (std::size_t i = 0; i < codes.size(); ++i) codes[i] = bytes.left > 0 ? bytes.data[i % bytes.left] : 0;
  const lowlux_stage_source source{codes.data(), codes.size(), stride, -1};
  const StagePlanes planes(out);
  lowlux_stage_result result{};
  result.size = sizeof result;
  lowlux_stage_statistics statistics{};
  statistics.size = sizeof statistics;
  check(lowlux_stage_process(stage, &source, &planes.picture, &params, &result, &statistics));
}

void frames_of_one_stream(FuzzInput& bytes) {
  lowlux_stage_settings settings{};
  settings.size = sizeof settings;
  settings.threads = 1 + bytes.below(2);
  settings.most_denoise = bytes.below(4);
  settings.temporal = bytes.below(2);
  settings.look = bytes.below(2);
  settings.tone = bytes.below(2);
  lowlux_stage* stage = nullptr;
  check(lowlux_stage_open(&settings, &stage, nullptr, 0));
  require(stage != nullptr);
  const lowlux_stage_input in = any_input(bytes);
  lowlux_stage_output out = any_output(bytes);
  const int configured = lowlux_stage_configure(stage, &in, &out);
  check(configured);
  const int frames = 1 + bytes.below(3);
  for (int i = 0; i < frames && configured >= 0; ++i) frame(stage, in, out, bytes);
  lowlux_stage_release(stage);
}

void functions_that_need_no_stage() {
  require(lowlux_stage_version() == LOWLUX_STAGE_VERSION && *lowlux_stage_last_error(nullptr) == '\0');
  require(lowlux_stage_reset(nullptr) == LOWLUX_STAGE_BAD_ARGUMENT);
  require(lowlux_stage_query(LOWLUX_STAGE_DRM, 0, 0, nullptr) == LOWLUX_STAGE_BAD_ARGUMENT);
  require(lowlux_stage_open(nullptr, nullptr, nullptr, 0) == LOWLUX_STAGE_BAD_ARGUMENT);
  require(lowlux_stage_configure(nullptr, nullptr, nullptr) == LOWLUX_STAGE_BAD_ARGUMENT);
  require(lowlux_stage_process(nullptr, nullptr, nullptr, nullptr, nullptr, nullptr) == LOWLUX_STAGE_BAD_ARGUMENT);
  lowlux_stage_release(nullptr);
}

}  // namespace

LOWLUX_FUZZ_TARGET(stage)(const std::uint8_t* data, std::size_t size) {
  FuzzInput bytes{data, size};
  functions_that_need_no_stage();
  frames_of_one_stream(bytes);
  if (bytes.left > 0) StageCalls(bytes).run();
  return 0;
}
