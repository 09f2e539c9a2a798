#pragma once

#include <cstdint>
#include <optional>

#include "isp/adapter/lowlux_stage.h"
#include "isp/base/frame.h"
#include "isp/base/raw_format.h"

namespace lowlux::isp {

/// What a picture is made of.
enum class StageOutput : std::uint8_t { rgbx, bgrx, rgb, bgr, nv12, rgb48, mosaic };

/// By its four-character code; nullopt for another.
std::optional<StageOutput> stage_output(std::uint32_t fourcc);

/// By one of the two ways to name raw formats; nullopt where none is known.
std::optional<RawFormat> stage_input(std::int32_t api, std::uint32_t fourcc, std::uint64_t modifier);

/// What lowlux_stage_query answers, its size aside.
void describe(const RawFormat& format, lowlux_stage_format_info& info);

/// Fills in planes, strides that are 0 or too small, and bytes. @return whether something that was asked for (not 0) is
/// not had
bool lay_out(StageOutput kind, int width, int height, lowlux_stage_output& out);

/// Bytes of a row of a plane, and rows of it.
std::size_t plane_row_bytes(StageOutput kind, int width, int plane);
int plane_rows(StageOutput kind, int height, int plane);
int planes_of(StageOutput kind);

}  // namespace lowlux::isp
