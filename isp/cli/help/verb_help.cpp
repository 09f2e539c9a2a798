#include "isp/cli/help/verb_help.h"

#include <algorithm>

namespace lowlux::cli {
namespace {

using Words = std::vector<std::string_view>;

const std::vector<VerbHelp>& raw_verbs() {
  static const std::vector<VerbHelp> verbs{
      {"develop",
       {"--output", "--format", "--quality", "--bits", "--exposure", "--wb", "--space", "--half", "--denoise", "--look",
        "--profile", "--dark-frame", "--jobs", "--skip-existing", "--force"},
       {"lowlux develop night.nef -o night.jpg",
        "lowlux develop raws/ -o pictures/ --format jpg --skip-existing --max-size 2048",
        "lowlux develop night.nef -o night.jpg --exposure auto+0.5 --wb 3200K",
        "lowlux develop night.dng -o night.png --dark-frame darks/", "lowlux develop night.dng -o seen.jpg --look eye",
        "lowlux develop burst/ -o merged.jpg --merge"}},
      {"denoise",
       {"--output", "--denoise", "--profile", "--black", "--dark-frame", "--jobs", "--skip-existing", "--force",
        "--quiet"},
       {"lowlux denoise night.nef -o clean.dng", "lowlux denoise raws/ -o clean/ --skip-existing",
        "lowlux denoise raws/ -o clean/ --shard 2/8"}},
      {"merge",
       {"--output", "--align", "--drizzle", "--reference", "--profile", "--dark-frame", "--flat-frame", "--explain",
        "--force"},
       {"lowlux merge burst/*.dng -o merged.dng",
        "lowlux merge stars/ -o stars.dng --align stars --dark-frame darks/"}},
      {"info",
       {"--advise", "--json"},
       {"lowlux info night.nef", "lowlux info night.nef --json",
        "lowlux info --advise --sensor ELD_NikonD850 --luminance 0.1 --highlight 20x --max-exposure 1"}},
      {"capture",
       {"--list", "--v4l2", "--libcamera", "--output", "--as", "--live", "--exposure-time", "--gain", "--auto-exposure",
        "--frames", "--skip", "--denoise", "--force"},
       {"lowlux capture --list", "lowlux capture --v4l2 /dev/video0 -o night.png --black 64",
        "lowlux capture --libcamera 0 --exposure-time 0.5 --gain 8 --skip 3 -o night.dng",
        "lowlux capture --libcamera 0 --auto-exposure --max-exposure 0.1 -o night.dng",
        "lowlux capture --v4l2 /dev/video0 -o frames/ --as dng --frames 100",
        "lowlux capture --v4l2 /dev/video0 --live --temporal | ffplay -"}},
  };
  return verbs;
}

const std::vector<VerbHelp>& other_verbs() {
  static const std::vector<VerbHelp> verbs{
      {"simulate",
       {"--output", "--size", "--luminance", "--light", "--sensor", "--gain", "--exposure", "--f-number", "--frames",
        "--seed", "--no-truth", "--list", "--force"},
       {"lowlux simulate chart -o chart.dng --luminance 2", "lowlux simulate picture.png -o night.dng --luminance 0.1",
        "lowlux simulate dark -o dark.dng --exposure 4 --frames 16", "lowlux simulate --list"}},
      {"dataset",
       {},
       {"lowlux dataset night.json -o night/ --dry-run", "lowlux dataset night.json -o night/",
        "lowlux dataset night.json -o night/ --shard 2/8"}},
      {"doctor", {}, {"lowlux doctor", "lowlux doctor --json"}},
      {"calibrate black", {}, {"lowlux calibrate black darks/ -o camera.json --report camera.html"}},
      {"calibrate noise", {}, {"lowlux calibrate noise flats/ --darks bias/ -o camera.json --report camera.html"}},
      {"calibrate colour", {}, {"lowlux calibrate colour chart.dng -o camera.json --overlay patches.png"}},
      {"calibrate quoted", {}, {"lowlux calibrate quoted ELD_NikonD850 -o camera.json"}},
      {"calibrate sheet", {}, {"lowlux calibrate sheet flats/ --darks darks/ -o sheet.html --steady-light"}},
      {"compare", {}, {"lowlux compare reference.png test.png"}},
      {"bench",
       {},
       {"lowlux bench --quick", "lowlux bench --stage demosaic",
        "lowlux bench --method dcraw --method mine='mydenoiser {in} {out}' -o board/",
        "lowlux bench --calibrate-cost"}},
      {"reproduce", {}, {"lowlux reproduce --quick", "lowlux reproduce --list"}},
      {"retarget", {}, {"lowlux retarget picture.png -o dim.png --display-luminance 5"}},
      {"resaturate", {}, {"lowlux resaturate picture.jpg -o restored.jpg --black-area 0,0,40,40"}},
  };
  return verbs;
}

struct Group {
  std::string_view title;
  Words options;
};

/// Titles of the verbs that develop raw files.
const std::vector<Group>& raw_groups() {
  static const std::vector<Group> groups{
      {"Files",
       {"--output", "--format", "--as", "--raw", "--bits", "--quality", "--compression", "--jobs", "--shard",
        "--skip-existing", "--force", "--sync"}},
      {"Camera",
       {"--size", "--fps", "--gain-code", "--flip", "--memory", "--buffers", "--timeout", "--exposure-time", "--gain",
        "--auto-exposure", "--max-exposure", "--max-gain", "--mains", "--clip", "--gain-codes"}},
      {"Rendering",
       {"--exposure", "--wb", "--tone", "--brightness", "--contrast", "--saturation", "--space", "--demosaic", "--half",
        "--highlights", "--local-tone", "--sharpen", "--crop", "--max-size", "--baseline-exposure",
        "--camera-profile"}},
      {"Noise and defects", {"--denoise", "--line-noise", "--chroma-bias", "--repair", "--maps", "--temporal"}},
      {"Calibration",
       {"--black", "--saturation-level", "--profile", "--gain-setting", "--noise", "--dark-estimate", "--dark-frame",
        "--bias-frame", "--dark-frame-count", "--dark-noise", "--dark-doubling", "--flat-frame"}},
      {"Night look",
       {"--look", "--scene-luminance", "--field-of-view", "--light", "--adaptation-degree", "--dimming",
        "--noise-limit", "--coefficients", "--display-luminance", "--seeing-map"}},
      {"Tolerance and time", {"--effects", "--tolerance", "--budget-ms", "--budget-mpps"}},
      {"Merging",
       {"--merge", "--align", "--foreground", "--drizzle", "--pixfrac", "--mean", "--reference", "--false-alarm"}},
      {"Reports", {"--explain", "--json", "--timings", "--quiet"}},
  };
  return groups;
}

const std::vector<Group>& simulation_groups() {
  static const std::vector<Group> groups{
      {"Scene", {"--stars", "--star-luminance", "--lamp"}},
      {"Camera", {"--camera", "--lens-blur", "--temperature", "--cfa", "--masked-columns", "--sensor-seed"}},
      {"Noise sources", {"--effects", "--tolerance", "--sampling"}},
      {"Files", {"--truth", "--truth-electrons"}},
      {"Reports", {"--explain", "--json", "--timings", "--quiet"}},
  };
  return groups;
}

}  // namespace

VerbHelp verb_help(std::string_view verb) {
  for (const auto* const verbs : {&raw_verbs(), &other_verbs()}) {
    if (const auto found = std::ranges::find(*verbs, verb, &VerbHelp::verb); found != verbs->end()) return *found;
  }
  return {.verb = verb};
}

std::string_view option_group(std::string_view verb, std::string_view option) {
  for (const Group& group : verb == "simulate" ? simulation_groups() : raw_groups()) {
    if (std::ranges::find(group.options, option) != group.options.end()) return group.title;
  }
  return {};
}

}  // namespace lowlux::cli
