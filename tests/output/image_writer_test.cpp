#include "isp/output/picture/image_writer.h"

#include <gtest/gtest.h>
#include <sys/resource.h>

#include <algorithm>
#include <array>
#include <csignal>
#include <cstdio>
#include <memory>

#include "isp/codec/pfm.h"
#include "isp/codec/png.h"
#include "isp/output/picture/icc.h"
#include "tests/codec/pictures.h"
#include "tests/support/scratch_directory.h"

namespace lowlux::isp {
namespace {

using test::ScratchDirectory;

FrameInfo camera_info() {
  FrameInfo info;
  info.make = "Maker";
  info.model = "Model 1";
  info.date_time = "2024:02:03 04:05:06";
  info.exposure_s = 0.25;
  info.iso = 3200;
  info.f_number = 2;
  info.focal_length_mm = 35;
  info.orientation = Orientation::rotate_90;
  return info;
}

struct Case {
  const char* name;
  Picture (*make)();
  OutputSpace space;
};

Picture codes8() { return test::noisy_codes<std::uint8_t>(80, 60); }
Picture codes16() { return test::noisy_codes<std::uint16_t>(80, 60); }
Picture floats() { return test::noisy_linear(80, 60); }

const std::array<Case, 8>& cases() {
  static const std::array<Case, 8> all{{{"a8.png", codes8, OutputSpace::srgb},
                                        {"a16.PNG", codes16, OutputSpace::rec2020},
                                        {"a.jpg", codes8, OutputSpace::display_p3},
                                        {"b.JPEG", codes8, OutputSpace::srgb},
                                        {"a8.tif", codes8, OutputSpace::srgb},
                                        {"a16.tiff", codes16, OutputSpace::linear_srgb},
                                        {"af.TIF", floats, OutputSpace::linear_rec2020},
                                        {"a.exr", floats, OutputSpace::linear_rec2020}}};
  return all;
}

Result<void> write(const Case& c, const std::string& path, Overwrite overwrite = Overwrite::no) {
  InlineExecutor executor;
  return write_picture(c.make(), c.space, camera_info(), path,
                       {.overwrite = overwrite, .software = "lowlux 9", .jpeg = {}, .tiff = {}, .exr = {}}, executor);
}

Result<DecodedPicture> read(const std::string& path, const std::string& bytes) {
  const auto data = std::as_bytes(std::span(bytes));
  switch (format_of(path).value()) {
    case FileFormat::png:
      return decode_png(data);
    case FileFormat::jpeg:
      return decode_jpeg(data);
    case FileFormat::tiff:
      return decode_tiff(data);
    case FileFormat::exr:
      return decode_exr(data);
    case FileFormat::pfm:
      break;
  }
  return decode_pfm(data);
}

TEST(WritePicture, EveryFormatComesBackWithItsProfileAndExposure) {
  const ScratchDirectory scratch;
  for (const Case& c : cases()) {
    const auto written = write(c, scratch.file(c.name));
    ASSERT_TRUE(written) << written.error().message;
    const auto decoded = read(c.name, scratch.read(c.name));
    ASSERT_TRUE(decoded) << c.name << decoded.error().message;
    const FileFormat format = format_of(c.name).value();
    if (format == FileFormat::exr) {
      EXPECT_NEAR(decoded->metadata.chromaticities->green.y, 0.797, 1e-6);
    } else {
      EXPECT_EQ(decoded->metadata.icc, icc_profile(c.space)) << c.name;
      EXPECT_FALSE(decoded->metadata.icc.empty());
    }
    if (format == FileFormat::png || format == FileFormat::jpeg) {
      EXPECT_FALSE(decoded->metadata.exif.empty()) << c.name;
    } else {
      EXPECT_EQ(decoded->metadata.info.exposure_s, 0.25) << c.name;
      EXPECT_EQ(decoded->metadata.info.software, "lowlux 9");
      EXPECT_EQ(decoded->metadata.info.orientation, Orientation::normal);
    }
  }
  EXPECT_EQ(scratch.names().size(), cases().size());
}

std::string output_of(const std::string& command) {
  const std::unique_ptr<std::FILE, int (*)(std::FILE*)> pipe(popen(command.c_str(), "r"), pclose);
  std::string all;
  std::array<char, 1000> part{};
  while (pipe && std::fgets(part.data(), part.size(), pipe.get()) != nullptr) all += part.data();
  return all;
}

/// The independent reader.
TEST(WritePicture, ExiftoolReadsTheSameExposure) {
  if (output_of("command -v exiftool").empty()) GTEST_SKIP() << "exiftool is not installed";
  const ScratchDirectory scratch;
  for (const Case& c : cases()) {
    ASSERT_TRUE(write(c, scratch.file(c.name)));
    const std::string said = output_of("exiftool -s -n " + scratch.file(c.name));
    const auto expect = [&](const std::string& tag, const std::string& text) {
      const std::size_t line = said.find("\n" + tag + " ");
      ASSERT_NE(line, std::string::npos) << c.name << " has no " << tag << "\n" << said;
      const std::size_t start = said.find(": ", line) + 2;
      EXPECT_EQ(said.substr(start, said.find('\n', start) - start), text) << c.name << " " << tag;
    };
    EXPECT_EQ(said.find("Error"), std::string::npos) << said;
    expect("ImageWidth", "80");
    expect("Software", "lowlux 9");
    expect("DateTimeOriginal", "2024:02:03 04:05:06");
    expect("ExposureTime", "0.25");
    expect("ISO", "3200");
    if (format_of(c.name).value() == FileFormat::exr) continue;  // it has no place for what follows
    expect("Make", "Maker");
    expect("Model", "Model 1");
    expect("FNumber", "2");
    expect("FocalLength", "35");
    expect("Orientation", "1");
    expect("ProfileConnectionSpace", "XYZ");
  }
}

TEST(WritePicture, PixelsOfLosslessFormatsComeBackBitExact) {
  const ScratchDirectory scratch;
  for (const Case& c : {cases()[0], cases()[1], cases()[4], cases()[5], cases()[6]}) {
    ASSERT_TRUE(write(c, scratch.file(c.name)));
    const auto decoded = read(c.name, scratch.read(c.name));
    ASSERT_TRUE(decoded);
    const Picture original = c.make();
    std::visit(
        [&](const auto& image) {
          EXPECT_TRUE(test::same_bits(image, std::get<std::decay_t<decltype(image)>>(decoded->picture))) << c.name;
        },
        original);
  }
}

TEST(WritePicture, PfmHoldsTheFloatsAndNothingElse) {
  const ScratchDirectory scratch;
  ASSERT_TRUE(write({"", floats, OutputSpace::linear_srgb}, scratch.file("a.pfm")));
  const auto decoded = read("a.pfm", scratch.read("a.pfm"));
  ASSERT_TRUE(decoded) << decoded.error().message;
  EXPECT_TRUE(test::same_bits(test::noisy_linear(80, 60), std::get<SceneLinear>(decoded->picture)));
  const auto codes = write({"", codes8, OutputSpace::srgb}, scratch.file("b.pfm"));
  ASSERT_FALSE(codes);
  EXPECT_NE(codes.error().message.find("PFM files hold floats, the image is 8-bit"), std::string::npos);
  EXPECT_FALSE(scratch.holds("b.pfm"));
}

TEST(WritePicture, CameraNumbersGetNoRgbProfileAndXyzItsAxes) {
  const ScratchDirectory scratch;
  for (const OutputSpace space : {OutputSpace::xyz, OutputSpace::camera}) {
    const std::string stem = space == OutputSpace::xyz ? "xyz" : "camera";
    ASSERT_TRUE(write({"", floats, space}, scratch.file(stem + ".tif")));
    ASSERT_TRUE(write({"", floats, space}, scratch.file(stem + ".exr")));
    EXPECT_EQ(read("a.tif", scratch.read(stem + ".tif"))->metadata.icc.empty(), space == OutputSpace::camera);
    EXPECT_EQ(read("a.exr", scratch.read(stem + ".exr"))->metadata.chromaticities.has_value(),
              space == OutputSpace::xyz);
  }
}

TEST(WritePicture, AnExistingFileIsKeptUnlessOverwritingIsAskedFor) {
  const ScratchDirectory scratch;
  for (const Case& c : cases()) {
    scratch.write(c.name, "old");
    const auto refused = write(c, scratch.file(c.name));
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().code, ErrorCode::exists);
    EXPECT_NE(refused.error().message.find("--force"), std::string::npos);
    EXPECT_EQ(scratch.read(c.name), "old");
    ASSERT_TRUE(write(c, scratch.file(c.name), Overwrite::yes));
    EXPECT_NE(scratch.read(c.name), "old");
  }
}

/// No file of this process may grow beyond `bytes` while this lives.
class FileSizeLimit {
 public:
  explicit FileSizeLimit(rlim_t bytes) : handler_(std::signal(SIGXFSZ, SIG_IGN)) {
    getrlimit(RLIMIT_FSIZE, &before_);
    const rlimit limit{bytes, before_.rlim_max};
    setrlimit(RLIMIT_FSIZE, &limit);
  }
  ~FileSizeLimit() {
    setrlimit(RLIMIT_FSIZE, &before_);
    std::signal(SIGXFSZ, handler_);
  }
  FileSizeLimit(const FileSizeLimit&) = delete;
  FileSizeLimit& operator=(const FileSizeLimit&) = delete;

