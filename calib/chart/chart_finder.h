#pragma once

#include <array>
#include <optional>
#include <vector>

#include "calib/chart/chart_detector.h"
#include "calib/chart/chart_grid.h"
#include "calib/chart/chart_patches.h"
#include "calib/chart/colour_fit.h"
#include "isp/base/result.h"

namespace lowlux::calib {

/// A ColorChecker in an image.
struct FoundChart {
  ChartGrid grid;  // oriented as the chart lies, in pixels of the image (half size)
  std::array<ChartPatch, chart_patch_count> patches;
  double ciede2000 = 0;  // mean over the patches with a matrix fitted to them: similarity to a chart
};

/// Upper limit of the colour difference, with a fitted matrix, at which a shape is accepted as a ColorChecker.
/// Photographs reach 1 to 4; shuffled patches, and shapes wrongly detected as a chart, reached 26 at best.
inline constexpr double worst_chart_ciede2000 = 10;

/// Returns a position on the chart and a reference colour for each usable patch.
std::vector<ColourSample> samples_of(const std::array<ChartPatch, chart_patch_count>& patches,
                                     const std::array<isp::Xyz, 24>& reference);

/// Returns the camera RGB of a neutral, largest component 1: the sum of the grey row's usable patches, corrected for
/// the light's gradient. nullopt if none is usable or a component is not positive.
std::optional<Vector3> chart_neutral(const std::array<ChartPatch, chart_patch_count>& patches,
                                     const LightGradient& light);

/// Finds the one ColorChecker in an image, in any orientation, at sizes from 15 px for a patch, at any brightness. The
/// detector processes the image at several sizes and exposures; the shapes it finds are fitted to the pixels, and they
/// count as charts if their colours are a ColorChecker's under some light, which also determines the orientation.
/// Errors (insufficient), with a suggestion: no chart found, several charts, a chart of which too many patches are
/// clipped or whose signal is below the noise; (unreadable): the detector failed.
Result<FoundChart> find_chart(const ChartPicture& picture, DetectCharts* detect);

}  // namespace lowlux::calib
