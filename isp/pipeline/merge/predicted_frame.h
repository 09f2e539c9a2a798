#pragma once

#include "isp/base/executor.h"
#include "isp/base/frame.h"
#include "isp/base/image.h"
#include "isp/base/result.h"
#include "isp/merge/mosaic_mean.h"
#include "isp/pipeline/merge/frame_electrons.h"
#include "isp/pipeline/options.h"

namespace lowlux::isp {

/// Predicts a frame without noise: R, G and B [e-] at every pixel of the active area, dark charge subtracted, without
/// the gains that the frame requests. It is developed with Level::standard, without white balance and tone.
/// @param frame  unchanged afterwards; its samples are not copied
/// Errors: those of develop.
Result<CameraRgb> predicted_electrons(RawFrame& frame, const DevelopOptions& options, Executor& executor);

/// Predicts a frame from a mean of mosaics in its place, in electrons of one frame.
/// @param mean       in electrons of the reference
/// @param reference  the noise and levels of the reference
/// @param frame      the reference as it was read, for its colour and noise
/// @param options    options of the reference
/// Errors: those of develop.
Result<CameraRgb> predicted_electrons(merge::MosaicMean mean, const FrameElectrons& reference, const RawFrame& frame,
                                      const DevelopOptions& options, Executor& executor);

/// Predicts a frame anew from the mean of frames in its place, in electrons of the reference. It is developed with
/// Level::draft, in strips of rows, which bounds the memory.
/// @param prediction  replaced; its values count where no frame has any
/// The others as above. Errors: those of develop, with part of the prediction replaced.
Result<void> predict_electrons(const merge::ColourMean& mean, const FrameElectrons& reference, const RawFrame& frame,
                               const DevelopOptions& options, CameraRgb& prediction, Executor& executor);

}  // namespace lowlux::isp
