#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <limits>
#include <set>
#include <utility>
#include <vector>

#include "isp/base/executor.h"
#include "isp/raw/corrections.h"
#include "isp/raw/kernel/raw_to_rgb.h"
#include "isp/raw/measure/thumbnail.h"
#include "isp/raw/repair.h"
#include "isp/raw/to_linear.h"
#include "tests/properties/draws.h"

namespace lowlux::isp::raw_properties_test {
namespace {

using namespace properties;

constexpr float no_clip = std::numeric_limits<float>::infinity();
const RgbTransform as_camera{.clip = no_clip, .move_into_gamut = false};

SceneLinear camera_rgb(const Plane<float>& mosaic, BayerPhase phase) {
  SceneLinear out(mosaic.width(), mosaic.height());
  InlineExecutor one;
  RawToRgb(mosaic.width(), 1).linear(SignedMosaic{mosaic.view(), phase}, as_camera, out.view(), one);
  return out;
}

RC_GTEST_PROP(RawToRgbProperty, DemosaicingAMirroredMosaicMirrorsThePicture, ()) {
  const auto mosaic = any_plane(size_between(2, 40), size_between(2, 12), -0.2F, 1.2F);
  const BayerPhase phase = any_phase();
  const SceneLinear picture = camera_rgb(mosaic, phase);
  const SceneLinear other = camera_rgb(mirrored(mosaic), mirrored(phase, mosaic.width()));
  for (int c = 0; c < 3; ++c) {
    RC_ASSERT(largest_difference(mirrored(other.plane[c]), picture.plane[c]) < 2e-6);  // float sums in another order
  }
}

RC_GTEST_PROP(RawToRgbProperty, DemosaicingKeepsWhatWasMeasuredAndScalesWithIt, ()) {
  const auto mosaic = any_plane(size_between(2, 40), size_between(2, 12), -0.2F, 1.2F);
  const BayerPhase phase = any_phase();
  auto quadruple = mosaic.clone();
  for (std::size_t i = 0; i < quadruple.size(); ++i) quadruple.data()[i] *= 4;
  const SceneLinear picture = camera_rgb(mosaic, phase), brighter = camera_rgb(quadruple, phase);
  for (int y = 0; y < mosaic.height(); ++y) {
    for (int x = 0; x < mosaic.width(); ++x) {
      const auto own = static_cast<std::size_t>(colour_at(phase, x, y));
      RC_ASSERT(picture.plane[own].at(x, y) == mosaic.at(x, y));
      for (int c = 0; c < 3; ++c) RC_ASSERT(brighter.plane[c].at(x, y) == 4 * picture.plane[c].at(x, y));
    }
  }
}

RC_GTEST_PROP(RawToRgbProperty, AnythingBecomesFiniteAndAnyThreadsMakeTheSame, ()) {
  const auto mosaic = any_plane(size_between(2, 70), size_between(2, 40), -2, 2, 5);
  const BayerPhase phase = any_phase();
  const SceneLinear picture = camera_rgb(mosaic, phase);
  SceneLinear shared(mosaic.width(), mosaic.height());
  PoolExecutor three(3);
  RawToRgb(mosaic.width(), 3).linear(SignedMosaic{mosaic.view(), phase}, as_camera, shared.view(), three);
  for (int c = 0; c < 3; ++c) {
    RC_ASSERT(all_finite(picture.plane[c]));
    RC_ASSERT(largest_difference(picture.plane[c], shared.plane[c]) == 0);
  }
}

RawDn any_frame(int least, int most) {
  RawDn raw;
  raw.dn = any_codes(size_between(least, most), size_between(least, most), 4095);
  raw.phase = any_phase();
  raw.active = raw.default_crop = {0, 0, raw.dn.width(), raw.dn.height()};
  raw.white_dn = {4000, 4050, 4095};
  return raw;
}

BlackPoint any_black() {
  BlackPoint black;
  for (double& dn : black.pedestal_dn) dn = *rc::gen::inRange(0, 16 * 300) / 16.0;
  return black;
}

RC_GTEST_PROP(ToLinearProperty, EveryCodeComesBackFromItsFraction, ()) {
  const RawDn raw = any_frame(1, 40);
  const BlackPoint black = any_black();
  InlineExecutor one;
  const RawFraction fraction = to_fraction(raw, black, one);
  for (int y = 0; y < raw.dn.height(); ++y) {
    for (int x = 0; x < raw.dn.width(); ++x) {
      const double pedestal = black.pedestal_dn[site_of(x, y)];
      const double white = raw.white_dn[static_cast<std::size_t>(colour_at(raw.phase, x, y))];
      const double dn = fraction.value.at(x, y) * (white - pedestal) + pedestal;
      RC_ASSERT(std::abs(dn - raw.dn.at(x, y)) < 2e-3);  // DN: floats near 1 have steps of 6e-8, times 4095
    }
  }
}

RC_GTEST_PROP(ToLinearProperty, OnePassMakesTheSameElectronsAsTwo, ()) {
  const RawDn raw = any_frame(1, 40);
  const BlackPoint black = any_black();
  const PerSite<double> electrons{1000, 2000.5, 2001, 50000};
  InlineExecutor one;
  PoolExecutor three(3);
  const RawElectrons two_passes = to_electrons(to_fraction(raw, black, one), electrons, one);
  Plane<float> one_pass(raw.dn.width(), raw.dn.height());
  to_electrons(raw, black, electrons, one_pass.view(), three);
  RC_ASSERT(largest_difference(two_passes.value, one_pass) == 0);
}

std::vector<Pixel> any_pixels(int width, int height) {
  auto random = any_random();
  std::set<std::pair<int, int>> places;
  for (int n = size_between(0, 30); n > 0; --n) {
    const auto y = static_cast<int>(random() % static_cast<unsigned>(height));
    places.emplace(y, static_cast<int>(random() % static_cast<unsigned>(width)));
  }
  std::vector<Pixel> out;
  out.reserve(places.size());
  for (const auto& [y, x] : places) out.push_back({x, y});
  return out;
}

bool ascending(const std::vector<Pixel>& pixels) {
  return std::ranges::is_sorted(pixels, std::ranges::less_equal{}, [](const Pixel& p) { return std::pair(p.y, p.x); });
}

RC_GTEST_PROP(RepairProperty, OnlyDefectsChangeAndStayWithinTheirNeighbours, ()) {
  const auto before = any_plane(size_between(1, 24), size_between(1, 24), -1, 5);
  const auto defects = any_pixels(before.width(), before.height());
  const int step = size_between(1, 2);
  auto after = before.clone();
  repair(after.view(), defects, step);
  const auto is_defect = [&](int x, int y) { return std::ranges::find(defects, Pixel{x, y}) != defects.end(); };
  for (int y = 0; y < before.height(); ++y) {
    for (int x = 0; x < before.width(); ++x) {
      if (!is_defect(x, y)) {
        RC_ASSERT(after.at(x, y) == before.at(x, y));
        continue;
      }
      float low = no_clip, high = -no_clip;
      for (const auto& [dx, dy] : {std::pair(-step, 0), {step, 0}, {0, -step}, {0, step}}) {
        const bool inside = x + dx >= 0 && x + dx < before.width() && y + dy >= 0 && y + dy < before.height();
        if (!inside || is_defect(x + dx, y + dy)) continue;
        low = std::min(low, before.at(x + dx, y + dy));
        high = std::max(high, before.at(x + dx, y + dy));
      }
      if (low > high) {
        RC_ASSERT(after.at(x, y) == before.at(x, y));  // no sound neighbour
      } else {
        RC_ASSERT(after.at(x, y) >= low && after.at(x, y) <= high);
      }
    }
  }
}

RC_GTEST_PROP(RepairProperty, MergedListsAreTheUnionInOrder, ()) {
  const auto a = any_pixels(20, 20), b = any_pixels(20, 20);
  const auto both = merged(a, b);
  RC_ASSERT(ascending(both));
  const auto in = [](const std::vector<Pixel>& list, const Pixel& p) {
    return std::ranges::find(list, p) != list.end();
  };
  for (const Pixel& p : both) RC_ASSERT(in(a, p) || in(b, p));
  for (const auto* list : {&a, &b}) {
    for (const Pixel& p : *list) RC_ASSERT(in(both, p));
  }
}

RC_GTEST_PROP(RepairProperty, DefectsFoundAreInOrderAndNotAtTheBorder, ()) {
  const RawDn raw = any_frame(1, 40);
  InlineExecutor one;
  PoolExecutor three(3);
  const DefectNoise noise{.black_std_dn = 2, .shot_dn = *rc::gen::element(0.0, 0.5)};
  const BlackPoint black = any_black();
  const auto found = find_defects(raw, black, noise, one);
  RC_ASSERT(found == find_defects(raw, black, noise, three));
  RC_ASSERT(ascending(found));
  for (const Pixel& p : found) {
    RC_ASSERT(p.x >= 2 && p.y >= 2 && p.x < raw.dn.width() - 2 && p.y < raw.dn.height() - 2);
  }
}

RawCorrections any_gains(int width, int height) {
  auto random = any_random();
  std::uniform_real_distribution<double> unit(0, 1);
  GainMap map{.bottom = height, .right = width, .row_pitch = size_between(1, 2), .column_pitch = size_between(1, 2)};
  map.points_v = size_between(1, 4);
  map.points_h = size_between(1, 4);
  map.spacing_v = unit(random) + 0.1;
  map.spacing_h = unit(random) + 0.1;
  for (int i = 0; i < map.points_v * map.points_h; ++i) map.gain.push_back(static_cast<float>(0.5 + unit(random)));
  RawCorrections out;
  out.gain_maps.push_back(std::move(map));
  out.radial_gains.push_back({{unit(random), -0.1, 0, 0, 0}, unit(random), unit(random)});
  return out;
}

RC_GTEST_PROP(CorrectionsProperty, GainsMultiplyAndNothingElse, ()) {
  auto values = any_plane(size_between(1, 30), size_between(1, 30), -1, 5);
  const auto gains = any_gains(values.width(), values.height());
  Plane<float> ones(values.width(), values.height());
  std::fill_n(ones.data(), ones.size(), 1.0F);
  const auto before = values.clone();
  PoolExecutor three(3);
  apply_gains(gains, values.view(), three);
  apply_gains(gains, ones.view(), three);
  for (std::size_t i = 0; i < ones.size(); ++i) {
    // Up to 5 times 1.5 times 2, in floats, rounded twice.
    RC_ASSERT(std::abs(values.data()[i] - ones.data()[i] * before.data()[i]) < 4e-6F);
    RC_ASSERT(ones.data()[i] > 0);
  }
}

RC_GTEST_PROP(ThumbnailProperty, OfAnEvenFrameIsThatLightEverywhere, ()) {
  RawFrame frame;
  frame.raw = any_frame(2, 300);
  const int dn = *rc::gen::inRange(300, 4000);
  std::fill_n(frame.raw.dn.data(), frame.raw.dn.size(), static_cast<std::uint16_t>(dn));
  const BlackPoint black;
  ThumbnailSums sums(frame.raw);
  for (int y = 0; y < frame.raw.dn.height(); ++y) sums.add_row(frame.raw.dn.row(y), y);
  Thumbnail out;
  sums.make(frame, black, out);
  for (std::size_t c = 0; c < 3; ++c) {
    for (std::size_t i = 0; i < out.mean.plane[c].size(); ++i) {
      RC_ASSERT(std::abs(out.mean.plane[c].data()[i] - dn / frame.raw.white_dn[c]) < 1e-6);  // a float near 1
    }
  }
}

}  // namespace
}  // namespace lowlux::isp::raw_properties_test
