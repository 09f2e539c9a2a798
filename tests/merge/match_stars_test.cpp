#include "isp/merge/stars/match_stars.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <numbers>
#include <vector>

#include "isp/merge/stars/find_stars.h"
#include "tests/merge/star_motion.h"

namespace lowlux::merge {
namespace {

using namespace star_testing;

constexpr int width = 4000, height = 3000;

Star star_at(const Point& p, double error_px, double snr) {
  Star star;
  star.x_px = {p.x, error_px};
  star.y_px = {p.y, error_px};
  star.snr = snr;
  return star;
}

void sort_by_snr(StarField& field) {
  std::sort(field.stars.begin(), field.stars.end(), [](const Star& a, const Star& b) { return a.snr > b.snr; });
}

/// Lists of the same sky in two frames: `count` stars for each frame, of which each frame misses a fraction, and has as
/// many false ones.
struct TwoLists {
  StarField reference{.width = width, .height = height};
  StarField frame{.width = width, .height = height};

  TwoLists(const TrueMotion& motion, int count, double missing, Draw& draw) {
    const auto add = [&](StarField& field, const Point& p, double snr) {
      if (!motion.in_view(p)) return;
      const double error = 1.2 / snr + 0.01;
      field.stars.push_back(
          star_at({p.x + error * draw.normal(), p.y + error * draw.normal()}, error, snr * (1 + 0.1 * draw.normal())));
    };
    for (int k = 0; k < 9 * count; ++k) {  // three frames wide and high
      const Point sky{draw.uniform(-width, 2 * width), draw.uniform(-height, 2 * height)};
      const double snr = 6 / std::max(draw.uniform(), 1e-3);
      if (draw.uniform() >= missing) add(reference, motion.distorted(sky), snr);
      if (draw.uniform() >= missing) add(frame, motion.distorted(motion.moved(sky)), snr);
    }
    for (StarField* field : {&reference, &frame}) {
      for (int k = 0; k < missing * count; ++k) {
        add(*field, {draw.uniform(0, width - 1), draw.uniform(0, height - 1)}, 6 / std::max(draw.uniform(), 1e-3));
      }
      sort_by_snr(*field);
    }
  }
};

/// Error of a match over the part of the reference that is in view.
struct MatchError {
  double worst_px = 0;
  double ratio = 0;  // rms over the predicted one
};
MatchError error_of(const StarTransform& transform, const TrueMotion& motion) {
  MatchError out;
  double squares = 0, predicted = 0;
  for (int k = 0; k < 41 * 41; ++k) {
    const int column = k % 41, row = k / 41;
    const Point sky{column * motion.width / 40, row * motion.height / 40};
    const Point from = motion.distorted(sky), to = motion.distorted(motion.moved(sky));
    if (!motion.in_view(from) || !motion.in_view(to)) continue;
    const Point p = transform.at(from);
    const double error = std::hypot(p.x - to.x, p.y - to.y);
    out.worst_px = std::max(out.worst_px, error);
    squares += error * error / 2;
    predicted += std::pow(transform.standard_error_px(from), 2);
  }
  out.ratio = std::sqrt(squares / predicted);
  return out;
}

int trials(int count) { return std::getenv("LOWLUX_NIGHTLY") == nullptr ? count : 20 * count; }

TEST(MatchStars, FindsAnyRotationDisplacementAndDistortionWithTheErrorPredicted) {
  struct Case {
    int stars;
    double missing, distortion_px;
    int found_percent;
  };
  for (const Case& c : {Case{60, 0.2, 0, 90}, Case{60, 0.2, 2, 90}, Case{300, 0.4, 0, 99}, Case{300, 0.4, 2, 99},
                        Case{1000, 0.1, 2, 99}}) {
    int found = 0;
    double squares = 0;
    const int count = trials(60);
    for (int trial = 0; trial < count; ++trial) {
      Draw draw(static_cast<std::uint64_t>(1000 * c.stars + trial));
      const TrueMotion motion = drawn_motion(width, height, c.distortion_px, draw);
      const TwoLists lists(motion, c.stars, c.missing, draw);
      const Result<StarMatch> match = match_stars(lists.reference, lists.frame, {});
      if (!match) continue;
      ++found;
      const MatchError error = error_of(match->transform, motion);
      EXPECT_LT(error.worst_px, 3) << c.stars << " stars, trial " << trial;
      squares += error.ratio * error.ratio;
    }
    EXPECT_GE(100 * found, c.found_percent * count - 5 * 100 * std::sqrt(0.1 * count)) << c.stars << " stars";
    const double rms = std::sqrt(squares / found);
    EXPECT_GT(rms, 0.75) << c.stars << " stars, distortion " << c.distortion_px;
    EXPECT_LT(rms, 1.35) << c.stars << " stars, distortion " << c.distortion_px;
  }
}

TEST(MatchStars, MatchesStarsFoundInSimulatedFrames) {
  for (int trial = 0; trial < trials(4); ++trial) {
    StarCamera camera{.width = 1400, .height = 1000, .phase = static_cast<BayerPhase>(trial % 4)};
    Draw draw(static_cast<std::uint64_t>(50 + trial));
    const TrueMotion motion = drawn_motion(camera.width, camera.height, 2, draw);
    std::vector<TrueStar> first = drawn_stars(camera, 1500, 700, draw, 1000), second;
    for (TrueStar& star : first) {
      const Point sky{star.x, star.y}, to = motion.distorted(motion.moved(sky)), from = motion.distorted(sky);
      second.push_back({to.x, to.y, star.flux_e});
      star.x = from.x;
      star.y = from.y;
    }
    InlineExecutor one;
    const Plane<float> a = exposed(camera, first, 1), b = exposed(camera, second, 2);
    const StarField reference = find_stars(view_of(camera, a), {}, one),
                    frame = find_stars(view_of(camera, b), {}, one);
    const Result<StarMatch> match = match_stars(reference, frame, {});
    ASSERT_TRUE(match) << match.error().message << ", trial " << trial;
    const MatchError error = error_of(match->transform, motion);
    EXPECT_LT(error.worst_px, 0.5) << trial;
    EXPECT_GT(error.ratio, 0.2) << trial;
    EXPECT_LT(error.ratio, 3) << trial;
    EXPECT_GT(match->chi_square_ratio, 0.6) << trial;
    EXPECT_LT(match->chi_square_ratio, 1.7) << trial;  // crowded stars disturb each other
    EXPECT_GE(2 * match->matched, match->in_view) << trial;
  }
}

TEST(MatchStars, IdenticalListsGiveTheIdentity) {
  Draw draw(4);
  const TwoLists lists({.width = width, .height = height}, 100, 0, draw);
  const Result<StarMatch> match = match_stars(lists.reference, lists.reference, {});
  ASSERT_TRUE(match);
  EXPECT_EQ(match->matched, static_cast<int>(lists.reference.stars.size()));
  EXPECT_EQ(match->transform.model, TransformModel::similarity);
  EXPECT_LT(match->rms_px, 1e-9);
  const Point p = match->transform.at({10, 2900});
  EXPECT_NEAR(p.x, 10, 1e-9);
  EXPECT_NEAR(p.y, 2900, 1e-9);
}

TEST(MatchStars, FewStarsAreAnErrorWithTheirCounts) {
  Draw draw(5);
  const TwoLists lists({.width = width, .height = height, .dx = 100}, 60, 0, draw);
  for (std::size_t reference = 0; reference <= 3; ++reference) {
    for (std::size_t frame = 0; frame <= 3; ++frame) {
      StarField a = lists.reference, b = lists.reference;
      a.stars.resize(reference);
      b.stars.resize(frame);
      const Result<StarMatch> match = match_stars(a, b, {});
      ASSERT_FALSE(match);
      EXPECT_EQ(match.error().code, ErrorCode::insufficient);
      EXPECT_NE(match.error().message.find("of " + std::to_string(frame) + " stars"), std::string::npos)
          << match.error().message;
      EXPECT_NE(match.error().message.find("the " + std::to_string(reference) + " of"), std::string::npos)
          << match.error().message;
    }
  }
}

TEST(MatchStars, FourStarsAreEnoughWhereNothingElseIs) {
  StarField a{.width = width, .height = height}, b = a;
  for (const Point& p : {Point{500, 600}, {3100, 700}, {1800, 2500}, {2600, 1500}}) {
    a.stars.push_back(star_at(p, 0.05, 50));
    b.stars.push_back(star_at({p.x + 300.2, p.y - 100.4}, 0.05, 50));
  }
  const Result<StarMatch> match = match_stars(a, b, {});
  ASSERT_TRUE(match) << match.error().message;
  EXPECT_EQ(match->matched, 4);
  EXPECT_LE(match->log10_false_match_probability, -6);
  EXPECT_NEAR(match->transform.at({0, 0}).x, 300.2, 1e-6);
}

TEST(MatchStars, UnrelatedListsMatchNoMoreOftenThanStated) {
  constexpr double stated = 0.02;
  for (const int count : {3, 4, 6, 12, 40, 200}) {
    for (const bool clustered : {false, true}) {
      int matches = 0;
      const int tries = trials(count < 100 ? 300 : 40);
      for (int trial = 0; trial < tries; ++trial) {
        Draw draw(static_cast<std::uint64_t>(100000 * count + 2 * trial + (clustered ? 1 : 0)));
        StarField a{.width = width, .height = height}, b = a;
        for (StarField* field : {&a, &b}) {
          Point centre{};
          for (int k = 0; k < count; ++k) {
            if (k % 20 == 0) centre = {draw.uniform(200, width - 200), draw.uniform(200, height - 200)};
            const Point p = clustered ? Point{centre.x + 40 * draw.normal(), centre.y + 40 * draw.normal()}
                                      : Point{draw.uniform(0, width), draw.uniform(0, height)};
            field->stars.push_back(star_at(p, 0.1, 10));
          }
        }
        matches += match_stars(a, b, {.max_false_match_probability = stated}) ? 1 : 0;
      }
      EXPECT_LE(matches, stated * tries + 5 * std::sqrt(stated * tries)) << count << " stars, clustered " << clustered;
    }
  }
}

TEST(MatchStars, FramesOfNoiseDoNotMatch) {
  const StarCamera camera{.width = 1000, .height = 1000};
  InlineExecutor one;
  std::vector<StarField> fields;
  for (std::uint64_t seed = 1; seed <= 8; ++seed) {
    const Plane<float> frame = exposed(camera, {}, seed);
    fields.push_back(find_stars(view_of(camera, frame), {.false_stars_per_mp = 50}, one));
    EXPECT_GT(fields.back().stars.size(), 5U);
  }
  for (const StarField& a : fields) {
    for (const StarField& b : fields) {
      EXPECT_EQ(match_stars(a, b, {}).has_value(), &a == &b);
    }
  }
}

TEST(MatchStars, MirroredOrScaledListsDoNotMatch) {
  Draw draw(6);
  const TwoLists lists({.width = width, .height = height}, 80, 0, draw);
  StarField mirrored = lists.reference;
  for (Star& star : mirrored.stars) star.x_px.value = width - 1 - star.x_px.value;
  EXPECT_FALSE(match_stars(lists.reference, mirrored, {}));
  for (const double scale : {0.95, 0.981, 1.019, 1.05}) {
    StarField scaled = lists.reference;
    for (Star& star : scaled.stars) {
      star.x_px.value *= scale;
      star.y_px.value *= scale;
    }
    EXPECT_EQ(match_stars(lists.reference, scaled, {}).has_value(), std::fabs(scale - 1) < 0.02) << scale;
  }
}

TEST(MatchStars, StarsWinOverFewerSourcesThatStandStill) {
  Draw draw(7);
  TwoLists lists({.width = width, .height = height, .angle_rad = 0.3, .dx = 500}, 100, 0.2, draw);
  for (int k = 0; k < 20; ++k) {
    const Star lamp = star_at({draw.uniform(0, width), draw.uniform(2500, height)}, 0.02, 1000);
    lists.reference.stars.push_back(lamp);
    lists.frame.stars.push_back(lamp);
  }
  sort_by_snr(lists.reference);
  sort_by_snr(lists.frame);
  const Result<StarMatch> match = match_stars(lists.reference, lists.frame, {});
  ASSERT_TRUE(match);
  EXPECT_NEAR(match->transform.at({1999.5, 1499.5}).x, 2499.5, 1);
}

TEST(MatchStars, PatternsThatRepeatAreAnErrorUnlessTheyAreUneven) {
  for (const double unevenness_px : {0.0, 0.02, 2.0}) {
    Draw draw(10);
    StarField a{.width = width, .height = height};
    for (int k = 0; k < 100; ++k) {
      const int column = k % 10, row = k / 10;
      a.stars.push_back(star_at(
          {400 + 300.0 * column + unevenness_px * draw.normal(), 300 + 200.0 * row + unevenness_px * draw.normal()},
          0.02, 100));
    }
    StarField b = a;
    for (Star& star : b.stars) {
      star.x_px.value += 250 + 0.02 * draw.normal();
      star.y_px.value += 30 + 0.02 * draw.normal();
    }
    const Result<StarMatch> match = match_stars(a, b, {});
    ASSERT_EQ(match.has_value(), unevenness_px > 1) << unevenness_px;
    if (match) {
      EXPECT_NEAR(match->transform.at({2000, 1500}).x, 2250, 0.1);
    } else {
      EXPECT_NE(match.error().message.find("repeats"), std::string::npos) << match.error().message;
    }
  }
}

TEST(MatchStars, MotionIsThatOfTheTransformWithItsError) {
  Draw draw(8);
  const TrueMotion truth = drawn_motion(width, height, 2, draw);
  const TwoLists lists(truth, 300, 0.2, draw);
  const Result<StarMatch> match = match_stars(lists.reference, lists.frame, {});
  ASSERT_TRUE(match);
  const Motion motion = motion_of(match->transform, width, height);
  double lowest = 1e9, highest = 0;
  for (int k = 0; k < 500; ++k) {
    const Point p{draw.uniform(0, width - 1), draw.uniform(0, height - 1)}, q = match->transform.at(p);
    const Shift shift = motion.at(static_cast<float>(p.x), static_cast<float>(p.y));
    EXPECT_NEAR(static_cast<double>(shift.dx_px), q.x - p.x, 2e-3);  // single precision of thousands of pixels
    EXPECT_NEAR(static_cast<double>(shift.dy_px), q.y - p.y, 2e-3);
    if (!truth.in_view(q)) continue;
    lowest = std::min(lowest, match->transform.standard_error_px(p));
    highest = std::max(highest, match->transform.standard_error_px(p));
  }
  EXPECT_TRUE(motion.found);
  EXPECT_GE(motion.standard_error_px, lowest);
  EXPECT_LE(motion.standard_error_px, highest);
}

}  // namespace
}  // namespace lowlux::merge
