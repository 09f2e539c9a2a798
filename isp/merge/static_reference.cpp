#include "isp/merge/static_reference.h"

#include <algorithm>
#include <cassert>
#include <utility>
#include <vector>

#include "isp/base/frame.h"
#include "isp/merge/mosaic_mean.h"

namespace lowlux::merge {
namespace {

constexpr double probable_false_alarm = 0.005;  // next to blocks that differ
constexpr int half_px = block_px / 2;
constexpr int max_brighter = block_px * block_px / 4, max_darker = 1;  // outliers of a block that are not an object

/// Returns 1 for the blocks of `certain`, and for those of `probable` that touch one of them directly or by others.
Plane<std::uint8_t> connected(const Plane<std::uint8_t>& certain, const Plane<std::uint8_t>& probable) {
  Plane<std::uint8_t> out = certain.clone();
  std::vector<std::pair<int, int>> open;
  for (int y = 0; y < out.height(); ++y) {
    for (int x = 0; x < out.width(); ++x) {
      if (out.at(x, y) != 0) open.emplace_back(x, y);
    }
  }
  while (!open.empty()) {
    const auto [x, y] = open.back();
    open.pop_back();
    for (int v = std::max(y - 1, 0); v <= std::min(y + 1, out.height() - 1); ++v) {
      for (int u = std::max(x - 1, 0); u <= std::min(x + 1, out.width() - 1); ++u) {
        if (out.at(u, v) != 0 || probable.at(u, v) == 0) continue;
        out.at(u, v) = 1;
        open.emplace_back(u, v);
      }
    }
  }
  return out;
}

/// Compares the reference frame with the mean of others.
class ReferenceTest {
 public:
  ReferenceTest(const Plane<float>& mean, int count, const Plane<float>& frame, const MosaicNoise& noise,
                Executor& executor)
      : mean_(mean),
        mean_noise_{noise.variance_e2, noise.fraction / count},
        frame_(frame),
        noise_(noise),
        executor_(executor) {}

  /// Sets 1 in `differs` for each block that overlaps one that differs, of a grid that begins at (x0, y0).
  /// @param tested  the frame; its outliers are set to NaN
  void mark(int x0, int y0, const ComparisonOptions& options, Plane<float>& tested,
            Plane<std::uint8_t>& differs) const {
    const int width = frame_.width() - x0, height = frame_.height() - y0;
    if (width <= 0 || height <= 0) return;
    const Comparison found = compare_mosaics(mean_.view().crop(x0, y0, width, height), mean_noise_,
                                             tested.view().crop(x0, y0, width, height), noise_, options, executor_);
    for (int row = 0; row < found.block_matches.height(); ++row) {
      for (int column = 0; column < found.block_matches.width(); ++column) {
        const Rect block{x0 + block_px * column, y0 + block_px * row, std::min(block_px, width - block_px * column),
                         std::min(block_px, height - block_px * row)};
        if (found.block_matches.at(column, row) == 0 || show_an_object(block, tested)) mark_overlapped(block, differs);
      }
    }
  }

 private:
  /// Returns whether the outliers of a block are not those of a cosmic ray or a satellite, which are brighter than the
  /// scene and few.
  bool show_an_object(const Rect& block, const Plane<float>& without_outliers) const {
    int brighter = 0, darker = 0;
    for (int y = block.y; y < block.y + block.height; ++y) {
      for (int x = block.x; x < block.x + block.width; ++x) {
        const float before = frame_.at(x, y), after = without_outliers.at(x, y);
        if (!(before == before) || after == after) continue;
        (before > mean_.at(x, y) ? brighter : darker) += 1;
      }
    }
    return brighter > max_brighter || darker > max_darker;
  }

  static void mark_overlapped(const Rect& area, Plane<std::uint8_t>& differs) {
    for (int y = area.y / block_px; y <= (area.y + area.height - 1) / block_px; ++y) {
      for (int x = area.x / block_px; x <= (area.x + area.width - 1) / block_px; ++x) differs.at(x, y) = 1;
    }
  }

