#include "capture/libcamera/libcamera_module.h"

#include <cstdlib>

#include <dlfcn.h>
#include <gtest/gtest.h>

namespace lowlux::capture {
namespace {

/// The module as the command loads it; null where this build has none.
const LibcameraModule* the_module() {
#ifdef LOWLUX_LIBCAMERA_MODULE
  void* loaded = dlopen(LOWLUX_LIBCAMERA_MODULE, RTLD_NOW | RTLD_LOCAL);
  if (loaded == nullptr) {
    ADD_FAILURE() << dlerror();  // NOLINT(concurrency-mt-unsafe): glibc keeps one for each thread
    return nullptr;
  }
  void* found = dlsym(loaded, libcamera_module_name);
  if (found == nullptr) {
    ADD_FAILURE() << libcamera_module_name << " is not exported";
    return nullptr;
  }
  return reinterpret_cast<GetLibcameraModule*>(found)();
#else
  return nullptr;
#endif
}

class LibcameraModuleTest : public testing::Test {
 protected:
  void SetUp() override {
    if (module_ == nullptr) GTEST_SKIP() << "built without libcamera";
  }
  const LibcameraModule* module_ = the_module();
};

TEST_F(LibcameraModuleTest, ListsWhatThereIsAgainAndAgainInSilence) {
  for (const char* name : {"LIBCAMERA_LOG_LEVELS", "LIBCAMERA_LOG_FILE"}) {
    ASSERT_EQ(unsetenv(name), 0);  // NOLINT(concurrency-mt-unsafe): no other thread yet
  }
  testing::internal::CaptureStderr();
  for (int i = 0; i < 3; ++i) {
    const auto cameras = module_->list();
    ASSERT_TRUE(cameras) << cameras.error().message;
    for (const CameraListing& camera : *cameras) EXPECT_FALSE(camera.id.empty());
  }
  EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
}

TEST_F(LibcameraModuleTest, ACameraThatIsNotThereIsNotFound) {
  const auto camera = module_->open("no camera has this name", {});
  ASSERT_FALSE(camera);
  EXPECT_EQ(camera.error().code, ErrorCode::not_found);
  EXPECT_EQ(camera.error().where, "no camera has this name");
}

TEST_F(LibcameraModuleTest, ARequestThatMakesNoSenseIsRefusedBeforeCamerasAreLookedFor) {
  const auto camera = module_->open("", {.buffers = 1});
  ASSERT_FALSE(camera);
  EXPECT_EQ(camera.error().code, ErrorCode::invalid_argument);
}

}  // namespace
}  // namespace lowlux::capture
