#include "isp/pipeline/live/live_pipeline.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include <fmt/format.h>

#include "isp/raw/black_point.h"

namespace lowlux::isp {
namespace {

constexpr int max_side = 65536;

bool inside(const Rect& r, int width, int height) {
  return r.x >= 0 && r.y >= 0 && r.width >= 0 && r.height >= 0 && r.x <= width - r.width && r.y <= height - r.height;
}

Result<void> check(const LiveSetup& setup) {
  const auto wrong = [](std::string message) { return fail(ErrorCode::invalid_argument, std::move(message)); };
  if (names_of(setup.format) == nullptr) return fail(ErrorCode::unsupported, "the raw format is not known");
  if (setup.width < 2 || setup.height < 2 || setup.width > max_side || setup.height > max_side) {
    return wrong(fmt::format("width and height of frames must be 2 to {} pixels, found {} x {}", max_side, setup.width,
                             setup.height));
  }
  if (!inside(setup.active, setup.width, setup.height) || setup.active.width < 2 || setup.active.height < 2) {
    return wrong("the crop must be inside the frame and have at least 2 x 2 pixels");
  }
  for (const Rect& masked : setup.masked) {
    if (!inside(masked, setup.width, setup.height) || masked.width < 2 || masked.height < 2) {
      return wrong("masked pixels must be inside the frame and at least 2 x 2 pixels");
    }
  }
  if (setup.white_dn != 0 && !(setup.white_dn >= 0.001 && setup.white_dn <= 65535)) {
    return wrong("the white level must be between 0.001 and 65535, or 0 for the largest code");
  }
  if (setup.most == denoise::Level::best) return wrong("the level of live frames must be draft, standard or high");
  if (setup.look.look == Look::model) return wrong("the look of live frames must be that of the camera or of the eye");
  if (setup.samples == SampleType::f32) return wrong("codes of live frames must have 8 or 16 bits");
  return {};
}

RawFrame frame_of(const LiveSetup& setup) {
  RawFrame frame;
  RawDn& raw = frame.raw;
  raw.dn = Plane<std::uint16_t>(setup.width, setup.height);
  raw.layout = setup.format.layout;
  raw.active = setup.active;
  raw.default_crop = {0, 0, setup.active.width, setup.active.height};
  if (raw.layout == SensorLayout::bayer) raw.phase = phase_of_crop(setup.format.phase, setup.active.x, setup.active.y);
  raw.masked = setup.masked;
  raw.masked_is_stated = true;
  raw.white_dn.fill(setup.white_dn > 0 ? setup.white_dn : largest_code(setup.format));
  frame.colour = setup.colour;
  return frame;
}

}  // namespace

LivePipeline::LivePipeline(LiveSetup setup, RawFrame frame, Executor& executor)
    : executor_(executor),
      setup_(std::move(setup)),
      frame_(std::move(frame)),
      meter_(frame_.raw, setup_.format, executor.width()),
      planner_(setup_),
      pipeline_(executor) {}

Result<std::unique_ptr<LivePipeline>> LivePipeline::make(LiveSetup setup, Executor& executor) {
  if (Result<void> checked = check(setup); !checked) return tl::make_unexpected(checked.error());
  RawFrame frame = frame_of(setup);
  std::unique_ptr<LivePipeline> out(new LivePipeline(std::move(setup), std::move(frame), executor));
  if (Result<void> warm = out->warm_up(); !warm) return tl::make_unexpected(warm.error());
  return out;
}

/// Passes a warm-up frame through every step, so that all of them allocate their memory.
Result<void> LivePipeline::warm_up() {
  const double black = frame_.raw.white_dn[0] / 16, gain_dn = frame_.raw.white_dn[0] / 1000,
               variance = 4 * gain_dn * gain_dn;
  LiveFacts facts{
      .black_dn = PerSite<double>{black, black, black, black},
      .noise = LiveNoise{.gain_dn = gain_dn, .black_variance_dn2 = {variance, variance, variance, variance}},
      .scene_luminance_cd_m2 = 1};
  {
    const std::size_t stride = row_bytes(setup_.format, setup_.width);
    const std::vector<std::byte> zeros(stride * static_cast<std::size_t>(setup_.height));
    read(zeros, stride, facts, true);
  }
  planner_.use_all_effects(true);  // each frame decides anew which effects it needs
  const bool bayer = setup_.format.layout == SensorLayout::bayer;
  // The result of previous frames alone lies in memory that the result of a level does not need.
  enum class Reduction { none, temporal, temporal_and_level };
  for (const Reduction reduction : {Reduction::none, Reduction::temporal, Reduction::temporal_and_level}) {
    if (reduction != Reduction::none && !bayer) continue;
    const bool has_level = reduction == Reduction::temporal_and_level;
    if (has_level && !setup_.levels) continue;
    facts.denoise = {.mode = has_level ? LiveDenoise::Mode::level : LiveDenoise::Mode::off,
                     .level = setup_.most,
                     .temporal = reduction != Reduction::none};
    if (Result<void> planned = plan(facts); !planned) return planned;
    if (setup_.samples == SampleType::u16) {
      Plane<std::uint16_t> rgb(3 * setup_.active.width, setup_.active.height);
      render(rgb.view());
    } else {
      render(RowSink{[](void*, int, int, const std::uint8_t*, int) {}, nullptr});
    }
  }
  // Automatic levels use memory of their own.
  facts.denoise.mode = LiveDenoise::Mode::automatic;
  if (Result<void> planned = plan(facts); !planned) return planned;
  planner_.use_all_effects(false);
  reset();
  return {};
}

void LivePipeline::read(std::span<const std::byte> bytes, std::size_t stride, const LiveFacts& facts, bool statistics) {
  meter_.read(bytes, stride, frame_.raw, executor_, planner_.wants(facts, statistics));
}

Result<void> LivePipeline::plan(const LiveFacts& facts) { return planner_.plan(facts, meter_, frame_); }

void LivePipeline::reset() { planner_.reset(); }

void LivePipeline::render_mosaic(PlaneView<std::uint16_t> codes) {
  const RawLevels& levels = decided().levels;
  const Rect& active = frame_.raw.active;
  const int shift = 16 - setup_.format.bits, largest = largest_code(setup_.format);
  if (!levels.electrons_at_white) {
    for_each_band(executor_, active.height, [&](RowBand band, int) {
      for (int y = band.first; y < band.last; ++y) {
        const std::uint16_t* const dn = frame_.raw.dn.row(active.y + y) + active.x;
        // 16-bit words may hold values above the format's largest code, which would become dark.
        for (int x = 0; x < active.width; ++x) {
          codes.at(x, y) = static_cast<std::uint16_t>(std::min<int>(dn[x], largest) << shift);
        }
      }
    });
    return;
  }
  const PlaneView<const float> signal_e = pipeline_.signal(frame_, decided());
  const auto most = static_cast<float>(largest << shift);
  PerSite<float> black{}, code_per_e{};
  for (int site = 0; site < 4; ++site) {
    const double black_dn = levels.black.pedestal_dn[site];
    const double dn_per_e = (white_at(frame_.raw, site) - black_dn) / (*levels.electrons_at_white)[site];
    black[site] = static_cast<float>(std::ldexp(black_dn, shift)) + 0.5f;
    code_per_e[site] = static_cast<float>(std::ldexp(dn_per_e, shift));
  }
  for_each_band(executor_, active.height, [&](RowBand band, int) {
    for (int y = band.first; y < band.last; ++y) {
      const float* const in = signal_e.row(y);
      std::uint16_t* const out = codes.row(y);
      const int left = site_of(0, y);
      for (int x = 0; x < active.width; ++x) {
        const int site = left + (x & 1);
        const float code = black[site] + code_per_e[site] * in[x];
        out[x] = static_cast<std::uint16_t>(std::clamp(code, 0.0f, most));
      }
    }
  });
}

}  // namespace lowlux::isp
