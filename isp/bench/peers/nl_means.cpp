#include "isp/bench/peers/nl_means.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <utility>
#include <vector>

#include "isp/render/output_space.h"

namespace lowlux::isp {
namespace {

constexpr int last_step = 27;  // strength 2^(i / 3 - 1), up to 256
constexpr int octave = 3;
using Steps = std::array<int, 2>;  // step of lightness, step of colour
using Bytes = std::vector<std::uint8_t>;

double strength_at(int step) { return std::exp2(step / 3.0 - 1); }

NlMeansPicture picture_of(const Encoded8& codes) {
  // The codes are written only where they are the destination.
  return {const_cast<std::uint8_t*>(codes.codes.data()), codes.width(), codes.height()};
}

/// Holds filtered planes, each computed once.
class Search {
 public:
  Search(const NlMeans& filter, const Encoded8& noisy, const RgbView<const float>& truth)
      : filter_(filter), truth_(truth), joined_{Plane<std::uint8_t>(noisy.codes.width(), noisy.codes.height())} {
    const std::size_t pixels = static_cast<std::size_t>(noisy.width()) * static_cast<std::size_t>(noisy.height());
    plane_[0].resize(pixels);
    plane_[1].resize(2 * pixels);
    works_ = filter.split(picture_of(noisy), plane_[0].data(), plane_[1].data());
  }

  bool works() const { return works_; }
  int runs() const { return static_cast<int>(filtered_[0].size() + filtered_[1].size()); }

  /// Returns the mean squared difference of codes; infinite beyond the ends of the steps.
  double error(const Steps& step) {
    for (const int s : step) {
      if (s < 0 || s > last_step) return INFINITY;
    }
    const auto known = errors_.find(step);
    if (known != errors_.end()) return known->second;
    const double error = measured(step);
    errors_.emplace(step, error);
    return error;
  }

 private:
  double measured(const Steps& step) {
    const Bytes& lightness = filtered(0, step[0]);
    const Bytes& colour = filtered(1, step[1]);
    works_ = works_ && filter_.join(lightness.data(), colour.data(), picture_of(joined_));
    if (!works_) return INFINITY;
    double sum = 0;
    for (int y = 0; y < truth_[0].height; ++y) {
      const std::uint8_t* const codes = joined_.codes.row(y);
      for (std::size_t c = 0; c < 3; ++c) {
        const float* const expected = truth_[c].row(y);
        for (int x = 0; x < truth_[0].width; ++x) {
          const double difference = codes[3 * x + static_cast<int>(c)] / 255.0 - expected[x];
          sum += difference * difference;
        }
      }
    }
    return sum / (3.0 * truth_[0].width * truth_[0].height);
  }

  const Bytes& filtered(std::size_t which, int step) {
    auto [at, fresh] = filtered_[which].try_emplace(step);
    if (fresh) {
      at->second.resize(plane_[which].size());
      works_ = works_ && filter_.filter(plane_[which].data(), at->second.data(), truth_[0].width, truth_[0].height,
                                        static_cast<int>(which) + 1, strength_at(step));
    }
    return at->second;
  }

