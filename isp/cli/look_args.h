#pragma once

#include <optional>
#include <string>

#include "isp/pipeline/look.h"

namespace CLI {
class App;
}

namespace lowlux::cli {

/// --look and what goes with it.
struct LookArgs {
  isp::LookChoice choice;
  bool noise_limit_given = false;
  std::optional<double> display_cd_m2;  // white of the display pictures are made for
  std::string eye_option;               // the first option given that only --look eye has; empty: none
};

void add_look(CLI::App& app, LookArgs& args);

/// The choice with defaults filled in. @return what is wrong with the options together, or nothing
std::optional<std::string> complete_look(const LookArgs& args, isp::LookChoice& choice);

}  // namespace lowlux::cli
