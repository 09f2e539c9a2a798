#include "isp/pipeline/merge/merge_context.h"

#include <algorithm>
#include <cstddef>
#include <limits>
#include <utility>

#include "isp/pipeline/merge/merge_budget.h"

namespace lowlux::isp {

Result<void> MergeContext::begin() {
  Result<FrameElectrons> read = loader.read_reference(out.reference);
  if (!read) return tl::make_unexpected(read.error());
  reference = *std::move(read);
  out.warnings = reference.warnings;
  out.saturation = reference.saturation;
  width = reference.signal_e.width();
  height = reference.signal_e.height();
  added = 0;
  out.frames.assign(static_cast<std::size_t>(count), {});
  reference_fraction = 1;
  return {};
}

std::vector<int> MergeContext::sampled_others() const {
  const int sampled = std::min(count, sampled_frames);
  std::vector<int> indices;
  for (int i = 0; i < sampled; ++i) {
    const int index = static_cast<int>((2LL * i + 1) * count / (2LL * sampled));
    if (index != out.reference) indices.push_back(index);
  }
  indices.resize(std::min<std::size_t>(indices.size(), static_cast<std::size_t>(sampled) - 1));
  return indices;
}

Result<double> MergeContext::stated_light() const {
  if (!loader.exposures_differ()) return 1.0;
  return loader.stated_light();
}

merge::Comparison MergeContext::compared(Plane<float>& mosaic, const merge::MosaicNoise& noise,
                                         const merge::ComparisonOptions& comparison, int index) {
  if (!compares()) return {};
  merge::Comparison found =
      merge::compare_mosaics(std::as_const(reference.signal_e).view(), {reference.variance_e2, reference_fraction},
                             mosaic.view(), noise, comparison, executor);
  FrameUse& use = out.frames[static_cast<std::size_t>(index)];
  use.used_fraction = found.matching_fraction;
  use.is_compared = true;
  use.outliers = found.outliers;
  use.mean_chi_square = found.mean_chi_square;
  clock.lap("comparison");
  return found;
}

void MergeContext::adopt_saturation() {
  const auto& shown = loader.shown_saturation();
  if (out.saturation || !shown) return;
  out.saturation = shown->level;
  for (std::size_t c = 0; c < 3; ++c) {
    reference.saturation_e[c] = std::min(reference.saturation_e[c], shown->charge_e[c]);
  }
}

void MergeContext::fill_unmatched(merge::MosaicMean& mean) {
  for_each_index(executor, height, [&](int y) {
    for (int x = 0; x < width; ++x) {
      if (mean.weight().at(x, y) > 0) reference.signal_e.at(x, y) = std::numeric_limits<float>::quiet_NaN();
    }
  });
  mean.add(std::as_const(reference.signal_e).view(), {}, executor);
}

void MergeContext::report_added() {
  ++added;
  if (progress) progress(static_cast<double>(added) / count);
}

}  // namespace lowlux::isp
