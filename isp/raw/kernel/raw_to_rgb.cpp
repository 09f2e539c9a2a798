#include "isp/raw/kernel/raw_to_rgb.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <optional>

#include "isp/raw/kernel/raw_to_rgb_bands.h"
#include "isp/raw/kernel/raw_to_rgb_rows.h"
#include "isp/raw/kernel/residual_band.h"
#include "isp/raw/kernel/residual_rows.h"

namespace lowlux::isp {
namespace {

using rows::Colour;
using rows::LookRow;
using rows::MosaicRows;
using rows::PlaneRows;

float clip_of(const RgbTransform& transform) { return std::isnan(transform.clip) ? 0.0f : transform.clip; }

Colour colour_in_order(const RgbTransform& transform, const std::array<int, 3>& channel) {
  Colour colour{};
  for (int c = 0; c < 3; ++c) {
    for (int j = 0; j < 3; ++j) colour.column[c][j] = usable(transform.matrix[3 * j + channel[c]]);
    colour.luminance[c] = usable(transform.luminance[c]);
  }
  colour.clip = clip_of(transform);
  colour.move_into_gamut = transform.move_into_gamut;
  colour.look = nullptr;
  return colour;
}

// The classes below are destinations of the rows of a band. finish() is called after each row has been converted.

template <class Codes, class Code>
struct CodeRows {
  const ToneTable* tone;
  PlaneView<Code> out;
  Codes operator()(int y) const { return {tone, out.row(y)}; }
  void finish(int /*y*/) const {}
};

struct PixelRows {
  const ToneTable* tone;
  const PixelView* out;
  rows::Codes8 operator()(int y) const { return {tone, out->row(y), out->pixel_bytes, out->is_bgr}; }
  void finish(int /*y*/) const {}
};

void change_row(const CodeChange& change, const std::uint16_t* rgb, int width, std::uint8_t* out) {
  change.to8(change.context, rgb, width, out);
}
void change_row(const CodeChange& change, const std::uint16_t* rgb, int width, std::uint16_t* out) {
  change.to16(change.context, rgb, width, out);
}

/// Writes through a row of 16-bit codes private to the thread, which a CodeChange converts.
template <class Code>
struct ChangedCodeRows {
  const ToneTable* tone;
  PlaneView<Code> out;
  const CodeChange* change;
  std::uint16_t* row;
  rows::Codes16 operator()(int /*y*/) const { return {tone, row}; }
  void finish(int y) const { change_row(*change, row, out.width / 3, out.row(y)); }
};

/// Passes rows to a RowSink through a row of codes private to the thread.
struct SunkRows {
  const ToneTable* tone;
  const RowSink* sink;
  std::uint8_t* row;
  int thread;
  int width;
  rows::Codes8 operator()(int /*y*/) const { return {tone, row}; }
  void finish(int y) const { sink->row(sink->context, thread, y, row, width); }
};

struct PlaneRowsOut {
  RgbView<float> out;
  rows::Planes operator()(int y) const { return {{out[0].row(y), out[1].row(y), out[2].row(y)}}; }
  void finish(int /*y*/) const {}
};

/// Interpolates a look for one row after another.
class LookRows {
 public:
  LookRows(const LookGrid* look, float* memory, std::size_t stride) : look_(look) {
    if (look == nullptr) return;
    for (int k = 0; k < LookGrid::parts; ++k) row_.part[k] = cells_[k] = memory + stride * k + 1;
    for (int c = 0; c < 3; ++c) {
      row_.luminance[c] = look->luminance[c];
      row_.rods[c] = look->rods[c];
      row_.tint[c] = look->tint[c];
    }
    row_.dark = look->dark;
  }

