#pragma once

#include <string>
#include <vector>

namespace lowlux::cli {

/// Holds what was found of one part of the installation.
struct InstalledPart {
  enum class State { works, missing, broken };
  std::string name;  // "decoder"
  State state = State::works;
  std::string found;   // what works; empty if nothing does
  std::string remedy;  // what is missing, and what would help; empty if nothing is
};

/// Tries every part of lowlux on this machine. The decoder and the file of defaults can be broken:
/// develop then fails.
std::vector<InstalledPart> find_installation();

}  // namespace lowlux::cli
