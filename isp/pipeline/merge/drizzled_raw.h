#pragma once

#include "isp/base/executor.h"
#include "isp/base/frame.h"
#include "isp/base/image.h"
#include "isp/base/result.h"
#include "isp/merge/stars/drizzle.h"
#include "isp/pipeline/merge/frame_electrons.h"
#include "isp/pipeline/merge/merged_raw.h"

namespace lowlux::isp {

/// Checks that drizzling frames of this size takes no more memory than a limit: that of the sums
/// (Drizzle::memory_bytes), and 16 bytes for each output pixel while it is encoded. Error: too_large.
Result<void> check_drizzle_memory(int width, int height, const merge::DrizzleOptions& options, double limit_bytes);

/// Encodes a drizzled image as a raw frame of three measured colours (DNG LinearRaw), with its noise. Pixels without
/// data get the values of the prediction.
///
/// The NoiseProfile is that of larger areas: that of single pixels, times the square of noise_correlation_ratio.
/// @param image       emptied
/// @param prediction  prediction of the reference [e-]
/// @param reference   the noise and levels of the reference
/// @param frame       the reference as it was read; colour and corrections are moved out of it
/// @param out         alignment and use of each frame are read; frame and mean_count are set
void encode_drizzled(merge::DrizzleImage& image, const merge::DrizzleOptions& options, const CameraRgb& prediction,
                     const FrameElectrons& reference, RawFrame& frame, MergedRaw& out, Executor& executor);

}  // namespace lowlux::isp
