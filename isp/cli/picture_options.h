#pragma once

#include "isp/base/result.h"
#include "isp/cli/args.h"
#include "isp/output/image_writer.h"
#include "isp/pipeline/plan.h"

/// What verbs that make pictures of raw frames do with their options.
namespace lowlux::cli {

isp::WriteOptions write_options(const DevelopArgs& args);

/// What all pictures share of looks and displays: the table is made once. Errors name the file or option.
Result<void> make_for_display(const DevelopArgs& args, isp::DevelopOptions& options);

}  // namespace lowlux::cli
