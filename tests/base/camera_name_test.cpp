#include "isp/base/camera_profile.h"

#include <gtest/gtest.h>

#include <array>
#include <cstddef>
#include <string>

namespace lowlux {
namespace {

TEST(CameraName, NamesTheMakeOnce) {
  EXPECT_EQ(camera_name("Canon", "Canon EOS Kiss X4"), "Canon EOS Kiss X4");
  EXPECT_EQ(camera_name("NIKON CORPORATION", "NIKON D750"), "NIKON D750");
  EXPECT_EQ(camera_name("Nikon Corporation", "NIKON D750"), "NIKON D750");
  EXPECT_EQ(camera_name("Nokia", "RX-51"), "Nokia RX-51");
  EXPECT_EQ(camera_name("Canon", "CanonScan"), "Canon CanonScan");  // another word that begins alike
  EXPECT_EQ(camera_name("Leica", "Leica"), "Leica Leica");          // no model is left without the make
  EXPECT_EQ(camera_name("", "RX-51"), "RX-51");
  EXPECT_EQ(camera_name("Nokia", ""), "Nokia");
  EXPECT_EQ(camera_name("", ""), "");
}

// Names as files have them and as LibRaw shortens them, and of other cameras.
TEST(CameraName, FilesAndDecodersNameTheSameCamera) {
  const std::array<std::array<CameraName, 2>, 9> cameras{{
      {{{"Canon", "Canon EOS D30"}, {"Canon", "EOS D30"}}},
      {{{"NIKON CORPORATION", "NIKON D750"}, {"Nikon", "D750"}}},
      {{{"SONY", "ILCE-7M3"}, {"Sony", "ILCE-7M3"}}},
      {{{"OLYMPUS IMAGING CORP.", "E-M5"}, {"Olympus", "E-M5"}}},
      {{{"FUJIFILM", "FinePix S5Pro"}, {"Fujifilm", "S5Pro"}}},
      {{{"RICOH IMAGING COMPANY, LTD.", "PENTAX K-1"}, {"Pentax", "K-1"}}},
      {{{"LEICA CAMERA AG", "LEICA Q (Typ 116)"}, {"Leica", "Q (Typ 116)"}}},
      {{{"EASTMAN KODAK COMPANY", "KODAK Z1015 IS DIGITAL CAMERA"}, {"Kodak", "Z1015 IS"}}},
      {{{"Canon", "Canon EOS R"}, {"Canon", "EOS R"}}},
  }};
  for (std::size_t i = 0; i < cameras.size(); ++i) {
    for (std::size_t j = 0; j < cameras.size(); ++j) {
      for (const CameraName& one : cameras[i]) {
        for (const CameraName& other : cameras[j]) {
          EXPECT_EQ(is_same_camera(one, other), i == j) << one.model << " and " << other.model;
        }
      }
    }
  }
  EXPECT_FALSE(is_same_camera({"Canon", "Canon EOS R"}, {"Canon", "EOS R5"}));
  EXPECT_FALSE(is_same_camera({"Canon", "Canon EOS 5D"}, {"Canon", "D"}));
  EXPECT_FALSE(is_same_camera({"Acme", "One"}, {"Other", "One"}));
}

TEST(CameraName, MissingNamesAgreeWithAnyWhereNamesMayBeIncomplete) {
  const CameraName full{"Canon", "EOS R"};
  EXPECT_TRUE(is_same_camera({}, {}));
  for (const CameraName& part : {CameraName{}, CameraName{"Canon", ""}, CameraName{"", "Canon EOS R"}}) {
    EXPECT_FALSE(is_same_camera(part, full)) << part.make << part.model;
    EXPECT_FALSE(is_same_camera(full, part)) << part.make << part.model;
    EXPECT_TRUE(may_be_same_camera(part, full)) << part.make << part.model;
    EXPECT_TRUE(may_be_same_camera(full, part)) << part.make << part.model;
  }
  EXPECT_FALSE(may_be_same_camera({"Nikon", ""}, full));
  EXPECT_FALSE(may_be_same_camera({"", "EOS R5"}, full));
  EXPECT_FALSE(is_same_camera({"Acme", " digital camera"}, full));
}

// Searching one in the other would take days.
TEST(CameraName, NamesOfMegabytesAreComparedAtOnce) {
  const std::string make(8'000'000, 'a'), other = std::string(4'000'000, 'a') + 'b';
  EXPECT_FALSE(is_same_camera({make, "One"}, {other, "One"}));
  EXPECT_TRUE(is_same_camera({make, "One"}, {make, "One"}));
}

}  // namespace
}  // namespace lowlux
