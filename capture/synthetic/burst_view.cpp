#include "capture/synthetic/burst_view.h"

#include <algorithm>
#include <cmath>

namespace lowlux::capture {
namespace {

/// Returns the part of a pixel, 0..1, that lies between two edges of its axis.
double overlap(double centre_px, double first_px, double last_px) {
  return std::clamp(std::min(centre_px + 0.5, last_px) - std::max(centre_px - 0.5, first_px), 0.0, 1.0);
}

/// Output with one channel at each pixel.
struct MosaicOutput {
  Plane<float>& plane;
  BayerPhase phase;

  int width() const { return plane.width(); }
  int height() const { return plane.height(); }
  template <class Work>
  void at(int x, int y, const Work& work) const {
    work(static_cast<int>(colour_at(phase, x, y)), plane.row(y)[x]);
  }
};

/// Output with three channels at each pixel.
struct PlanesOutput {
  const RgbView<float>& planes;

  int width() const { return planes[0].width; }
  int height() const { return planes[0].height; }
  template <class Work>
  void at(int x, int y, const Work& work) const {
    for (int k = 0; k < 3; ++k) work(k, planes[k].row(y)[x]);
  }
};

class Renderer {
 public:
  explicit Renderer(const BurstView& view)
      : view_(view), to_sky_(inverse(view.sky_motion)), to_ground_(inverse(view.camera_motion)) {}

  template <class Output>
  void background(const Output& out, RowBand band) const {
    for (int y = band.first; y < band.last; ++y) {
      for (int x = 0; x < out.width(); ++x) {
        const ImagePoint pixel{static_cast<double>(x), static_cast<double>(y)};
        const ImagePoint ground = to_ground_.at(pixel);
        const auto covered = static_cast<float>(
            view_.foreground == nullptr ? 0 : std::clamp(ground.y_px - view_.horizon_px + 1, 0.0, 1.0));
        out.at(x, y, [&](int channel, float& value) {
          value = covered < 1 ? view_.sky.at(channel, to_sky_.at(pixel)) : 0;
          if (covered > 0) value = (1 - covered) * value + covered * view_.foreground->at(channel, ground);
        });
      }
    }
  }

  template <class Output>
  void put(const Mover& mover, const Output& out, RowBand band) const {
    const ImageBox box = mover.box(view_.frame);
    const ImageBox bounds = bounds_of(view_.camera_motion, box);
    if (!(bounds.right_px >= -1 && bounds.left_px <= out.width() && bounds.bottom_px >= band.first - 1 &&
          bounds.top_px <= band.last)) {
      return;
    }
    const auto row = [](double px) { return static_cast<int>(std::clamp(px, -1.0, 1e9)); };
    const ImagePoint centre = mover.centre(view_.frame);
    const auto gain = static_cast<float>(mover.gain);
    const LightGrid& source = view_.foreground == nullptr ? view_.sky : *view_.foreground;
    for (int y = std::max(band.first, row(bounds.top_px)); y < std::min(band.last, row(bounds.bottom_px) + 2); ++y) {
      for (int x = std::max(0, row(bounds.left_px)); x < std::min(out.width(), row(bounds.right_px) + 2); ++x) {
        const ImagePoint p = to_ground_.at({static_cast<double>(x), static_cast<double>(y)});
        const auto covered =
            static_cast<float>(overlap(p.x_px, box.left_px, box.right_px) * overlap(p.y_px, box.top_px, box.bottom_px));
        if (covered == 0) continue;
        const ImagePoint seen{p.x_px - centre.x_px + mover.texture.x_px, p.y_px - centre.y_px + mover.texture.y_px};
        out.at(x, y, [&](int channel, float& value) {
          value = (1 - covered) * value + covered * gain * source.at(channel, seen);
        });
      }
    }
  }

  template <class Output>
  void render(const Output& out, Executor& executor) const {
    for_each_band(executor, out.height(), [&](RowBand band, int) {
      background(out, band);
      for (const Mover& mover : view_.movers) put(mover, out, band);
    });
  }

 private:
  const BurstView& view_;
  RigidMotion to_sky_;
  RigidMotion to_ground_;
};

}  // namespace

void render_mosaic(const BurstView& view, BayerPhase phase, Executor& executor, Plane<float>& out) {
  Renderer(view).render(MosaicOutput{out, phase}, executor);
}

void render_planes(const BurstView& view, Executor& executor, const RgbView<float>& out) {
  Renderer(view).render(PlanesOutput{out}, executor);
}

}  // namespace lowlux::capture
