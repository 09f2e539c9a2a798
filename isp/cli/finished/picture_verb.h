#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "capture/file/picture_source.h"
#include "isp/base/executor.h"
#include "isp/base/image.h"
#include "isp/base/result.h"
#include "isp/cli/config/config_file.h"
#include "isp/cli/shared/outputs.h"

namespace lowlux::cli {

/// Holds the arguments common to the verbs that convert one image to another.
struct PictureVerb {
  std::string name;                 // name of the verb
  std::vector<std::string> inputs;  // files that are read, the image first
  std::string output;
  std::optional<int> bits;
  int jpeg_quality = 92;
  bool force = false;
  bool json = false;
  bool quiet = false;
  Defaults defaults = {};  // defaults of the user's file
};

/// Reads, processes, writes by write_made() and prints its report; returns warnings.
using PictureWork = std::function<Result<std::vector<std::string>>(const PictureKind& kind, Executor& executor)>;

/// Checks the output before the work, prints warnings and errors after it. @return the exit code
int run_picture_verb(const PictureVerb& verb, const PictureWork& work);

/// Writes the resulting image to the verb's output, with the metadata of the source.
Result<void> write_made(const PictureVerb& verb, const Picture& picture, OutputSpace space,
                        const capture::ScenePicture& source, Executor& executor);

}  // namespace lowlux::cli
