// Single defects count: a few hot pixels in a large frame are found and repaired, whatever may be left out.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <optional>
#include <random>
#include <utility>
#include <variant>
#include <vector>

#include "isp/model/colour/colorimetry.h"
#include "isp/model/colour/colour_difference.h"
#include "isp/pipeline/develop.h"
#include "isp/pipeline/plan/plan_develop.h"
#include "isp/render/output_space.h"
#include "tests/pipeline/night_frames.h"
#include "tests/support/executors.h"
#include "tests/support/reference_cost.h"

namespace lowlux::isp::single_defects_test {
namespace {

using test::two_threads;

constexpr int width = 6000, height = 4000, seeds = 10, hot_pixels = 8;

/// A grey of 24 MP whose noise stays below a tolerance of 4.
const RawFrame& clean_frame() {
  static const RawFrame frame =
      test::night_frame({.read_noise_e = 2}, denoise_testing::flat(100, 200, 125), width, height);
  return frame;
}

struct HotPixel {
  Pixel at;
  std::uint16_t was_dn;
};

/// Adds eight hot pixels, apart from each other, of 600 to 3000 e-: 40 standard deviations and more.
std::vector<HotPixel> add_hot_pixels(RawFrame& frame, unsigned seed) {
  std::mt19937 engine(seed);
  std::uniform_int_distribution<int> column(2, width - 3), row(2, height - 3);
  std::uniform_real_distribution<double> log_excess_e(std::log(600.0), std::log(3000.0));
  std::vector<HotPixel> out;
  while (static_cast<int>(out.size()) < hot_pixels) {
    const Pixel at{column(engine), row(engine)};
    const auto is_near = [&](const HotPixel& other) {
      return std::max(std::abs(other.at.x - at.x), std::abs(other.at.y - at.y)) < 16;
    };
    if (std::ranges::any_of(out, is_near)) continue;
    std::uint16_t& code = frame.raw.dn.at(at.x, at.y);
    out.push_back({at, code});
    const double hot_dn = code + test::night_gain_dn_per_e * std::exp(log_excess_e(engine));
    code = static_cast<std::uint16_t>(std::lround(std::min(hot_dn, test::night_white_dn)));
  }
  return out;
}

void restore(RawFrame& frame, const std::vector<HotPixel>& pixels) {
  for (const HotPixel& pixel : pixels) frame.raw.dn.at(pixel.at.x, pixel.at.y) = pixel.was_dn;
}

RawFrame copy_of(const RawFrame& frame) {
  RawFrame out;
  out.raw.dn = frame.raw.dn.clone();
  out.raw.phase = frame.raw.phase;
  out.raw.active = frame.raw.active;
  out.raw.default_crop = frame.raw.default_crop;
  out.raw.black_tag = frame.raw.black_tag;
  out.raw.white_dn = frame.raw.white_dn;
  out.noise = frame.noise;
  out.colour = frame.colour;
  return out;
}

/// Judges single pixels of a finished image by their own colour.
class PixelJudge {
 public:
  explicit PixelJudge(const Encoded8& image) : image_(image) {}

  Lab lab(int x, int y) const {
    const std::uint8_t* const code = image_.codes.row(y) + 3 * x;
    Vector3 light{};
    for (std::size_t c = 0; c < 3; ++c) light[c] = decode_transfer(OutputSpace::srgb, code[c] / 255.0);
    return lab_of(xyz_of(to_xyz_ * light), white_);
  }
  double difference(const PixelJudge& other, const Pixel& at) const {
    return ciede2000(lab(at.x, at.y), other.lab(at.x, at.y));
  }
  /// Returns the root mean square CIEDE2000 between pixels 64 apart: what noise does to a pixel, twice over.
  double noise_delta_e() const {
    double sum = 0;
    int count = 0;
    for (int y = 100; y < 1000; y += 90) {
      for (int x = 100; x < 5000; x += 64, ++count) sum += std::pow(ciede2000(lab(x, y), lab(x + 64, y)), 2);
    }
    return std::sqrt(sum / count);
  }