  const NlMeans& filter_;
  RgbView<const float> truth_;
  bool works_ = false;
  Encoded8 joined_;
  std::array<Bytes, 2> plane_;  // lightness; colour
  std::array<std::map<int, Bytes>, 2> filtered_;
  std::map<Steps, double> errors_;
};

/// Returns the best of all pairs of every second octave.
Steps best_octaves(Search& search) {
  Steps best{0, 0};
  for (int lightness = 0; lightness <= last_step; lightness += 2 * octave) {
    for (int colour = 0; colour <= last_step; colour += 2 * octave) {
      if (search.error({lightness, colour}) < search.error(best)) best = {lightness, colour};
    }
  }
  return best;
}

/// Climbs up or down by equal strides, in each strength in turn, until no step improves the result.
Steps climbed(Search& search, Steps at, int stride) {
  for (bool moved = true; moved;) {
    moved = false;
    for (std::size_t which = 0; which < 2; ++which) {
      for (const int direction : {-stride, stride}) {
        for (Steps next = at;; at = next, moved = true) {
          next[which] += direction;
          if (!(search.error(next) < search.error(at))) break;
        }
      }
    }
  }
  return at;
}

StrengthSearch found(Search& search, const Steps& at) {
  const double error = search.error(at);
  if (!search.works()) return {};
  return {{strength_at(at[0]), strength_at(at[1])}, -10 * std::log10(error), search.runs()};
}

constexpr int tiles_across = 4, tiles_down = 3;
constexpr int tile_columns = search_columns / tiles_across, tile_rows = search_rows / tiles_down;

/// Returns tiles of a plane of `samples` for each pixel, spread from corner to corner of the image, next to each other.
template <class T>
Plane<T> spread_tiles(const Plane<T>& plane, int samples) {
  Plane<T> out(samples * search_columns, search_rows);
  const int columns = plane.width() / samples - tile_columns, rows = plane.height() - tile_rows;
  for (int tile = 0; tile < tiles_across * tiles_down; ++tile) {
    const int across = tile % tiles_across, down = tile / tiles_across;
    const int x = columns * across / (tiles_across - 1), y = rows * down / (tiles_down - 1);
    for (int row = 0; row < tile_rows; ++row) {
      std::copy_n(plane.row(y + row) + samples * x, samples * tile_columns,
                  out.row(tile_rows * down + row) + samples * tile_columns * across);
    }
  }
  return out;
}

}  // namespace

Encoded8 codes_of(const RgbView<const float>& display) {
  Encoded8 out{Plane<std::uint8_t>(3 * display[0].width, display[0].height)};
  for (int y = 0; y < out.height(); ++y) {
    for (int x = 0; x < out.width(); ++x) {
      for (std::size_t c = 0; c < 3; ++c) {
        const double value = std::clamp(static_cast<double>(display[c].at(x, y)), 0.0, 1.0);
        out.codes.at(3 * x + static_cast<int>(c), y) =
            static_cast<std::uint8_t>(std::lround(255 * encode_transfer(OutputSpace::srgb, value)));
      }
    }
  }
  return out;
}

Encoded8 nl_means_input(const RenderedPicture& picture) { return codes_of(picture.light.view()); }

SceneLinear linear_of(const Encoded8& codes) {
  std::array<float, 256> linear{};
  for (std::size_t i = 0; i < linear.size(); ++i) {
    linear[i] = static_cast<float>(decode_transfer(OutputSpace::srgb, static_cast<double>(i) / 255));
  }
  SceneLinear out(codes.width(), codes.height());
  for (int y = 0; y < codes.height(); ++y) {
    for (int x = 0; x < codes.width(); ++x) {
      for (std::size_t c = 0; c < 3; ++c) {
        out.plane[c].at(x, y) = linear[codes.codes.at(3 * x + static_cast<int>(c), y)];
      }
    }
  }
  return out;
}

StrengthSearch search_strength(const NlMeans& filter, const Encoded8& noisy, const PictureTruth& truth) {
  const auto search_in = [&filter](const Encoded8& codes, const RgbView<const float>& expected) {
    Search search(filter, codes, expected);
    if (!search.works()) return StrengthSearch{};
    return found(search, climbed(search, climbed(search, best_octaves(search), octave), 1));
  };
  if (noisy.width() < search_columns || noisy.height() < search_rows) return search_in(noisy, truth.encoded().view());
  SceneLinear expected;
  for (std::size_t c = 0; c < 3; ++c) expected.plane[c] = spread_tiles(truth.encoded().plane[c], 1);
  return search_in({spread_tiles(noisy.codes, 3)}, std::as_const(expected).view());
}

}  // namespace lowlux::isp