  /// Returns the look of row y; null without a look.
  const LookRow* at(int y) {
    if (look_ == nullptr) return nullptr;
    const float place = (static_cast<float>(y) + 0.5f) / LookGrid::cell - 0.5f;
    const float below = std::floor(place);
    for (int k = 0; k < LookGrid::parts; ++k) {
      const PlaneView<const float>& part = look_->part[k];
      const auto clamped = [&](float row) { return std::clamp(static_cast<int>(row), 0, part.height - 1); };
      float* const out = cells_[k];
      rows::blend_row(part.row(clamped(below)), part.row(clamped(below + 1)), place - below, part.width, out);
      out[-1] = out[0];
      std::fill_n(out + part.width, rows::look_padding, out[part.width - 1]);
    }
    return &row_;
  }

 private:
  const LookGrid* look_;
  float* cells_[LookGrid::parts]{};
  LookRow row_{};
};

template <class Mosaic, class SinkOfRow>
void convert_by_residual(const Mosaic& in, const RgbTransform& transform, RowBand band, const Scratch& memory,
                         LookRows look, const SinkOfRow& sink_of_row) {
  const ScratchUse use(memory);
  ResidualBand<Mosaic> demosaiced(in, in.demosaic, clip_of(transform), band, static_cast<float*>(memory.data));
  Colour colour = colour_in_order(transform, {0, 1, 2});
  for (int y = band.first; y < band.last;) {
    for (const int end = demosaiced.advance(); y < end; ++y) {
      colour.look = look.at(y);
      rows::convert_row(demosaiced.row(y), colour, width_of(in), sink_of_row(y));
      sink_of_row.finish(y);
    }
  }
}

template <class Mosaic, class SinkOfRow>
void convert_band(const Mosaic& in, const RgbTransform& transform, RowBand band, const BandScratch& own, LookRows look,
                  const SinkOfRow& sink_of_row) {
  if (in.demosaic.method >= DemosaicMethod::residual) {
    return convert_by_residual(in, transform, band, own.demosaic, look, sink_of_row);
  }
  const bool encoded = in.demosaic.method == DemosaicMethod::encoded_malvar;
  std::optional<ScratchUse> use;
  if (encoded) use.emplace(own.demosaic);
  const rows::Encoding encoding = encoding_with(in.demosaic.offset);
  const Ring ring =
      encoded ? Ring{static_cast<float*>(own.demosaic.data) + rows::padding_before, own.ring.run_stride} : own.ring;
  const int width = width_of(in), height = height_of(in);
  Colour red_row_colour = colour_in_order(transform, {0, 1, 2});
  Colour blue_row_colour = colour_in_order(transform, {2, 1, 0});
  int next = std::max(0, band.first - 2);  // the first row not yet split
  for (int y = band.first; y < band.last; ++y) {
    for (; next < std::min(height, y + 3); ++next) {
      const SplitRow linear = own.ring.row(next);
      split_row(in, next, linear);
      mirror_ends(linear, width);
      if (!encoded) continue;
      const int pairs = (width + 1) / 2 + 2;  // and one before, mirrored samples included
      rows::encode_row(linear.even - 1, clip_of(transform), encoding, pairs + 1, ring.row(next).even - 1);
      rows::encode_row(linear.odd - 1, clip_of(transform), encoding, pairs + 1, ring.row(next).odd - 1);
    }
    MosaicRows around{};
    around.encoded = encoded;
    around.encoding = encoding;
    around.linear_even = own.ring.row(y).even;
    around.linear_odd = own.ring.row(y).odd;
    for (int k = 0; k < 5; ++k) {
      const SplitRow row = ring.row(mirror(y + k - 2, height));
      around.even[k] = row.even;
      around.odd[k] = row.odd;
    }
    const bool has_red = (y & 1) == red_row(in.phase);
    around.own_is_odd = (red_column(in.phase) != 0) == has_red;
    Colour& colour = has_red ? red_row_colour : blue_row_colour;
    colour.look = look.at(y);
    rows::convert_row(around, colour, width, sink_of_row(y));
    sink_of_row.finish(y);
  }
}

template <class SinkOfRow>
void convert_band(const CameraPlanes& in, const RgbTransform& transform, RowBand band, const BandScratch& own,
                  LookRows look, const SinkOfRow& sink_of_row) {
  const Ring& ring = own.ring;
  Colour colour = colour_in_order(transform, {0, 1, 2});
  PlaneRows planes{};
  for (int y = band.first; y < band.last; ++y) {
    for (int c = 0; c < 3; ++c) {
      const float gain = usable(in.gain[c]);
      rows::split_float(in.rgb[c].row(y), width_of(in), {{0, 0}, {gain, gain}}, ring.row(c));
      planes.even[c] = ring.row(c).even;
      planes.odd[c] = ring.row(c).odd;
    }
    colour.look = look.at(y);
    rows::convert_row(planes, colour, width_of(in), sink_of_row(y));
    sink_of_row.finish(y);
  }
}

[[maybe_unused]] bool fits(const LookGrid& look, int width, int height) {
  return std::ranges::all_of(look.part, [&](const PlaneView<const float>& part) {
    return part.width == cells_along(width) && part.height == cells_along(height);
  });
}

[[maybe_unused]] bool reaches_one(const ToneTable& tone) {
  return tone.bins >= 1 && tone.bins <= ToneTable::capacity && tone.bin_of(1.0f) == tone.bins - 1;
}

/// Returns the number of floats that one part of a look's row takes.
std::size_t look_run_of(int width) { return 1 + static_cast<std::size_t>(cells_along(width)) + rows::look_padding; }

// Runs start on a cache line, an odd number of lines apart: an even number could map the live rows of a column to the
// same few sets of the first-level cache.
std::size_t run_stride_of(int width) { return (((run_of(width) + line_floats - 1) / line_floats) | 1U) * line_floats; }

constexpr std::size_t line_bytes = line_floats * sizeof(float);

std::size_t whole_lines(std::size_t bytes) { return (bytes + line_bytes - 1) / line_bytes * line_bytes; }

/// Sizes [bytes] of one thread's scratch memory for images `width` pixels wide.
struct ThreadBytes {
  std::size_t ring;
  std::size_t look;
  std::size_t codes;     // a row of codes for a CodeChange or a RowSink
  std::size_t demosaic;  // scratch memory of a ResidualBand, or of a second ring

