#include "tests/hard_cases/hard_case.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <cstdlib>
#include <fstream>
#include <utility>

#include "tests/support/only_target.h"

namespace lowlux::hard_cases {
namespace {

constexpr std::array<std::string_view, path_count> path_names{"reference", "draft", "standard", "high", "best", "SSSE3",
                                                              "SSE4",      "AVX2",  "AVX3",     "NEON", "file", "live"};

std::string_view name_of(Path path) { return path_names[static_cast<std::size_t>(path)]; }

std::int64_t target_of(Path set) {
  switch (set) {
    case Path::ssse3:
      return HWY_SSSE3;
    case Path::sse4:
      return HWY_SSE4;
    case Path::avx2:
      return HWY_AVX2;
    case Path::avx3:
      return HWY_AVX3;
    default:
      return HWY_NEON;
  }
}

std::string in_quotes(std::string_view text) {
  std::string out = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') out += '\\';
    out += c;
  }
  return out + '"';
}

/// As JSON has it; it knows no infinity.
std::string number(double value) {
  if (!std::isfinite(value)) return in_quotes(std::isnan(value) ? "not a number" : "infinite");
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "%.3g", value);
  return text.data();
}

}  // namespace

void HardCase::put(Path path, Cell cell) {
  auto& place = cells_[static_cast<std::size_t>(path)];
  EXPECT_FALSE(place) << about_.name << ": " << name_of(path) << " is there twice";
  place = std::move(cell);
}

HardCase& HardCase::on(Path path, const Bound& bound, const Measure& measure) {
  const std::array error{measure(Denormals::kept), measure(Denormals::flushed)};
  for (const double& e : error) {
    EXPECT_LE(e, bound.value) << about_.name << ", " << name_of(path) << " [" << about_.unit << "], denormals "
                              << (&e == error.data() ? "kept" : "flushed");
  }
  put(path, {error, bound.value, std::string(bound.reason), {}});
  return *this;
}

HardCase& HardCase::on_each_set(const Bound& bound, const Measure& measure) {
  const std::int64_t supported = hwy::SupportedTargets();
  for (const Path set : instruction_sets) {
    if ((supported & target_of(set)) == 0) {
      none(set, std::string("this processor lacks ").append(name_of(set)));
      continue;
    }
    const test::OnlyTarget only(target_of(set));
    on(set, bound, measure);
  }
  return *this;
}

HardCase& HardCase::none(Path path, std::string_view reason) {
  EXPECT_FALSE(reason.empty()) << about_.name;
  put(path, {{}, 0, {}, std::string(reason)});
  return *this;
}

HardCase& HardCase::none(std::span<const Path> paths, std::string_view reason) {
  for (const Path path : paths) none(path, reason);
  return *this;
}

std::string HardCase::line() const {
  std::string out = "{\"group\":" + in_quotes(about_.group) + ",\"case\":" + in_quotes(about_.name) +
                    ",\"oracle\":" + in_quotes(about_.oracle) + ",\"unit\":" + in_quotes(about_.unit) + ",\"cells\":{";
  for (int i = 0; i < path_count; ++i) {
    const auto& cell = cells_[i];
    if (!cell) continue;
    out += (out.back() == '{' ? "" : ",") + in_quotes(path_names[i]) + ":{";
    if (cell->reason.empty()) {
      out += "\"kept\":" + number(cell->error[0]) + ",\"flushed\":" + number(cell->error[1]) +
             ",\"bound\":" + number(cell->bound) + ",\"why\":" + in_quotes(cell->bound_reason) + "}";
    } else {
      out += "\"reason\":" + in_quotes(cell->reason) + "}";
    }
  }
  return out + "}}\n";
}

HardCase::~HardCase() {
  for (int i = 0; i < path_count; ++i) {
    EXPECT_TRUE(cells_[i]) << about_.name << ": " << path_names[i] << " is neither measured nor has a reason";
  }
  const char* const folder = std::getenv("LOWLUX_HARD_CASES");
  if (folder == nullptr) return;
  const std::string path = std::string(folder) + "/" + std::to_string(getpid()) + ".jsonl";
  std::ofstream file(path, std::ios::app);
  file << line() << std::flush;
  EXPECT_TRUE(file.good()) << path << " cannot be written";
}

}  // namespace lowlux::hard_cases
