// Writes small pictures of each format that the picture reader takes, and tables of spectra: what its fuzzers start
// from.
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "isp/base/executor.h"
#include "isp/codec/exr.h"
#include "isp/codec/jpeg.h"
#include "isp/codec/pfm.h"
#include "isp/codec/png.h"
#include "isp/codec/tiff.h"
#include "isp/output/picture/icc.h"
#include "tests/codec/pictures.h"

namespace lowlux::test {
namespace {

constexpr int width = 7, height = 5;

using Files = std::vector<std::pair<std::string, std::vector<std::byte>>>;

// An EXIF block that turns the picture: one entry, Orientation = 6.
std::vector<std::byte> turned_exif() {
  return bytes_of(std::array<unsigned char, 26>{'I', 'I', 42, 0, 8, 0, 0, 0, 1, 0, 0x12, 0x01, 3,
                                                0,   1,   0,  0, 0, 6, 0, 0, 0, 0, 0,    0,    0});
}

isp::FileMetadata everything(OutputSpace space) {
  isp::FileMetadata metadata;
  metadata.icc = isp::icc_profile(space);
  metadata.exif = turned_exif();
  metadata.info.orientation = Orientation::rotate_180;
  metadata.chromaticities = isp::chromaticities_of(space);
  metadata.white_luminance_cd_m2 = 0.5;
  return metadata;
}

SceneLinear light() {
  SceneLinear picture = noisy_linear(width, height);
  for (auto& plane : picture.plane) {
    for (std::size_t i = 0; i < plane.size(); ++i) plane.data()[i] = 0.75F + plane.data()[i];
  }
  return picture;
}

void add_codes(Files& files) {
  InlineExecutor executor;
  const Encoded8 eight = noisy_codes<std::uint8_t>(width, height);
  const Encoded16 sixteen = noisy_codes<std::uint16_t>(width, height);
  const isp::FileMetadata plain, full = everything(OutputSpace::display_p3);
  const auto add = [&files](const std::string& name, const auto& encode) { files.emplace_back(name, encoded(encode)); };
  add("plain8.png", [&](std::FILE* file) { return isp::encode_png(eight, plain, executor, file); });
  add("full16.png", [&](std::FILE* file) { return isp::encode_png(sixteen, full, executor, file); });
  add("plain.jpg", [&](std::FILE* file) { return isp::encode_jpeg(eight, plain, {}, file); });
  add("full.jpg", [&](std::FILE* file) {
    return isp::encode_jpeg(eight, full, {50, isp::JpegOptions::Chroma::half}, file);
  });
  const Picture eight_tiff = noisy_codes<std::uint8_t>(width, height);
  const Picture sixteen_tiff = noisy_codes<std::uint16_t>(width, height);
  add("plain8.tif", [&](std::FILE* file) { return isp::encode_tiff(eight_tiff, plain, {}, file); });
  add("full16.tif", [&](std::FILE* file) {
    return isp::encode_tiff(sixteen_tiff, full, {isp::TiffOptions::Compression::deflate}, file);
  });
}

void add_floats(Files& files) {
  const SceneLinear picture = light();
  const Picture tiff = light();
  const isp::FileMetadata plain, full = everything(OutputSpace::linear_rec2020);
  const auto add = [&files](const std::string& name, const auto& encode) { files.emplace_back(name, encoded(encode)); };
  using Depth = isp::ExrOptions::Depth;
  using Compression = isp::ExrOptions::Compression;
  add("half.exr", [&](std::FILE* file) { return isp::encode_exr(picture, plain, {}, file); });
  add("full.exr", [&](std::FILE* file) {
    return isp::encode_exr(picture, full, {Depth::full, Compression::piz}, file);
  });
  add("float.tif", [&](std::FILE* file) { return isp::encode_tiff(tiff, full, {}, file); });
  add("rgb.pfm", [&](std::FILE* file) { return isp::encode_pfm(picture, file); });
}

bool write(const std::filesystem::path& path, std::span<const std::byte> bytes) {
  std::ofstream file(path, std::ios::binary);
  file.write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
  return !bytes.empty() && static_cast<bool>(file);
}

constexpr std::pair<const char*, std::string_view> tables[] = {
    {"light.csv", "# relative power\nnm,lamp\n380,0.5\n500, 1.25\n780,2e-3\n"},
    {"chart.csv", "wavelength_nm,dark,light\r\n380,.01,0.9\r\n\r\n560.5,2E-2,0.91\r\n780,0.03,0.92"},
};

}  // namespace

bool write_seeds(const std::filesystem::path& folder) {
  Files files;
  add_codes(files);
  add_floats(files);
  bool good = true;
  for (const auto& [name, bytes] : files) good = write(folder / "picture" / name, bytes) && good;
  for (const auto& [name, text] : tables)
    good = write(folder / "spectra" / name, std::as_bytes(std::span(text))) && good;
  return good;
}

}  // namespace lowlux::test

int main(int argc, char** argv) {
  if (argc != 2) {
    std::fputs("usage: make_picture_seeds FOLDER, which holds folders picture and spectra\n", stderr);
    return 2;
  }
  return lowlux::test::write_seeds(argv[1]) ? 0 : 1;
}