 private:
  const Encoded8& image_;
  Matrix3 to_xyz_ = *inverse(*xyz_to_output(OutputSpace::linear_srgb));
  Xyz white_ = *xyz_of(output_white);
};

DevelopOptions planned(std::optional<double> tolerance, std::optional<double> budget_s = {}) {
  DevelopOptions options;
  options.denoise.mode = DenoiseChoice::Mode::automatic;
  options.effects.emplace().tolerance_delta_e = tolerance;
  options.effects->budget_s = budget_s;
  options.effects->cost = test::reference_cost();
  return options;
}

/// Returns the predicted time of the cheapest plan: within any tolerance it is chosen.
double cheapest_s(const RawFrame& frame) {
  return plan_develop(frame, planned(100, 10), two_threads)->effects->predicted_s.value();
}

void expect_all_found(const DevelopPlan& plan, const std::vector<HotPixel>& pixels, unsigned seed) {
  for (const HotPixel& pixel : pixels) {
    const bool found = std::ranges::find(plan.levels.defects, pixel.at) != plan.levels.defects.end();
    EXPECT_TRUE(found) << "seed " << seed << ", pixel " << pixel.at.x << ", " << pixel.at.y;
  }
}

// Six squares of 512 x 512 hold 6.6 % of this frame: a search of them alone misses all eight in 58 of 100 frames.
TEST(SingleDefects, NoneOfEightHotPixelsIn24MegapixelsIsLeft) {
  RawFrame frame = copy_of(clean_frame());
  const Result<Developed> clean = develop(frame, planned(4), two_threads);
  ASSERT_TRUE(clean);
  const PixelJudge truth(std::get<Encoded8>(clean->picture));
  const double noise = truth.noise_delta_e();
  double largest = 0;
  for (unsigned seed = 1; seed <= seeds; ++seed) {
    const auto pixels = add_hot_pixels(frame, seed);
    const Result<Developed> repaired = develop(frame, planned(4), two_threads);
    restore(frame, pixels);
    ASSERT_TRUE(repaired);
    expect_all_found(repaired->plan, pixels, seed);
    const PixelJudge judged(std::get<Encoded8>(repaired->picture));
    for (const HotPixel& pixel : pixels) largest = std::max(largest, truth.difference(judged, pixel.at));
  }
  std::printf("  of a hot pixel at most %.2f CIEDE2000 stays; noise %.2f\n", largest, noise);
  // A pixel and the mean of two that replaces it scatter like two pixels apart.
  EXPECT_LT(largest, 5 * noise);
}

TEST(SingleDefects, WithoutTheSearchTheyStay) {
  RawFrame frame = copy_of(clean_frame());
  DevelopOptions off = planned(4);
  off.find_defects = false;
  const Result<Developed> clean = develop(frame, off, two_threads);
  const auto pixels = add_hot_pixels(frame, 1);
  const Result<Developed> kept = develop(frame, off, two_threads);
  ASSERT_TRUE(clean && kept);
  EXPECT_TRUE(kept->plan.levels.defects.empty());
  const PixelJudge truth(std::get<Encoded8>(clean->picture)), left(std::get<Encoded8>(kept->picture));
  for (const HotPixel& pixel : pixels) EXPECT_GT(truth.difference(left, pixel.at), 20);
}

TEST(SingleDefects, NoToleranceAndNoBudgetLeavesThemOut) {
  RawFrame frame = copy_of(clean_frame());
  constexpr unsigned seed = 3;
  const auto pixels = add_hot_pixels(frame, seed);
  const double min_s = cheapest_s(frame);
  for (const DevelopOptions& options :
       {planned(100), planned(std::nullopt, 1.001 * min_s), planned(std::nullopt, 10), planned(50, 1)}) {
    const auto plan = plan_develop(frame, options, two_threads);
    ASSERT_TRUE(plan) << plan.error().message;
    expect_all_found(*plan, pixels, seed);
    const PlannedStep& step = *std::ranges::find(plan->effects->effects, "hot pixels", &PlannedStep::name);
    EXPECT_TRUE(step.used);
    EXPECT_EQ(step.left, 0);
  }
  EXPECT_FALSE(plan_develop(frame, planned(std::nullopt, 0.999 * min_s), two_threads)) << "a smaller budget is refused";
  DevelopOptions off = planned(std::nullopt, 1.001 * min_s);
  off.find_defects = false;
  EXPECT_TRUE(plan_develop(frame, off, two_threads)->levels.defects.empty());
}

// The stated size is that of the strongest pixel in the image. The prediction is for the mean of its surroundings, the
// image has its own noise, 7 to 10 % of the light of a pixel.
TEST(SingleDefects, TheirStatedSizeIsTheirContrastInTheImage) {
  RawFrame frame = test::night_frame({.read_noise_e = 2}, denoise_testing::flat(100, 200, 125), 1024, 768);
  for (const double excess_e : {600.0, 1500.0, 3000.0}) {
    for (const Pixel at : {Pixel{500, 400}, {501, 400}, {501, 401}}) {
      std::uint16_t& code = frame.raw.dn.at(at.x, at.y);
      const std::uint16_t was_dn = code;
      const double mean_e = at.x % 2 == 0 ? 100 : at.y % 2 == 0 ? 200 : 125;
      code = static_cast<std::uint16_t>(test::night_black_dn + test::night_gain_dn_per_e * (mean_e + excess_e));
      DevelopOptions options = planned(100);
      options.demosaic = DemosaicMethod::malvar;
      const auto plan = plan_develop(frame, options, two_threads);
      options.find_defects = false;
      const Result<Developed> kept = develop(frame, options, two_threads);
      code = was_dn;
      const Result<Developed> without = develop(frame, options, two_threads);
      ASSERT_TRUE(plan && kept && without);
      const PlannedStep& step = *std::ranges::find(plan->effects->effects, "hot pixels", &PlannedStep::name);
      const PixelJudge hot(std::get<Encoded8>(kept->picture)), cold(std::get<Encoded8>(without->picture));
      const double seen = hot.difference(cold, at);
      std::printf("  %.0f e- at %d, %d: predicted %.2f, seen %.2f\n", excess_e, at.x, at.y, step.size, seen);
      EXPECT_NEAR(step.size, seen, 0.2 * seen);
    }
  }
}

}  // namespace
}  // namespace lowlux::isp::single_defects_test
