/* Runs a stage over raw frames in files, with the settings of isp/adapter/examples/libcamera-softisp.patch and the
 * figures that the patched libcamera reported for each frame: what the patched libcamera has to deliver, byte for byte.
 *
 *   replay_stage LIBRARY WIDTH HEIGHT OUT_WIDTH OUT_HEIGHT OUT_STRIDE < frames
 *
 * Input: SRGGB10 without padding. A line for each frame, in order: RAW IMAGE SEQUENCE TIMESTAMP BLACK_R BLACK_G BLACK_B
 * GAIN_R GAIN_B EXPOSURE_EV, where IMAGE is the file to write: BGR888. A black level or gain of 0 is not known. */
#include <dlfcn.h>
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "lowlux_stage.h"

static struct {
  int (*open)(const lowlux_stage_settings*, lowlux_stage**, char*, size_t);
  int (*configure)(lowlux_stage*, const lowlux_stage_input*, lowlux_stage_output*);
  int (*process)(lowlux_stage*, const lowlux_stage_source*, const lowlux_stage_picture*, const lowlux_stage_params*,
                 lowlux_stage_result*, lowlux_stage_statistics*);
  void (*release)(lowlux_stage*);
  const char* (*last_error)(const lowlux_stage*);
} lowlux;

static void fail(const char* what, const char* why) {
  fprintf(stderr, "replay_stage: %s: %s\n", what, why);
  exit(1);
}

static void find(void* library, const char* name, void* function) {
  void* const symbol = dlsym(library, name);
  if (symbol == NULL) fail(name, dlerror());
  memcpy(function, &symbol, sizeof symbol);
}

static void load(const char* file) {
  void* const library = dlopen(file, RTLD_NOW | RTLD_LOCAL);
  if (library == NULL) fail(file, dlerror());
  find(library, "lowlux_stage_open", &lowlux.open);
  find(library, "lowlux_stage_configure", &lowlux.configure);
  find(library, "lowlux_stage_process", &lowlux.process);
  find(library, "lowlux_stage_release", &lowlux.release);
  find(library, "lowlux_stage_last_error", &lowlux.last_error);
}

/* Reads or writes a whole file of a known size. */
static void transfer(const char* name, const char* mode, void* data, size_t size) {
  FILE* const file = fopen(name, mode);
  if (file == NULL) fail(name, "cannot be opened");
  const size_t done = mode[0] == 'r' ? fread(data, 1, size, file) : fwrite(data, 1, size, file);
  if (fclose(file) != 0 || done != size) fail(name, "is not of the expected size");
}

static lowlux_stage* opened(const lowlux_stage_input* in, lowlux_stage_output* out) {
  lowlux_stage_settings settings = {.size = sizeof settings};
  settings.most_denoise = LOWLUX_STAGE_LEVEL_STANDARD;
  settings.temporal = 1;
  settings.tone = 1;
  lowlux_stage* stage = NULL;
  char why[200];
  if (lowlux.open(&settings, &stage, why, sizeof why) < 0) fail("open", why);
  if (lowlux.configure(stage, in, out) != LOWLUX_STAGE_OK) fail("configure", lowlux.last_error(stage));
  return stage;
}

static lowlux_stage_params known(uint32_t sequence, uint64_t timestamp_ns, const float* black, const float* gains) {
  lowlux_stage_params params = {.size = sizeof params};
  params.valid = LOWLUX_STAGE_HAS_SEQUENCE | LOWLUX_STAGE_HAS_TIMESTAMP;
  params.sequence = sequence;
  params.timestamp_ns = timestamp_ns;
  if (black[1] > 0) {
    params.valid |= LOWLUX_STAGE_HAS_BLACK;
    const float order[4] = {black[0], black[1], black[1], black[2]};
    memcpy(params.black_level, order, sizeof order);
  }
  if (gains[0] > 0 && gains[1] > 0) {
    params.valid |= LOWLUX_STAGE_HAS_COLOUR_GAINS;
    memcpy(params.colour_gains, gains, sizeof params.colour_gains);
  }
  return params;
}

int main(int argc, char** argv) {
  if (argc != 7) fail("usage", "replay_stage LIBRARY WIDTH HEIGHT OUT_WIDTH OUT_HEIGHT OUT_STRIDE < frames");
  load(argv[1]);
  lowlux_stage_input in = {.size = sizeof in, .api = LOWLUX_STAGE_V4L2};
  in.fourcc = LOWLUX_STAGE_FOURCC('R', 'G', '1', '0');
  in.width = atoi(argv[2]);
  in.height = atoi(argv[3]);
  in.stride = 2 * (size_t)in.width;
  in.crop.width = atoi(argv[4]);
  in.crop.height = atoi(argv[5]);
  in.crop.x = (in.width - in.crop.width) / 2 & ~1; /* libcamera's window */
  in.crop.y = (in.height - in.crop.height) / 2 & ~1;
  lowlux_stage_output out = {.size = sizeof out, .fourcc = LOWLUX_STAGE_BGR888};
  out.stride[0] = (size_t)atoi(argv[6]);
  lowlux_stage* const stage = opened(&in, &out);
  const size_t raw_bytes = in.stride * (size_t)in.height;
  unsigned char* const raw = malloc(raw_bytes);
  unsigned char* const image = calloc(1, out.bytes[0]);
  if (raw == NULL || image == NULL) fail("memory", "none");

  char raw_name[256];
  char image_name[256];
  uint32_t sequence;
  uint64_t timestamp_ns;
  float black[3];
  float gains[2];
  float exposure_ev; /* a result: compared by way of the image */
  while (scanf("%255s %255s %" SCNu32 " %" SCNu64 " %f %f %f %f %f %f", raw_name, image_name, &sequence, &timestamp_ns,
               &black[0], &black[1], &black[2], &gains[0], &gains[1], &exposure_ev) == 10) {
    transfer(raw_name, "rb", raw, raw_bytes);
    const lowlux_stage_source source = {.data = raw, .length = raw_bytes, .stride = in.stride, .fd = -1};
    lowlux_stage_picture planes = {.size = sizeof planes, .planes = 1};
    planes.plane[0] = (lowlux_stage_plane){.data = image, .length = out.bytes[0], .stride = out.stride[0]};
    const lowlux_stage_params params = known(sequence, timestamp_ns, black, gains);
    if (lowlux.process(stage, &source, &planes, &params, NULL, NULL) < 0) fail(raw_name, lowlux.last_error(stage));
    transfer(image_name, "wb", image, out.bytes[0]);
  }
  lowlux.release(stage);
  free(raw);
  free(image);
  return 0;
}
