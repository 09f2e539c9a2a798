#include "isp/merge/add_to_mean.h"

#include <algorithm>
#include <array>
#include <vector>

#include "isp/merge/placement.h"

namespace lowlux::merge {
namespace {

constexpr int sampled_rows = 16;  // of so many, two are measured

const float* row_of(PlaneView<const float> plane, int y) { return plane.data != nullptr ? plane.row(y) : nullptr; }

std::size_t colour_index(BayerPhase phase, int x, int y) { return static_cast<std::size_t>(colour_at(phase, x, y)); }

/// The weights of the drops of a frame for R, G and B.
struct DropWeights {
  std::array<float, 3> mean{1, 1, 1};
  std::array<double, 3> square{1, 1, 1};  // mean square, over the square of the mean
};

template <class MakeRows>
DropWeights drop_weights(const MakeRows& make_rows, BayerPhase phase, int width, int height, Executor& executor) {
  struct Sum {
    std::array<double, 3> weight{}, square{}, sites{};
  };
  std::vector<Sum> sums(static_cast<std::size_t>((height + sampled_rows - 1) / sampled_rows));
  for_each_index(executor, static_cast<int>(sums.size()), [&](int i) {
    DropRows rows = make_rows();
    for (int y = sampled_rows * i; y < std::min(sampled_rows * i + 2, height); ++y) {
      const DropRows::Row& row = rows.row(y);
      for (int x = 0; x < width; ++x) {
        if (!(row.weight[x] > 0)) continue;
        const std::size_t colour = colour_index(phase, x, y);
        const auto weight = static_cast<double>(row.weight[x]);
        sums[i].weight[colour] += weight;
        sums[i].square[colour] += weight * weight;
        sums[i].sites[colour] += 1;
      }
    }
  });
  DropWeights out;
  for (std::size_t c = 0; c < 3; ++c) {
    double weight = 0, square = 0, sites = 0;
    for (const Sum& sum : sums) {
      weight += sum.weight[c];
      square += sum.square[c];
      sites += sum.sites[c];
    }
    if (!(sites > 0)) continue;
    out.mean[c] = static_cast<float>(weight / sites);
    out.square[c] = square * sites / (weight * weight);
  }
  return out;
}

}  // namespace

void add_placed(PlaneView<const float> placed, const MeanPart& part, MosaicMean& mean, Executor& executor) {
  for_each_index(executor, placed.height, [&](int y) {
    mean.add_row(y, {.value = placed.row(y), .site_weight = row_of(part.site_weight, y)}, part.block_matches);
  });
}

std::array<double, 3> add_drops(PlaneView<const float> differences, BayerPhase phase, const Motion& motion,
                                const RgbView<const float>& prediction, double radius_px, const MeanPart& part,
                                MosaicMean& mean, Executor& executor) {
  const int width = differences.width;
  const auto make_rows = [&] { return DropRows(differences, phase, motion, prediction, radius_px); };
  const DropWeights weights = drop_weights(make_rows, phase, width, differences.height, executor);
  for_each_band(executor, differences.height, [&](RowBand band, int) {
    DropRows rows = make_rows();
    std::vector<float> weight(static_cast<std::size_t>(width));
    for (int y = band.first; y < band.last; ++y) {
      const DropRows::Row& row = rows.row(y);
      const float even = 1 / weights.mean[colour_index(phase, 0, y)], odd = 1 / weights.mean[colour_index(phase, 1, y)];
      for (int x = 0; x < width; ++x) weight[x] = row.weight[x] * (x % 2 == 0 ? even : odd);
      mean.add_row(y, {.value = row.value.data(), .weight = weight.data(), .site_weight = row_of(part.site_weight, y)},
                   part.block_matches);
    }
  });
  return weights.square;
}

void add_colour_drops(PlaneView<const float> differences, BayerPhase phase, const Motion& motion,
                      const RgbView<const float>& prediction, PlaneView<const std::uint8_t> block_matches,
                      ColourMean& mean, Executor& executor) {
  for_each_band(executor, differences.height, [&](RowBand band, int) {
    ColourDropRows rows(differences, phase, motion, prediction);
    for (int y = band.first; y < band.last; ++y) {
      const ColourDropRows::Row& row = rows.row(y);
      ColourRowSums sums;
      for (std::size_t c = 0; c < 3; ++c) {
        sums.value[c] = row.value[c].data();
        sums.weight[c] = row.weight[c].data();
      }
      mean.add_row(y, sums, block_matches);
    }
  });
}

}  // namespace lowlux::merge
