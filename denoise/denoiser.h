#pragma once

#include <cstddef>
#include <memory>

#include "denoise/denoise_options.h"
#include "isp/base/executor.h"
#include "isp/base/plane.h"

namespace lowlux::denoise {

/// Reduces the noise of a Bayer mosaic: joint multi-scale DCT on cells of partly stabilised values
/// (spatial/stabiliser.h), with hard thresholds and empirical Wiener weights, after G. Yu, G. Sapiro (IPOL 2011) and N.
/// Pierazzo, J.-M. Morel, G. Facciolo (IPOL 7, 2017). README.md has the equations; tests/reference/denoise_ref.h is a
/// plain double implementation.
///
/// Owns its memory, allocates only in the constructor, and processes one frame at a time. The result is bit-identical
/// for every number of threads.
class Denoiser {
 public:
  /// Allocates for mosaics of up to max_width x max_height pixels, each 2..65536, and up to `threads` of an executor's
  /// threads: about 22 bytes for each pixel, and 2 MB for each thread of a mosaic 4000 wide.
  /// @param most  the highest level a frame may request; Level::best needs 2.4 MB more for each thread of a mosaic 4000
  /// wide
  Denoiser(int max_width, int max_height, int threads, Level most = Level::high);
  /// Returns the bytes of memory that one denoiser allocates, including every plane.
  static std::size_t bytes(int max_width, int max_height, int threads, Level most = Level::high);
  ~Denoiser();
  Denoiser(const Denoiser&) = delete;
  Denoiser& operator=(const Denoiser&) = delete;

  /// Denoises one frame.
  /// @param raw  at least 2 x 2 pixels; any phase, odd sizes too
  /// @param signal_e  as large as `raw`; denoised, dark subtracted, signed [e-]. May not overlap `raw`. May be
  /// result_memory().
  void run(const RawElectronsView& raw, const RawNoise& noise, const DenoiseOptions& options, PlaneView<float> signal_e,
           const DenoiseMaps& maps, Executor& executor);

  /// Returns memory of the denoiser itself for the result of a mosaic of width x height pixels, which saves a caller 4
  /// bytes for each pixel. It holds the result until the next frame.
  PlaneView<float> result_memory(int width, int height) const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

/// Returns the name of the vector instruction set that the kernels use on this machine, as Highway names it.
const char* denoiser_target();

}  // namespace lowlux::denoise
