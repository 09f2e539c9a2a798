#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "calib/dark_stack.h"
#include "isp/base/dark_frame.h"
#include "isp/base/frame.h"
#include "isp/base/result.h"
#include "isp/cli/args.h"

namespace lowlux::cli {

/// The dark frames a command line names: files as they are, of folders the raw files in them by name. Errors: a folder
/// without raw files; a picture that is itself among its darks; a black point beside darks, which hold it already.
Result<std::vector<std::string>> dark_files(const DevelopArgs& args);

/// What all pictures' dark frames are made of.
struct DarkSource {
  std::vector<calib::DarkGroup> groups;
  double noise_share = 0.1;
  std::optional<double> doubling_c;
};

/// Reads the files one by one, adding them up. Errors: those of reading, of calib::DarkLibrary, and of the profile
/// that --dark-doubling may name: another camera's, or without that figure.
Result<DarkSource> read_darks(const std::vector<std::string>& files, const DarkArgs& args);

/// The dark frame of one picture: calib::make_dark_frame, with the picture's own masked pixels and tag.
Result<std::shared_ptr<const DarkFrame>> dark_frame_of(const DarkSource& darks, const RawDn& picture);

}  // namespace lowlux::cli
