#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "isp/base/executor.h"
#include "isp/bench/accuracy_time.h"
#include "isp/bench/stages/developing_stages.h"
#include "isp/metrics/picture_metrics.h"
#include "isp/render/output_space.h"
#include "isp/render/retarget/retarget.h"
#include "isp/render/retarget/retarget_rows.h"
#include "isp/render/retarget/retarget_table.h"
#include "isp/reproduce/retargeting_scores.h"

namespace lowlux::isp {
namespace {

constexpr double display_cd_m2 = 2;
constexpr std::array methods{RetargetMethod::constrained, RetargetMethod::shin, RetargetMethod::wanat};
constexpr std::array table_levels{17, 33, 65};
constexpr std::size_t quick_tables = 2;
constexpr double largest_code = 65535;
constexpr AccuracyTiming timing{.rounds = 5, .min_s = 1e-3};

/// Returns the colours of all images as codes of 16 bits.
std::vector<std::uint16_t> codes_of(const std::vector<PictureColours>& pictures) {
  std::vector<std::uint16_t> out;
  std::size_t colours = 0;
  for (const PictureColours& picture : pictures) colours += picture.codes.size();
  out.reserve(3 * colours);
  for (const PictureColours& picture : pictures) {
    for (const Vector3& code : picture.codes) {
      for (const double v : code) out.push_back(static_cast<std::uint16_t>(std::lround(largest_code * v)));
    }
  }
  return out;
}

Lab lab_of_code(const Vector3& code) {
  static const Matrix3 to_xyz = rgb_to_xyz(primaries_rec709).value();  // cannot fail for constants
  static const Xyz white = xyz_of(to_xyz * Vector3{1, 1, 1});
  Vector3 light{};
  for (std::size_t c = 0; c < 3; ++c) light[c] = decode_transfer(OutputSpace::srgb, code[c]);
  return lab_of(xyz_of(to_xyz * light), white);
}

Vector3 code_at(const std::vector<std::uint16_t>& codes, std::size_t pixel) {
  return {codes[3 * pixel] / largest_code, codes[3 * pixel + 1] / largest_code, codes[3 * pixel + 2] / largest_code};
}

std::vector<Lab> lab_of_codes(const std::vector<std::uint16_t>& codes) {
  std::vector<Lab> out;
  out.reserve(codes.size() / 3);
  for (std::size_t i = 0; i < codes.size() / 3; ++i) out.push_back(lab_of_code(code_at(codes, i)));
  return out;
}

void map_each(const CodeMap& map, const std::vector<std::uint16_t>& codes, std::vector<Vector3>& out) {
  for (std::size_t i = 0; i < out.size(); ++i) out[i] = map(code_at(codes, i));
}

/// Colours, and memory for the results.
struct Work {
  std::vector<std::uint16_t> codes;
  std::vector<std::uint16_t> shown;
  std::vector<Vector3> exact;
};

Result<std::vector<AccuracyRow>> rows_of(RetargetMethod method, Work& work, std::span<const int> levels,
                                         Executor& executor, std::vector<std::string>& remarks) {
  const auto map =
      retargeting({.method = method, .source_cd_m2 = retargeting_source_cd_m2, .display_cd_m2 = display_cd_m2});
  if (!map) return tl::make_unexpected(map.error());
  const CodeMap code_map = [&map](const Vector3& code) { return (*map)(code).code; };
  const auto pixels = static_cast<int>(work.exact.size());
  const auto solve = [&] { map_each(code_map, work.codes, work.exact); };
  solve();
  std::vector<Lab> expected;
  expected.reserve(work.exact.size());
  for (const Vector3& code : work.exact) expected.push_back(lab_of_code(code));
  AccuracyGroup group{fmt::format("{}, {:g} to {:g} cd/m2", name_of(method), retargeting_source_cd_m2, display_cd_m2),
                      "mean CIEDE2000 against exact",
                      {}};
  std::vector<RetargetTable> tables;
  tables.reserve(levels.size());
  std::string made = group.name + ": tables made in";
  for (const int count : levels) {
    const auto start = std::chrono::steady_clock::now();
    const RetargetTable& table = tables.emplace_back(tabulated(code_map, count, executor));
    const std::chrono::duration<double> took = std::chrono::steady_clock::now() - start;
    made += fmt::format(" {:.2f}", took.count());
    const auto look_up = [&work, &table, pixels] { apply(table, work.codes.data(), pixels, work.shown.data()); };
    look_up();
    const ColourDifference error = difference_of(lab_of_codes(work.shown), expected);
    group.levels.push_back({fmt::format("table of {}", count), error.mean, look_up, 1e-6 * pixels, error.largest});
  }
  remarks.push_back(made + fmt::format(" s by {} threads", executor.width()));
  group.levels.push_back({"exact", 0, solve, 1e-6 * pixels, 0});
  return measure(group, timing);
}

}  // namespace

Result<BenchOutcome> run_retarget_bench(const BenchOptions& options) {
  PoolExecutor executor(options.threads);
  const bool quick = options.quick;
  const auto pictures = retargeting_pictures(
      options.pictures_folder, {.crop_px = quick ? 96 : 0, .colours = quick ? std::size_t{400} : std::size_t{2500}},
      executor);
  if (!pictures) return tl::make_unexpected(pictures.error());
  Work work{codes_of(*pictures), {}, {}};
  work.shown.resize(work.codes.size());
  work.exact.resize(work.codes.size() / 3);
  const auto levels = std::span(table_levels).first(quick ? quick_tables : table_levels.size());
  std::vector<AccuracyRow> rows;
  std::vector<std::string> remarks;
  for (const RetargetMethod method : methods) {
    const auto more = rows_of(method, work, levels, executor, remarks);
    if (!more) return tl::make_unexpected(more.error());
    rows.insert(rows.end(), more->begin(), more->end());
    options.advance(1 / static_cast<double>(methods.size()), "retargeting: " + std::string(name_of(method)));
  }
  BenchOutcome out = accuracy_outcome("retarget", rows, timing, 1);
  out.remarks.push_back(
      fmt::format("{} colours from all {} images{}, sRGB codes of 16 bits; CIEDE2000 of codes as sRGB under D65",
                  work.exact.size(), pictures->size(), quick ? ", quick: of the central 96 x 96 pixels" : ""));
  out.remarks.insert(out.remarks.end(), remarks.begin(), remarks.end());
  return out;
}

}  // namespace lowlux::isp
