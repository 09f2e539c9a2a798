#pragma once

#include <cstddef>
#include <vector>

#include "isp/base/executor.h"
#include "isp/base/frame.h"
#include "isp/pipeline/plan.h"
#include "tests/reference/raw_to_rgb_ref.h"

/// The whole way of a frame, one stage after the other on all of it, written to be read. Everything that isp/pipeline
/// fuses, tiles or passes row by row has to equal it (tests/pipeline/render_path_test.cpp).
namespace lowlux::reference {

/// Holds an image, row by row.
struct Image {
  int width = 0;
  int height = 0;
  std::vector<Rgb> pixel;

  const Rgb& at(int x, int y) const { return pixel[static_cast<std::size_t>(y) * width + x]; }
};

/// Develops a frame as a plan states, without framing, change for a display, sharpening and models of appearance. Each
/// stage is the library's where it has a reference of its own (corrections, noise reduction, rebuilt highlights, grid
/// of the look), else in double.
/// @return codes in 0..1, or linear values where the plan requests floats
Image developed(const RawFrame& frame, const isp::DevelopPlan& plan, Executor& executor);

/// Returns the mosaic of the active area before the flat field. Precondition: plan.levels.electrons_at_white.
SignalElectrons signal_electrons(const RawFrame& frame, const isp::DevelopPlan& plan, Executor& executor);

}  // namespace lowlux::reference
