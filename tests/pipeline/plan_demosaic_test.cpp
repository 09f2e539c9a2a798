#include "isp/pipeline/plan/plan_demosaic.h"

#include <gtest/gtest.h>

#include <cmath>

#include "isp/pipeline/develop.h"
#include "isp/pipeline/plan/plan_develop.h"
#include "tests/pipeline/night_frames.h"
#include "tests/support/executors.h"

namespace lowlux::isp {
namespace {

using test::two_threads;

RawFrame flat_frame(double green_e) {
  return test::night_frame({}, denoise_testing::flat(green_e / 2, green_e, green_e / 1.5), 160, 128);
}

DemosaicPlan decided(const RawFrame& frame, const DevelopOptions& options) {
  const Result<DevelopPlan> plan = plan_develop(frame, options, two_threads);
  EXPECT_TRUE(plan) << plan.error().message;
  return plan->demosaic;
}

TEST(PlanDemosaic, ChoosesByLightAndNoiseReduction) {
  DevelopOptions noisy, reduced;
  reduced.denoise = {.mode = DenoiseChoice::Mode::level, .level = denoise::Level::draft};
  const auto method = [](double green_e, const DevelopOptions& options) {
    return decided(flat_frame(green_e), options).demosaic.method;
  };
  for (const double factor : {0.1, 0.8}) {  // below each limit
    EXPECT_EQ(method(factor * 50, noisy), DemosaicMethod::malvar) << factor;
    EXPECT_EQ(method(factor * 100, reduced), DemosaicMethod::residual_median) << factor;
  }
  EXPECT_EQ(method(1.2 * 50, noisy), DemosaicMethod::residual_median);
  EXPECT_EQ(method(1.2 * 100, noisy), DemosaicMethod::residual);
  EXPECT_EQ(method(1.2 * 100, reduced), DemosaicMethod::residual);
}

TEST(PlanDemosaic, AGivenMethodIsUsedWhateverTheLight) {
  for (const DemosaicMethod method : all_demosaic_methods) {
    DevelopOptions options;
    options.demosaic = method;
    EXPECT_EQ(decided(flat_frame(5), options).demosaic.method, method);
    EXPECT_EQ(decided(flat_frame(5), options).reason, "given");
  }
}

TEST(PlanDemosaic, NothingIsInterpolatedAtHalfSize) {
  DevelopOptions options;
  options.half = true;
  EXPECT_TRUE(decided(flat_frame(20), options).reason.empty());
}

TEST(PlanDemosaic, TheOffsetIsFourElectronsAndFollowsNoTransformButWhiteBalance) {
  const RawFrame frame = flat_frame(200);
  DevelopOptions options;
  options.exposure_ev = 0;
  const Result<DevelopPlan> plan = plan_develop(frame, options, two_threads);
  ASSERT_TRUE(plan);
  const double white_e = 1 / frame.noise->scale[1];
  EXPECT_NEAR(plan->demosaic.demosaic.offset, 4 * plan->rendering.white_gain[1] / white_e, 1e-3 * 4 / white_e);
  EXPECT_EQ(plan->demosaic.demosaic.white, 1);
  options.exposure_ev = 3;
  EXPECT_EQ(decided(frame, options).demosaic.white, 0.125F);
  EXPECT_EQ(decided(frame, options).demosaic.offset, plan->demosaic.demosaic.offset);
}

TEST(PlanDemosaic, ARawThatCameDenoisedCountsTheElectronsOfTheShot) {
  RawFrame frame = flat_frame(80);
  DevelopOptions options;
  const DemosaicPlan shot = decided(frame, options);
  // A clean raw that states a quarter of the variance, lost detail included, states 4 times the electrons.
  for (double& scale : frame.noise->scale) scale /= 4;
  for (double& offset : frame.noise->offset) offset /= 4;
  frame.noise->reduced = true;
  const DemosaicPlan clean = decided(frame, options);
  EXPECT_EQ(clean.demosaic.method, DemosaicMethod::residual_median);
  EXPECT_NEAR(clean.demosaic.offset, shot.demosaic.offset, 1e-3 * shot.demosaic.offset);
  // The noise itself is a sixteenth of that of the shot.
  EXPECT_NEAR(clean.demosaic.noise_std, shot.demosaic.noise_std / 4, 0.02 * shot.demosaic.noise_std);
}

}  // namespace
}  // namespace lowlux::isp
