#include "isp/base/camera_profile.h"

#include <gtest/gtest.h>

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

}  // namespace
}  // namespace lowlux