 private:
  void (*handler_)(int);
  rlimit before_{};
};

TEST(WritePicture, AWriteThatFailsLeavesNeitherAFileNorATemporary) {
  const ScratchDirectory scratch;
  for (const rlim_t bytes : {rlim_t{10}, rlim_t{1500}}) {
    for (const Case& c : cases()) {
      Result<void> written;
      {
        const FileSizeLimit limit(bytes);
        written = write(c, scratch.file(c.name));
      }
      ASSERT_FALSE(written) << c.name;
      EXPECT_EQ(written.error().code, ErrorCode::unwritable);
      EXPECT_EQ(written.error().where, scratch.file(c.name));
      EXPECT_EQ(written.error().message.rfind("cannot write " + scratch.file(c.name) + ": ", 0), 0U)
          << written.error().message;
      EXPECT_TRUE(scratch.names().empty()) << c.name;
    }
  }
}

TEST(WritePicture, AFailedWriteWithForceKeepsTheOldFile) {
  const ScratchDirectory scratch;
  scratch.write("a.exr", "old");
  {
    const FileSizeLimit limit(1500);
    EXPECT_FALSE(write(cases()[7], scratch.file("a.exr"), Overwrite::yes));
  }
  EXPECT_EQ(scratch.read("a.exr"), "old");
  EXPECT_EQ(scratch.names().size(), 1U);
}

TEST(PngBytes, AreAFileWithTheCodesAndTheProfile) {
  PoolExecutor executor(2);
  const Encoded8 codes = test::noisy_codes<std::uint8_t>(80, 60);
  const auto bytes = png_bytes(codes, OutputSpace::srgb, executor);
  ASSERT_TRUE(bytes);
  const auto back = decode_png(*bytes);
  ASSERT_TRUE(back);
  const auto* same = std::get_if<Encoded8>(&back->picture);
  ASSERT_NE(same, nullptr);
  for (int y = 0; y < 60; ++y)
    EXPECT_TRUE(std::equal(codes.codes.row(y), codes.codes.row(y) + 240, same->codes.row(y)));
  EXPECT_EQ(back->metadata.icc, icc_profile(OutputSpace::srgb));
  EXPECT_FALSE(png_bytes(Encoded8{}, OutputSpace::srgb, executor));
}

TEST(FormatOf, TellsByTheEndOfTheNameInAnyCase) {
  EXPECT_EQ(format_of("a/b.c/x.png").value(), FileFormat::png);
  EXPECT_EQ(format_of("x.JpG").value(), FileFormat::jpeg);
  EXPECT_EQ(format_of("x.jpeg").value(), FileFormat::jpeg);
  EXPECT_EQ(format_of("x.TIF").value(), FileFormat::tiff);
  EXPECT_EQ(format_of("x.y.tiff").value(), FileFormat::tiff);
  EXPECT_EQ(format_of("x.Exr").value(), FileFormat::exr);
  EXPECT_EQ(format_of("x.PFM").value(), FileFormat::pfm);
}

TEST(FormatOf, OtherNamesAreAnErrorThatListsTheFormats) {
  for (const char* path : {"x.bmp", "x", "", "png", "a.png/x", ".png", "a/.png", "x.png ", "-"}) {
    const auto format = format_of(path);
    ASSERT_FALSE(format) << path;
    EXPECT_EQ(format.error().code, ErrorCode::invalid_argument);
    EXPECT_NE(format.error().message.find(".png, .jpg, .jpeg, .tif, .tiff, .exr or .pfm"), std::string::npos);
  }
}

TEST(CheckWritable, FormatsHoldTheSamplesTheyCan) {
  const auto held = [](FileFormat format) {
    std::string out;
    for (const SampleType type : {SampleType::u8, SampleType::u16, SampleType::f32}) {
      out += supported(format, type) ? 'y' : 'n';
    }
    return out;
  };
  EXPECT_EQ(held(FileFormat::png), "yyn");
  EXPECT_EQ(held(FileFormat::jpeg), "ynn");
  EXPECT_EQ(held(FileFormat::tiff), "yyy");
  EXPECT_EQ(held(FileFormat::exr), "nny");
  EXPECT_EQ(held(FileFormat::pfm), "nny");
}

TEST(CheckWritable, RefusalsNameAlternatives) {
  const auto exr = check_writable(FileFormat::exr, SampleType::u8, OutputSpace::linear_srgb);
  ASSERT_FALSE(exr);
  EXPECT_EQ(exr.error().message, "OpenEXR files hold floats, the image is 8-bit");
  const auto curve = check_writable(FileFormat::tiff, SampleType::f32, OutputSpace::srgb);
  ASSERT_FALSE(curve);
  EXPECT_NE(curve.error().message.find("linear-srgb"), std::string::npos);
  EXPECT_TRUE(check_writable(FileFormat::tiff, SampleType::f32, OutputSpace::camera));
  EXPECT_TRUE(check_writable(FileFormat::png, SampleType::u16, OutputSpace::srgb));
}

TEST(WritePicture, SamplesAFormatCannotHoldLeaveNoFile) {
  const ScratchDirectory scratch;
  EXPECT_FALSE(write({"", codes16, OutputSpace::srgb}, scratch.file("a.jpg")));
  EXPECT_FALSE(write({"", floats, OutputSpace::linear_srgb}, scratch.file("a.png")));
  EXPECT_FALSE(write({"", codes8, OutputSpace::linear_srgb}, scratch.file("a.exr")));
  EXPECT_TRUE(scratch.names().empty());
}

}  // namespace
}  // namespace lowlux::isp
