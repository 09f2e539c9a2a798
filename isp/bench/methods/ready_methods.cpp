#include <array>

#include "isp/bench/methods/method.h"

namespace lowlux::isp {
namespace {

// All write sRGB codes with the camera's white balance and matrix, without brightening. dcraw's and LibRaw's wavelets
// have a threshold of 100, dcraw's own example. RawTherapee's tone curves are off, its denoiser chooses chroma itself.
constexpr std::array ready{
    ReadyMethod{"dcraw", "dcraw -c -w -W -6 -g 2.4 12.92 -o 1 -q 3 -H 0 -n 100 {in} > {out.ppm}", "command -v dcraw",
                "dcraw"},
    ReadyMethod{"libraw", "dcraw_emu -w -W -6 -g 2.4 12.92 -o 1 -q 3 -H 0 -n 100 -Z {out.ppm} {in}",
                "command -v dcraw_emu", "LibRaw's dcraw_emu (Debian: libraw-bin)"},
    ReadyMethod{"rawtherapee",
                "printf '%s\\n' '[Exposure]' Auto=false Compensation=0 Contrast=0 Saturation=0 Black=0 "
                "HighlightCompr=0 ShadowCompr=0 HistogramMatching=false 'Curve=0;' 'Curve2=0;' '[HLRecovery]' "
                "Enabled=false '[White Balance]' Enabled=true Setting=Camera '[Sharpening]' Enabled=false "
                "'[PostDemosaicSharpening]' Enabled=false '[Directional Pyramid Denoising]' Enabled=true Method=Lab "
                "Luma=40 Ldetail=50 CMethod=AUT '[RAW Bayer]' Method=amaze Border=0 '[LensProfile]' LcMode=none "
                "'[Color Management]' ToneCurve=false "
                "ApplyLookTable=false ApplyBaselineExposureOffset=false WorkingProfile=sRGB OutputProfile=RTv4_sRGB "
                "> \"$TMPDIR/neutral.pp3\" && rawtherapee-cli -q -Y -t -b16 -o {out.tif} -p \"$TMPDIR/neutral.pp3\" "
                "-c {in}",
                "command -v rawtherapee-cli", "rawtherapee-cli (Debian: rawtherapee)"},
    ReadyMethod{"darktable",
                "darktable-cli {in} {out.tif} --core --configdir \"$TMPDIR/darktable\" --library :memory: "
                "--conf plugins/darkroom/workflow=none --conf plugins/imageio/format/tiff/bpp=16",
                "command -v darktable-cli", "darktable-cli (Debian: darktable)"},
    ReadyMethod{
        "opencv",
        "dcraw -c -w -W -g 2.4 12.92 -o 1 -q 3 -H 0 {in} > \"$TMPDIR/noisy.ppm\" && /usr/bin/python3 -c 'import "
        "cv2, sys; cv2.imwrite(sys.argv[2], cv2.fastNlMeansDenoisingColored(cv2.imread(sys.argv[1]), None, 10, "
        "10, 7, 21))' \"$TMPDIR/noisy.ppm\" {out.png}",
        "command -v dcraw && /usr/bin/python3 -c 'import cv2'",
        "dcraw, and cv2 of /usr/bin/python3 (Debian: python3-opencv)"},
};

}  // namespace

std::span<const ReadyMethod> ready_methods() { return ready; }

}  // namespace lowlux::isp
