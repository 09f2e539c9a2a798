#include "isp/pipeline/merge/star_reference.h"

#include <optional>
#include <utility>

#include "isp/merge/block_test.h"
#include "isp/merge/mosaic_mean.h"
#include "isp/merge/placement.h"
#include "isp/merge/still_blocks.h"
#include "isp/pipeline/merge/predicted_frame.h"

namespace lowlux::isp {
namespace {

class Maker {
 public:
  Maker(FrameLoader& loader, const FrameElectrons& reference, const StarAlignment& stars, Executor& executor)
      : loader_(loader),
        reference_(reference),
        stars_(stars),
        executor_(executor),
        width_(reference.signal_e.width()),
        height_(reference.signal_e.height()) {}

  Result<StarReference> make(const std::vector<int>& others, bool keep_foreground) {
    motions_.resize(others.size());
    for (const bool is_first : {true, false}) {
      if (Result<void> read = average(others, keep_foreground && is_first); !read) {
        return tl::make_unexpected(read.error());
      }
      if (loader_.exposures_differ()) break;
      if (Result<void> predicted = predict(is_first); !predicted) return tl::make_unexpected(predicted.error());
    }
    return std::move(out_);
  }

 private:
  RgbView<const float> expected() const {
    return out_.prediction.plane[0].empty() ? RgbView<const float>{} : std::as_const(out_.prediction).view();
  }

  /// Makes the robust mean of the reference and of the others in its place.
  Result<void> average(const std::vector<int>& others, bool find_still) {
    std::vector<Plane<float>> sample;
    sample.push_back(reference_.signal_e.clone());
    merge::StillBlocks blocks(width_, height_);
    std::vector<Plane<float>> unmoved;
    loader_.expect(others);
    for (std::size_t i = 0; i < others.size(); ++i) {
      Result<FrameElectrons> frame = loader_.next();
      if (!frame) return tl::make_unexpected(frame.error());
      if (loader_.exposures_differ()) return {};
      const std::optional<merge::Motion>& motion = motion_of(*frame, i);
      if (!motion) continue;
      sample.push_back(placed(*frame, *motion));
      if (find_still) {
        blocks.add(std::as_const(reference_.signal_e).view(), std::as_const(sample.back()).view(),
                   std::as_const(frame->signal_e).view(), {reference_.variance_e2, 1}, executor_);
        unmoved.push_back(std::move(frame->signal_e));
      } else {
        put_still_blocks(out_.still, std::as_const(frame->signal_e).view(), sample.back().view(), executor_);
      }
    }
    if (find_still) {
      out_.still = blocks.blocks();
      for (std::size_t i = 0; i < unmoved.size(); ++i) {
        put_still_blocks(out_.still, std::as_const(unmoved[i]).view(), sample[i + 1].view(), executor_);
      }
    }
    merge::robust_mean(sample, {reference_.variance_e2, 1}, executor_);
    out_.signal_e = std::move(sample.front());
    out_.fraction = 1.0 / static_cast<double>(sample.size());
    return {};
  }

  /// Returns the motion of a frame, which is found when the frame is read for the first time.
  const std::optional<merge::Motion>& motion_of(const FrameElectrons& frame, std::size_t i) {
    if (expected()[0].data == nullptr) {
      FrameUse use;
      motions_[i] = stars_.motion_of(view_of(frame), use, executor_);
    }
    return motions_[i];
  }

  Plane<float> placed(const FrameElectrons& frame, const merge::Motion& motion) const {
    Plane<float> differences(width_, height_), out(width_, height_);
    merge::subtract_prediction(view_of(frame), 1, motion, expected(), differences.view(), executor_);
    merge::place_nearest(std::as_const(differences).view(), frame.phase, motion, expected(), out.view(), executor_);
    return out;
  }

  /// Develops the mean as a raw frame of as many frames.
  /// @param frees_mean  its memory is not needed any more
  Result<void> predict(bool frees_mean) {
    merge::MosaicMean mean(width_, height_);
    const std::vector<float> samples(static_cast<std::size_t>(width_), static_cast<float>(1 / out_.fraction));
    for_each_index(executor_, height_,
                   [&](int y) { mean.add_row(y, {.value = out_.signal_e.row(y), .weight = samples.data()}, {}); });
    if (frees_mean) out_.signal_e = {};
    out_.prediction = {};
    Result<CameraRgb> predicted =
        predicted_electrons(std::move(mean), reference_, loader_.reference(), loader_.reference_options(), executor_);
    if (!predicted) return tl::make_unexpected(at_frame(predicted.error(), loader_.reference_name()));
    out_.prediction = *std::move(predicted);
    return {};
  }

  FrameLoader& loader_;
  const FrameElectrons& reference_;
  const StarAlignment& stars_;
  Executor& executor_;
  int width_, height_;
  std::vector<std::optional<merge::Motion>> motions_;
  StarReference out_;
};

}  // namespace

void put_still_blocks(const Plane<std::uint8_t>& still, PlaneView<const float> unmoved, PlaneView<float> mosaic,
                      Executor& executor) {
  if (still.empty()) return;
  for_each_index(executor, mosaic.height, [&](int y) {
    for (int x = 0; x < mosaic.width; ++x) {
      if (still.at(x / merge::block_px, y / merge::block_px) != 0) mosaic.at(x, y) = unmoved.at(x, y);
    }
  });
}

Result<StarReference> find_star_reference(FrameLoader& loader, const FrameElectrons& reference,
                                          const StarAlignment& stars, const std::vector<int>& others,
                                          bool keep_foreground, Executor& executor) {
  return Maker(loader, reference, stars, executor).make(others, keep_foreground);
}

}  // namespace lowlux::isp
