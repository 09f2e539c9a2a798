#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "tests/support/float_mode.h"

/// The matrix of hard cases: a row for each, a column for each way a frame may go. scripts/hard-cases makes a page of
/// what these tests record.
namespace lowlux::hard_cases {

using test::Denormals;
using test::in_mode;

/// A column. The sets are those of vector instructions, by Highway's names.
enum class Path : std::uint8_t {
  reference,  // plain double, or a model, which has no other
  draft,      // the four levels of noise reduction
  standard,
  high,
  best,
  ssse3,
  sse4,
  avx2,
  avx3,
  neon,
  file,  // the pipeline as `lowlux develop` uses it
  live   // LivePipeline
};
inline constexpr int path_count = 12;

inline constexpr std::array levels{Path::draft, Path::standard, Path::high, Path::best};
inline constexpr std::array instruction_sets{Path::ssse3, Path::sse4, Path::avx2, Path::avx3, Path::neon};
inline constexpr std::array pipelines{Path::file, Path::live};

/// What a row says of itself.
struct About {
  std::string_view group;   // the table it is in
  std::string_view name;    // what is hard
  std::string_view oracle;  // what results are compared with, and where the bound comes from
  std::string_view unit;    // of errors and bounds
};

/// What an error is held to, in the row's unit. Where the bound is more than ten times the error, the page must show a
/// reason.
struct Bound {
  constexpr Bound(double bound, std::string_view why = {}) : value(bound), reason(why) {}

  double value;
  std::string_view reason;
};

/// The error of one path, in one mode.
using Measure = std::function<double(Denormals mode)>;

/// One row. Every path is measured or has a reason when the object goes: else the test fails. So it does where an error
/// is above its bound or not a number. With LOWLUX_HARD_CASES set the row is added to a file in the folder it names.
class HardCase {
 public:
  explicit HardCase(const About& about) : about_(about) {}
  ~HardCase();
  HardCase(const HardCase&) = delete;
  HardCase& operator=(const HardCase&) = delete;

  /// Measures a path, denormals kept and flushed.
  HardCase& on(Path path, const Bound& bound, const Measure& measure);
  /// The same with each instruction set the processor has, and no other; those it lacks have that for a reason.
  HardCase& on_each_set(const Bound& bound, const Measure& measure);
  /// Why a path has nothing to do with the case.
  HardCase& none(Path path, std::string_view reason);
  HardCase& none(std::span<const Path> paths, std::string_view reason);

 private:
  struct Cell {
    std::array<double, 2> error{};  // denormals kept, flushed
    double bound = 0;
    std::string bound_reason;
    std::string reason;  // empty: measured
  };
  void put(Path path, Cell cell);
  std::string line() const;

  About about_;
  std::array<std::optional<Cell>, path_count> cells_;
};

/// The larger of two errors; one that is not a number stays.
inline void keep_worst(double& worst, double error) {
  if (!std::isnan(worst) && !(error <= worst)) worst = error;
}

/// Reasons that several rows share.
inline constexpr std::string_view no_image = "a function of single values, not of images";
inline constexpr std::string_view not_denoised = "nothing to denoise";
inline constexpr std::string_view scalar_code = "no vector code";

/// Reasons of bounds. Errors of rounding differ among processors: scripts/hard-cases holds them to their bounds alone.
inline constexpr std::string_view rounding = "rounding";
inline constexpr std::string_view any_draw = "the bound holds for any draw of the noise: this draw is near the mean";

}  // namespace lowlux::hard_cases
