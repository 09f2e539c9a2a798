#pragma once

#include <string>

#include "isp/base/result.h"
#include "isp/cli/develop/develop_args.h"
#include "isp/model/appearance/shin_table.h"
#include "isp/output/picture/image_writer.h"
#include "isp/pipeline/options.h"

/// Functions common to verbs that make images of raw frames, for their options.

namespace lowlux::cli {

isp::WriteOptions write_options(const DevelopArgs& args);

/// Completes the data of looks and displays common to all images: the table is made once. Errors name file or option.
Result<void> make_for_display(const DevelopArgs& args, isp::DevelopOptions& options);

/// Reads coefficients of Shin's model from a file of at most 1 MB; see read_shin_table(). Errors name the file.
Result<isp::ShinTable> read_shin_file(const std::string& file);

}  // namespace lowlux::cli
