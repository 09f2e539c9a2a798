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

/// A ColorChecker in a picture.
struct FoundChart {
  ChartGrid grid;  // turned as the chart lies, in pixels of the picture (half size)
  std::array<ChartPatch, chart_patch_count> patches;
  double ciede2000 = 0;  // mean of the patches under a matrix fitted to them: how well they are a chart's
};

/// Shapes whose patches a matrix brings no nearer to a ColorChecker's are none. Photographs reach 1 to 4;
/// the patches shuffled, and shapes that the detector took for a chart, came no nearer than 26.
inline constexpr double worst_chart_ciede2000 = 10;

/// A place on the chart and a reference colour for each usable patch.
std::vector<ColourSample> samples_of(const std::array<ChartPatch, chart_patch_count>& patches,
                                     const std::array<isp::Xyz, 24>& reference);

/// Camera RGB of a neutral, largest component 1: the sum of the grey row's usable patches, the light's gradient taken
/// out. nullopt if none is usable or a component is not positive.
std::optional<Vector3> chart_neutral(const std::array<ChartPatch, chart_patch_count>& patches,
                                     const LightGradient& light);

/// The one ColorChecker in a picture, in any turn, at sizes from 15 px for a patch, however dark. The picture is shown
/// to the detector at several sizes and exposures; the shapes it finds are fitted to the pixels, and they count as
/// charts if their colours are a ColorChecker's under some light, which also tells the turn.
/// Errors (insufficient), with what would help: no chart found, several charts, a chart of which too many patches are
/// clipped or that drowns in noise; (unreadable): the detector failed.
Result<FoundChart> find_chart(const ChartPicture& picture, DetectCharts* detect);

}  // namespace lowlux::calib
