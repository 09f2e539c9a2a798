#include <cassert>
#include <variant>

#include "isp/raw/kernel/raw_to_rgb.h"
#include "isp/raw/kernel/raw_to_rgb_bands.h"

namespace lowlux::isp {
namespace {

/// Computes row y of the cells, which are four pixels high.
template <class Mosaic>
void quarter_row(const Mosaic& in, int y, const Ring& ring, const RgbView<float>& out) {
  const float* site[4][2];  // the two runs of each site of a 2x2 cell
  for (int k = 0; k < 4; ++k) {
    split_row(in, mirror(4 * y + k, height_of(in)), ring.row(k));
    mirror_ends(ring.row(k), width_of(in));
    site[2 * (k & 1)][k >> 1] = ring.row(k).even;
    site[2 * (k & 1) + 1][k >> 1] = ring.row(k).odd;
  }
  const int red = 2 * red_row(in.phase) + red_column(in.phase);
  const int cells = out[0].width;
  rows::quarter_row({{site[red][0], site[red][1]}, 2, 0.25f}, cells, out[0].row(y));
  rows::quarter_row({{site[red ^ 1][0], site[red ^ 1][1], site[red ^ 2][0], site[red ^ 2][1]}, 4, 0.125f}, cells,
                    out[1].row(y));
  rows::quarter_row({{site[red ^ 3][0], site[red ^ 3][1]}, 2, 0.25f}, cells, out[2].row(y));
}

void quarter_row(const CameraPlanes& in, int y, const Ring& ring, const RgbView<float>& out) {
  for (int c = 0; c < 3; ++c) {
    rows::QuarterRuns runs{{}, 8, 0.0625f};
    const float gain = usable(in.gain[c]);
    for (int k = 0; k < 4; ++k) {
      const float* const row = in.rgb[c].row(mirror(4 * y + k, height_of(in)));
      rows::split_float(row, width_of(in), {{0, 0}, {gain, gain}}, ring.row(k));
      mirror_ends(ring.row(k), width_of(in));
      runs.run[2 * k] = ring.row(k).even;
      runs.run[2 * k + 1] = ring.row(k).odd;
    }
    rows::quarter_row(runs, out[c].width, out[c].row(y));
  }
}

}  // namespace

template <class Mosaic>
void RawToRgb::bin(const Mosaic& in, RgbView<float> out, Executor& executor) {
  assert(width_of(in) <= max_width_);
  const int width = width_of(in) / 2, height = height_of(in) / 2;
  assert(out[0].width == width && out[0].height == height);
  if (width == 0) return;
  const int red = 2 * red_row(in.phase) + red_column(in.phase);
  run_bands(executor, threads_, height, [&](RowBand band, int thread) {
    const BandScratch own = scratch_of(thread);
    const Ring& ring = own.ring;
    const float* site[4] = {ring.row(0).even, ring.row(0).odd, ring.row(1).even, ring.row(1).odd};
    const rows::CellRow cells{{site[red], site[red ^ 1], site[red ^ 2], site[red ^ 3]}};
    for (int y = band.first; y < band.last; ++y) {
      split_row(in, 2 * y, ring.row(0));
      split_row(in, 2 * y + 1, ring.row(1));
      rows::bin_row(cells, width, {{out[0].row(y), out[1].row(y), out[2].row(y)}});
    }
  });
}

void RawToRgb::bin2x2(const DnMosaic& in, RgbView<float> out, Executor& executor) { bin(in, out, executor); }
void RawToRgb::bin2x2(const SignedMosaic& in, RgbView<float> out, Executor& executor) { bin(in, out, executor); }

void RawToRgb::quarter(const RgbInput& in, RgbView<float> out, Executor& executor) {
  std::visit(
      [&](const auto& input) {
        assert(width_of(input) <= max_width_);
        assert(out[0].width == cells_along(width_of(input)) && out[0].height == cells_along(height_of(input)));
        run_bands(executor, threads_, out[0].height, [&](RowBand band, int thread) {
          const BandScratch own = scratch_of(thread);
          for (int y = band.first; y < band.last; ++y) quarter_row(input, y, own.ring, out);
        });
      },
      in);
}

}  // namespace lowlux::isp