  const Plane<float>& mean_;
  MosaicNoise mean_noise_;
  const Plane<float>& frame_;
  const MosaicNoise& noise_;
  Executor& executor_;
};

/// Returns whether a frame matches the mean in one block, by itself, its outliers included.
bool matches_in(const Rect& block, const Plane<float>& mean, const Plane<float>& frame,
                const MosaicComparer& comparer) {
  Plane<float> part(block.width, block.height);
  for (int y = 0; y < block.height; ++y) std::copy_n(frame.row(block.y + y) + block.x, block.width, part.row(y));
  InlineExecutor alone;
  const Comparison found =
      comparer.compare(mean.view().crop(block.x, block.y, block.width, block.height), part.view(), alone);
  return found.block_matches.at(0, 0) != 0;
}

/// Removes those of the single blocks in which more than half of all frames match the mean of the others.
void let_majority_decide(const Plane<float>& mean, const std::vector<Plane<float>>& others, const MosaicNoise& noise,
                         const ComparisonOptions& options, Plane<std::uint8_t>& is_single, Executor& executor) {
  const MosaicNoise mean_noise{noise.variance_e2, noise.fraction / static_cast<double>(others.size())};
  const MosaicComparer comparer(mean_noise, noise, {.block_false_alarm = options.block_false_alarm});
  for_each_index(executor, is_single.height(), [&](int row) {
    for (int column = 0; column < is_single.width(); ++column) {
      if (is_single.at(column, row) == 0) continue;
      const int x = block_px * column, y = block_px * row;
      const Rect block{x, y, std::min(block_px, mean.width() - x), std::min(block_px, mean.height() - y)};
      const auto matching = std::ranges::count_if(
          others, [&](const Plane<float>& other) { return matches_in(block, mean, other, comparer); });
      if (2 * matching > static_cast<std::ptrdiff_t>(others.size()) + 1) is_single.at(column, row) = 0;
    }
  });
}

Plane<std::uint8_t> no_blocks(const Plane<float>& mosaic) {
  Plane<std::uint8_t> out((mosaic.width() + block_px - 1) / block_px, (mosaic.height() + block_px - 1) / block_px);
  std::fill_n(out.data(), out.size(), std::uint8_t{0});
  return out;
}

}  // namespace

StaticReference make_static_reference(Plane<float> reference, std::vector<Plane<float>> others,
                                      const MosaicNoise& noise, const ComparisonOptions& options, Scene scene,
                                      Executor& executor) {
  assert(!others.empty());
  const auto count = static_cast<int>(others.size());
  Plane<float> first;
  if (scene == Scene::majority) first = others.front().clone();
  robust_mean(others, noise, executor);
  const Plane<float> mean = std::exchange(others.front(), std::move(first));
  if (scene == Scene::reference) others.clear();
  const ReferenceTest test(mean, count, reference, noise, executor);
  Plane<std::uint8_t> certain = no_blocks(reference), probable = no_blocks(reference);
  ComparisonOptions sensitive = options;
  sensitive.block_false_alarm = probable_false_alarm;
  Plane<float> tested;
  for (const auto& [x, y] : {std::pair{half_px, half_px}, {0, half_px}, {half_px, 0}, {0, 0}}) {
    tested = reference.clone();
    test.mark(x, y, sensitive, tested, probable);
    tested = reference.clone();
    test.mark(x, y, options, tested, certain);
  }
  const Plane<std::uint8_t> differs = connected(certain, probable);
  StaticReference out{.is_single = differs.clone()};
  if (scene == Scene::majority) let_majority_decide(mean, others, noise, options, out.is_single, executor);
  const float weight = 1 / static_cast<float>(count + 1);
  for_each_index(executor, reference.height(), [&](int y) {
    for (int x = 0; x < reference.width(); ++x) {
      const float other = mean.at(x, y), own = tested.at(x, y);
      if (out.is_single.at(x / block_px, y / block_px) != 0 || !(other == other)) continue;
      const bool is_part = own == own && differs.at(x / block_px, y / block_px) == 0;
      reference.at(x, y) = is_part ? other + weight * (own - other) : other;
    }
  });
  out.mosaic = std::move(reference);
  return out;
}

}  // namespace lowlux::merge
