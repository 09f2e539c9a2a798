#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <string>
#include <vector>

#include "calib/dark/dark_fit.h"
#include "calib/picture/noise_line.h"
#include "calib/profile/profile_io.h"
#include "capture/file/dng_source.h"
#include "isp/output/dng/dng_writer.h"
#include "tests/properties/draws.h"
#include "tests/support/raw_frames.h"
#include "tests/support/scratch_directory.h"

namespace lowlux {
namespace {

using namespace properties;

RawFrame any_frame() {
  const auto layout =
      *rc::gen::element(SensorLayout::bayer, SensorLayout::bayer, SensorLayout::monochrome, SensorLayout::linear_rgb);
  const int width = size_between(22, 60), height = size_between(22, 60);
  RawFrame frame = test::plain_frame(width, height, layout, any_phase());
  if (layout == SensorLayout::bayer && *rc::gen::arbitrary<bool>()) {
    frame.raw.masked = {{0, 0, 4, height}};
    frame.raw.masked_is_stated = true;
  }
  frame.raw.info.orientation = static_cast<Orientation>(size_between(1, 8));
  return frame;
}

// 22 is the least that LibRaw opens; masked columns do not count.
RC_GTEST_PROP(DngProperty, WhatIsWrittenIsRead, ()) {
  RawFrame frame = any_frame();
  RawDn& raw = frame.raw;
  if (!raw.masked.empty()) {
    RC_PRE(raw.dn.width() >= 26);
    raw.active = {4, 0, raw.dn.width() - 4, raw.dn.height()};
    raw.default_crop = {0, 0, raw.active.width, raw.active.height};
  }
  const test::ScratchDirectory scratch;
  RC_ASSERT(isp::write_dng(frame, scratch.file("a.dng")).has_value());
  const auto read = capture::read_raw(scratch.file("a.dng"));
  RC_ASSERT(read.has_value());
  const RawDn& got = read->raw;
  RC_ASSERT(got.layout == raw.layout && got.active == raw.active && got.default_crop == raw.default_crop);
  RC_ASSERT(got.masked == raw.masked && got.info.orientation == raw.info.orientation);
  RC_ASSERT(raw.layout != SensorLayout::bayer || got.phase == raw.phase);
  RC_ASSERT(got.white_dn == raw.white_dn && got.black_tag->at(0, 0) == raw.black_tag->at(0, 0));
  RC_ASSERT(got.dn.width() == raw.dn.width() && got.dn.height() == raw.dn.height());
  RC_ASSERT(std::equal(got.dn.data(), got.dn.data() + got.dn.size(), raw.dn.data()));
}

double any_figure(double least, double most) {
  auto random = any_random();
  return std::uniform_real_distribution<double>(least, most)(random);
}

RC_GTEST_PROP(ProfileProperty, FiguresComeBackToTheLastDigit, ()) {
  CameraProfile profile{.make = "Maker", .model = "Model"};
  GainProfile gain;
  gain.gain_setting = "ISO 100";
  gain.sensor = SensorModel{.name = "Sensor"};
  gain.sensor->system_gain_dn_per_e = any_figure(0.01, 20);
  gain.sensor->read_noise_e = any_figure(0.1, 20);
  gain.sensor->full_well_e = any_figure(1000, 1e5);
  gain.sensor->bits = 14;
  gain.sensor->black_level_dn = any_figure(0, 1000);
  gain.sensor->white_level_dn = 16383;
  gain.sensor->prnu = any_figure(0, 0.05);
  gain.hot_pixels = {{size_between(0, 5000), size_between(0, 5000), any_figure(0.1, 1e4)}};
  profile.gains.push_back(gain);
  const auto text = calib::profile_text(profile);
  RC_ASSERT(text.has_value());
  const auto again = calib::parse_profile(*text);
  RC_ASSERT(again.has_value());
  const SensorModel& got = *again->gains[0].sensor;
  RC_ASSERT(got.system_gain_dn_per_e == gain.sensor->system_gain_dn_per_e);
  RC_ASSERT(got.read_noise_e == gain.sensor->read_noise_e && got.full_well_e == gain.sensor->full_well_e);
  RC_ASSERT(got.black_level_dn == gain.sensor->black_level_dn && got.prnu == gain.sensor->prnu);
  RC_ASSERT(again->gains[0].hot_pixels[0].x == gain.hot_pixels[0].x);
  RC_ASSERT(again->gains[0].hot_pixels[0].excess_e_per_s == gain.hot_pixels[0].excess_e_per_s);
}

RC_GTEST_PROP(NoiseLineProperty, PointsOnALineGiveThatLine, ()) {
  const double gain = any_figure(0.05, 10), offset = any_figure(0.1, 100);
  std::vector<calib::NoisePoint> points;
  for (int n = size_between(3, 30); n > 0; --n) {
    const double mean = 100.0 * n;
    points.push_back({mean, gain * mean + offset, 1000, {-1e9, 1e9}});
  }
  const auto line = calib::fit_noise_line(points);
  RC_ASSERT(line.has_value());
  RC_ASSERT(std::abs(line->gain_dn_per_e.value - gain) < 1e-6 * gain);  // relative: iterated to less
  RC_ASSERT(std::abs(line->offset_dn2.value - offset) < 1e-6 * (offset + 100 * gain));
}

RC_GTEST_PROP(LinearEstimatorsProperty, WithoutNoiseTheyGiveTheParameters, ()) {
  const int parameters = size_between(1, 4), rows = parameters + size_between(0, 6);
  auto random = any_random();
  std::uniform_real_distribution<double> value(-1, 1);
  calib::Design design(rows, std::vector<double>(parameters));
  std::vector<double> truth(parameters), weights(rows), seen(rows);
  for (double& t : truth) t = value(random);
  for (int i = 0; i < rows; ++i) {
    weights[i] = 1.5 + value(random);
    for (int k = 0; k < parameters; ++k) {
      design[i][k] = value(random) + (i == k ? 5 : 0);  // far from singular
      seen[i] += design[i][k] * truth[k];
    }
  }
  const auto estimators = calib::linear_estimators(design, weights);
  RC_ASSERT(estimators.has_value());
  for (int k = 0; k < parameters; ++k) {
    double found = 0;
    for (int i = 0; i < rows; ++i) found += (*estimators)[k][i] * seen[i];
    RC_ASSERT(std::abs(found - truth[k]) < 1e-9);
  }
}

}  // namespace
}  // namespace lowlux
