#include "isp/bench/nl_means.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <vector>

#include "isp/render/output_space.h"

namespace lowlux::isp {
namespace {

constexpr int last_step = 27;  // strength 2^(i / 3 - 1), up to 256
constexpr int octave = 3;
using Steps = std::array<int, 2>;  // of lightness, of colour
using Bytes = std::vector<std::uint8_t>;

double strength_at(int step) { return std::exp2(step / 3.0 - 1); }

NlMeansPicture picture_of(const Encoded8& codes) {
  // Only written where it is the place to go to.
  return {const_cast<std::uint8_t*>(codes.codes.data()), codes.width(), codes.height()};
}

/// Filtered planes, each run once.
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

  /// Mean squared difference of codes; infinite beyond the ends of the steps.
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

/// The best of all pairs of every second octave, whatever lies between.
Steps best_octaves(Search& search) {
  Steps best{0, 0};
  for (int lightness = 0; lightness <= last_step; lightness += 2 * octave) {
    for (int colour = 0; colour <= last_step; colour += 2 * octave) {
      if (search.error({lightness, colour}) < search.error(best)) best = {lightness, colour};
    }
  }
  return best;
}

/// Up or down by equal strides, in one and in the other, until none helps.
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

/// The middle of the picture.
Encoded8 part_of(const Encoded8& codes, int columns, int rows) {
  Encoded8 out{Plane<std::uint8_t>(3 * columns, rows)};
  const auto part =
      codes.codes.view().crop(3 * ((codes.width() - columns) / 2), (codes.height() - rows) / 2, 3 * columns, rows);
  for (int y = 0; y < rows; ++y) std::copy_n(part.row(y), 3 * columns, out.codes.row(y));
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
  const int columns = std::min(noisy.width(), search_columns), rows = std::min(noisy.height(), search_rows);
  RgbView<const float> middle = truth.encoded().view();
  for (auto& plane : middle) {
    plane = plane.crop((plane.width - columns) / 2, (plane.height - rows) / 2, columns, rows);
  }
  Search search(filter, part_of(noisy, columns, rows), middle);
  if (!search.works()) return {};
  return found(search, climbed(search, climbed(search, best_octaves(search), octave), 1));
}

}  // namespace lowlux::isp
