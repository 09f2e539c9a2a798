#include "isp/cli/dark_files.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <filesystem>
#include <string_view>
#include <system_error>
#include <utility>

#include <fmt/format.h>

#include "calib/dark_frame.h"
#include "calib/dark_library.h"
#include "capture/file/dng_source.h"
#include "isp/cli/calibration.h"
#include "isp/cli/option_values.h"
#include "isp/cli/profile_file.h"
#include "isp/raw/black_point.h"
#include "isp/raw/masked_black.h"

namespace lowlux::cli {
namespace {

namespace fs = std::filesystem;

// What cameras write; truths, profiles and notes may lie beside them.
constexpr std::array<std::string_view, 24> raw_extensions{
    ".dng", ".cr2", ".cr3", ".crw", ".nef", ".nrw", ".arw", ".srf", ".sr2", ".raf", ".orf", ".rw2",
    ".pef", ".srw", ".3fr", ".fff", ".iiq", ".mos", ".mrw", ".kdc", ".dcr", ".erf", ".rwl", ".raw"};

bool is_raw_name(const fs::path& path) {
  std::string extension = path.extension().string();
  std::ranges::transform(extension, extension.begin(),
                         [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return std::ranges::find(raw_extensions, extension) != raw_extensions.end();
}

Result<void> add_folder(const std::string& folder, std::vector<std::string>& files) {
  std::vector<std::string> found;
  std::error_code error;
  for (fs::directory_iterator entry(folder, error), end; !error && entry != end; entry.increment(error)) {
    std::error_code ignored;
    if (entry->is_regular_file(ignored) && is_raw_name(entry->path())) found.push_back(entry->path().string());
  }
  if (error) return fail(ErrorCode::unreadable, "the folder cannot be read: " + error.message(), folder);
  if (found.empty()) return fail(ErrorCode::not_found, "the folder holds no raw files", folder);
  std::ranges::sort(found);
  files.insert(files.end(), found.begin(), found.end());
  return {};
}

// A name may hold commas itself.
std::vector<std::string> names_of(const std::string& word) {
  std::error_code ignored;
  return fs::exists(word, ignored) ? std::vector<std::string>{word} : words_of(word);
}

Result<double> doubling_of_profile(const std::string& file, const calib::FrameSetting& setting) {
  Result<CameraProfile> profile = read_profile(file);
  if (!profile) return tl::make_unexpected(profile.error());
  FrameInfo camera;
  camera.make = setting.make;
  camera.model = setting.model;
  if (const auto same = put_camera(camera, *profile); !same) {
    return fail(same.error().code, same.error().message, file);
  }
  for (const GainProfile& gain : profile->gains) {
    if (gain.sensor && gain.errors.dark_doubling_c > 0) return gain.sensor->dark_doubling_c;
  }
  return fail(ErrorCode::insufficient,
              "the profile holds no measured doubling of the dark current; calibrate it with darks of two temperatures",
              file);
}

}  // namespace

Result<std::vector<std::string>> dark_files(const DevelopArgs& args) {
  std::vector<std::string> files;
  for (const std::string& word : args.dark.words) {
    for (const std::string& name : names_of(word)) {
      std::error_code ignored;
      if (!fs::is_directory(name, ignored)) {
        files.push_back(name);
      } else if (auto added = add_folder(name, files); !added) {
        return tl::make_unexpected(added.error());
      }
    }
  }
  const bool black_asked = args.options.black.choice != isp::BlackChoice::automatic || !args.black_profile.empty();
  if (!files.empty() && black_asked) {
    return fail(ErrorCode::invalid_argument,
                "dark frames hold the black level already: taking both off leaves green shadows; give one of the two",
                "--black");
  }
  for (const std::string& input : args.inputs) {
    const auto same = std::ranges::find_if(files, [&](const std::string& file) {
      std::error_code ignored;
      return fs::equivalent(input, file, ignored);
    });
    if (same == files.end()) continue;
    return fail(ErrorCode::invalid_argument, fmt::format("{} is a picture and one of its darks", input),
                "--dark-frame");
  }
  return files;
}

Result<DarkSource> read_darks(const std::vector<std::string>& files, const DarkArgs& args) {
  calib::DarkLibrary library;
  for (const std::string& file : files) {
    const Result<RawFrame> frame = capture::read_raw(file);
    Result<void> added = frame ? library.add(frame->raw) : tl::make_unexpected(frame.error());
    if (added) continue;
    if (added.error().where.empty()) added.error().where = file;
    return tl::make_unexpected(added.error());
  }
  DarkSource out{.groups = library.groups(), .noise_share = args.noise_share, .doubling_c = args.doubling_c};
  if (!args.doubling_profile.empty()) {
    const Result<double> doubling = doubling_of_profile(args.doubling_profile, out.groups.front().setting);
    if (!doubling) return tl::make_unexpected(doubling.error());
    out.doubling_c = *doubling;
  }
  return out;
}

Result<std::shared_ptr<const DarkFrame>> dark_frame_of(const DarkSource& darks, const RawDn& picture) {
  calib::DarkRequest request{.noise_share = darks.noise_share, .doubling_c = darks.doubling_c};
  if (const auto masked = isp::measure_masked_black(picture).black) request.masked_dn = masked->pedestal_dn;
  if (const auto tag = isp::choose_black(picture, {isp::BlackChoice::metadata}); tag) {
    request.pedestal_dn = tag->pedestal_dn;
  }
  Result<DarkFrame> made = calib::make_dark_frame(darks.groups, picture, request);
  if (!made) return tl::make_unexpected(std::move(made.error()));
  return std::make_shared<const DarkFrame>(*std::move(made));
}

}  // namespace lowlux::cli