  explicit ThreadBytes(int width)
      : ring(run_stride_of(width) * runs_per_thread * sizeof(float)),
        look(whole_lines(look_run_of(width) * LookGrid::parts * sizeof(float))),
        codes(whole_lines(3 * static_cast<std::size_t>(width) * sizeof(std::uint16_t))),
        demosaic(std::max(residual_floats(width) * sizeof(float), ring)) {}
  std::size_t all() const { return ring + look + codes + demosaic + 4 * scratch_guard_bytes; }
};

/// Returns the scratch memory of one thread: ring, look, codes, demosaicing.
std::array<Scratch, 4> scratch_at(std::byte* start, const ThreadBytes& bytes) {
  std::byte* const look = start + bytes.ring + scratch_guard_bytes;
  std::byte* const codes = look + bytes.look + scratch_guard_bytes;
  std::byte* const demosaic = codes + bytes.codes + scratch_guard_bytes;
  return {{{start, bytes.ring}, {look, bytes.look}, {codes, bytes.codes}, {demosaic, bytes.demosaic}}};
}

/// Returns the first complete cache line of memory that is larger by one line.
std::byte* first_line(std::byte* memory) {
  const auto beyond = reinterpret_cast<std::uintptr_t>(memory) % line_bytes;
  return memory + (line_bytes - beyond) % line_bytes;
}

}  // namespace

RawToRgb::RawToRgb(int max_width, int threads)
    : threads_(threads), max_width_(max_width), memory_(std::make_unique<std::byte[]>(bytes(max_width, threads))) {
  assert(max_width >= 1 && threads >= 1);
  const ThreadBytes each(max_width);
  for (int i = 0; i < threads; ++i) {
    for (const Scratch& scratch : scratch_at(first_line(memory_.get()) + i * each.all(), each)) close_scratch(scratch);
  }
}

std::size_t RawToRgb::bytes(int max_width, int threads) {
  return ThreadBytes(max_width).all() * static_cast<std::size_t>(threads) + line_bytes;
}

BandScratch RawToRgb::scratch_of(int thread) const {
  const ThreadBytes each(max_width_);
  const auto [ring, look, codes, demosaic] = scratch_at(first_line(memory_.get()) + thread * each.all(), each);
  const std::size_t stride = run_stride_of(max_width_);
  float* const linear = static_cast<float*>(ring.data) + rows::padding_before;
  return {thread,
          {linear, stride},
          static_cast<float*>(look.data),
          static_cast<std::uint16_t*>(codes.data),
          demosaic,
          {ScratchUse(ring), ScratchUse(look), ScratchUse(codes)}};
}

template <class MakeSink>
void RawToRgb::convert(const RgbInput& in, const RgbTransform& transform, const MakeSink& make_sink,
                       Executor& executor) {
  std::visit(
      [&](const auto& input) {
        assert(width_of(input) <= max_width_);
        assert(transform.look == nullptr || fits(*transform.look, width_of(input), height_of(input)));
        if (width_of(input) == 0) return;
        run_bands(executor, threads_, height_of(input), [&](RowBand band, int thread) {
          const BandScratch own = scratch_of(thread);
          convert_band(input, transform, band, own, LookRows(transform.look, own.look, look_run_of(max_width_)),
                       make_sink(own));
        });
      },
      in);
}

template <class Codes, class Code>
void RawToRgb::to_codes(const RgbInput& in, const RgbTransform& transform, const ToneTable& tone, PlaneView<Code> out,
                        Executor& executor, const CodeChange* change) {
  assert(reaches_one(tone));
  if (change == nullptr) {
    convert(
        in, transform,
        [&](const BandScratch&) {
          return CodeRows<Codes, Code>{&tone, out};
        },
        executor);
  } else {
    convert(
        in, transform,
        [&](const BandScratch& own) {
          return ChangedCodeRows<Code>{&tone, out, change, own.codes};
        },
        executor);
  }
}

void RawToRgb::rgb8(const RgbInput& in, const RgbTransform& transform, const ToneTable& tone,
                    PlaneView<std::uint8_t> out, Executor& executor, const CodeChange* change) {
  to_codes<rows::Codes8>(in, transform, tone, out, executor, change);
}

void RawToRgb::pixels8(const RgbInput& in, const RgbTransform& transform, const ToneTable& tone, const PixelView& out,
                       Executor& executor) {
  assert(reaches_one(tone));
  convert(
      in, transform,
      [&](const BandScratch&) {
        return PixelRows{&tone, &out};
      },
      executor);
}

void RawToRgb::rgb16(const RgbInput& in, const RgbTransform& transform, const ToneTable& tone,
                     PlaneView<std::uint16_t> out, Executor& executor, const CodeChange* change) {
  to_codes<rows::Codes16>(in, transform, tone, out, executor, change);
}

void RawToRgb::rows8(const RgbInput& in, const RgbTransform& transform, const ToneTable& tone, const RowSink& sink,
                     Executor& executor) {
  assert(reaches_one(tone));
  const int width = std::visit([](const auto& input) { return width_of(input); }, in);
  convert(
      in, transform,
      [&](const BandScratch& own) {
        return SunkRows{&tone, &sink, reinterpret_cast<std::uint8_t*>(own.codes), own.thread, width};
      },
      executor);
}

void RawToRgb::linear(const RgbInput& in, const RgbTransform& transform, RgbView<float> out, Executor& executor) {
  convert(
      in, transform, [&](const BandScratch&) { return PlaneRowsOut{out}; }, executor);
}

const char* raw_to_rgb_target() { return rows::target_name(); }

bool cpu_runs_raw_to_rgb() {
#if defined(__x86_64__)
  return __builtin_cpu_supports("ssse3") != 0;
#else
  return true;
#endif
}

}  // namespace lowlux::isp
