#pragma once

#include <functional>
#include <string>
#include <vector>

#include "isp/bench/bench_stages.h"
#include "isp/bench/scenes/denoise_scene.h"
#include "isp/bench/scenes/generated_scenes.h"

namespace lowlux::isp {

/// A way to make an image of a shot: linear Rec. 709, 1 for display white, signed.
/// @param exposure  as in mosaic_of()
using Development = std::function<SceneLinear(const DenoiseShot& shot, double exposure)>;

/// Marks that a development leaves. Errors are in standard deviations of the raw noise of their pixel and channel.
struct PictureMarks {
  double cell = 0;      // periodic_lines() of 2 px in codes of a flat lifted by 5 EV, all channels
  double block_8 = 0;   // lines with a period of 8 px, without those of 2 px
  double block_16 = 0;  // lines with a period of 16 px, without those of 2 px
  double cell_of_raw =
      0;  // like `cell`, relative to lines of white noise with the raw variance; largest of the channels
  double block_8_of_raw = 0;
  double block_16_of_raw = 0;
  double cell_codes = 0;   // root mean square of the pattern of 2 px [8-bit codes]
  double lamp_ring = 0;    // root mean square error 2 to 12 px from lamps
  double lamp_far = 0;     // and beyond 24 px
  double star_mean = 0;    // mean error of luminance 2 to 12 px from saturated stars
  double star_chroma = 0;  // root mean square error of R - G and B - G there
  double star_chroma_far = 0;
  double beads = 0;         // bead_amplitude() of R - G and B - G within 2 px of coloured edges [8-bit codes]
  double beads_inside = 0;  // in the middle between the edges
};

/// Measures all marks. Scenes are those of the held-out seeds.
/// @param mean_e  mean of every scene; of the flat, before it is lifted
/// @param size  size of each scene, even; at least 160 x 96
PictureMarks measure_marks(const Development& develop, double mean_e, const SceneSize& size);

/// Returns the largest amplitude that lines of white noise have in one flat: their expectation and five standard
/// deviations, sqrt(1 + 5 sqrt(2 / degrees of freedom)), of p^2 - 1 for 2 px and p^2 - 4 for more.
double max_periodic_amplitude(int period_px);

/// Returns the checks of one development.
std::vector<Finding> mark_findings(const std::string& name, const PictureMarks& marks);

}  // namespace lowlux::isp
