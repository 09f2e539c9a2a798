// Runs one fuzz target over the files of a folder, without a fuzzer: what was found once stays found.
//   fuzz_replay TARGET FOLDER
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string_view>
#include <vector>

// See LOWLUX_FUZZ_TARGET.
#define LOWLUX_FUZZ_TARGETS(of)                                                                               \
  of(command_line) of(cost) of(decoder) of(dng_tags) of(noise_files) of(options) of(profile) of(read_picture) \
      of(read_raw) of(shin) of(spectra) of(stage) of(unpack) of(v4l2)

#define LOWLUX_DECLARE(name) extern "C" int name##_fuzz_input(const std::uint8_t* data, std::size_t size);
LOWLUX_FUZZ_TARGETS(LOWLUX_DECLARE)

namespace {

struct Target {
  std::string_view name;
  int (*run)(const std::uint8_t* data, std::size_t size);
};

#define LOWLUX_ENTRY(name) {#name, name##_fuzz_input},
constexpr Target targets[] = {LOWLUX_FUZZ_TARGETS(LOWLUX_ENTRY)};

}  // namespace

int main(int argc, char** argv) {
  const auto* const target =
      argc == 3 ? std::ranges::find(targets, std::string_view(argv[1]), &Target::name) : std::end(targets);
  if (target == std::end(targets)) return std::fprintf(stderr, "usage: fuzz_replay TARGET FOLDER\n"), 2;
  int files = 0;
  for (const auto& entry : std::filesystem::directory_iterator(argv[2])) {
    std::ifstream file(entry.path(), std::ios::binary);
    const std::vector<char> bytes{std::istreambuf_iterator<char>(file), {}};
    target->run(reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size());
    ++files;
  }
  std::printf("%s: %d inputs\n", argv[1], files);
  return files > 0 ? 0 : 1;
}
