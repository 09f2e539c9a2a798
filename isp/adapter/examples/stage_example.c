/* Processes one raw frame with lowlux's stage, from C99, with the library loaded by name.
 *
 *   cc -std=c99 stage_example.c -o stage_example $(pkg-config --cflags lowlux_stage) -ldl -lm
 *   ./stage_example LIBRARY PICTURE.ppm      e.g. ./stage_example liblowlux_stage.so.0 night.ppm
 *
 * The frame is simulated: 10-bit words in the order RGGB, as a V4L2 driver delivers them (RG10), of a dim scene that
 * becomes brighter to the right, with a black level of 64, shot noise, and 2 DN of read noise. With a camera, `frame`
 * is the memory of a dequeued buffer, and `stride` the driver's bytesperline. */
#include <dlfcn.h>
#include <lowlux/lowlux_stage.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { WIDTH = 640, HEIGHT = 480 };

/* The functions of the library. POSIX allows converting an object pointer to a function pointer through memory. */
static struct {
  int (*open)(const lowlux_stage_settings*, lowlux_stage**, char*, size_t);
  int (*configure)(lowlux_stage*, const lowlux_stage_input*, lowlux_stage_output*);
  int (*process)(lowlux_stage*, const lowlux_stage_source*, const lowlux_stage_picture*, const lowlux_stage_params*,
                 lowlux_stage_result*, lowlux_stage_statistics*);
  void (*release)(lowlux_stage*);
  const char* (*last_error)(const lowlux_stage*);
} lowlux;

static void find(void* library, const char* name, void* function) {
  void* const symbol = dlsym(library, name);
  if (symbol == NULL) {
    fprintf(stderr, "no function %s\n", name);
    exit(1);
  }
  memcpy(function, &symbol, sizeof symbol);
}

static void load(const char* file) {
  void* const library = dlopen(file, RTLD_NOW | RTLD_LOCAL);
  if (library == NULL) {
    fprintf(stderr, "%s\n", dlerror());
    exit(1);
  }
  find(library, "lowlux_stage_open", &lowlux.open);
  find(library, "lowlux_stage_configure", &lowlux.configure);
  find(library, "lowlux_stage_process", &lowlux.process);
  find(library, "lowlux_stage_release", &lowlux.release);
  find(library, "lowlux_stage_last_error", &lowlux.last_error);
}

/* Returns an approximately normal deviate of mean 0 and variance 1: the sum of twelve uniform ones, minus 6. */
static double noise(void) {
  double sum = -6;
  for (int i = 0; i < 12; ++i) sum += rand() / (RAND_MAX + 1.0);
  return sum;
}

static void expose(unsigned char* frame, size_t stride) {
  for (int y = 0; y < HEIGHT; ++y) {
    for (int x = 0; x < WIDTH; ++x) {
      const double share = (x & 1) == (y & 1) ? 0.55 : 1.0; /* red and blue get less light than green */
      const double light = share * 120.0 * x / WIDTH * (y < HEIGHT / 2 ? 1 : 0.5);
      const double dn = 64 + light + sqrt(light + 4) * noise();
      const int code = dn < 0 ? 0 : dn > 1023 ? 1023 : (int)(dn + 0.5);
      frame[stride * (size_t)y + 2 * (size_t)x] = (unsigned char)(code & 255);
      frame[stride * (size_t)y + 2 * (size_t)x + 1] = (unsigned char)(code >> 8);
    }
  }
}

int main(int argc, char** argv) {
  if (argc != 3) {
    fprintf(stderr, "usage: stage_example LIBRARY PICTURE.ppm\n");
    return 2;
  }
  load(argv[1]);

  /* Every struct begins with its size; members that are 0 have their default or are absent. */
  lowlux_stage_settings settings = {.size = sizeof settings};
  settings.threads = 2;
  settings.most_denoise = LOWLUX_STAGE_LEVEL_STANDARD;
  settings.tone = 1;
  lowlux_stage* stage = NULL;
  char why[200];
  if (lowlux.open(&settings, &stage, why, sizeof why) < 0) {
    fprintf(stderr, "%s\n", why);
    return 1;
  }

  /* Once for each stream: the formats of input and output. All memory is allocated here. */
  lowlux_stage_input in = {.size = sizeof in, .api = LOWLUX_STAGE_V4L2};
  in.fourcc = LOWLUX_STAGE_FOURCC('R', 'G', '1', '0');
  in.width = WIDTH;
  in.height = HEIGHT;
  in.stride = 2 * WIDTH;
  lowlux_stage_output out = {.size = sizeof out, .fourcc = LOWLUX_STAGE_BGR888}; /* R G B in memory */
  if (lowlux.configure(stage, &in, &out) < 0) {
    fprintf(stderr, "%s\n", lowlux.last_error(stage));
    return 1;
  }
  unsigned char* const frame = malloc(in.stride * HEIGHT);
  unsigned char* const picture = malloc(out.bytes[0]);
  if (frame == NULL || picture == NULL) return 1;
  expose(frame, in.stride);

  /* For every frame: its memory and its known parameters. White balance, exposure and noise are not given here, so they
   * are measured. */
  const lowlux_stage_source source = {.data = frame, .length = in.stride * HEIGHT, .stride = in.stride, .fd = -1};
  lowlux_stage_picture planes = {.size = sizeof planes, .planes = 1};
  planes.plane[0].data = picture;
  planes.plane[0].length = out.bytes[0];
  planes.plane[0].stride = out.stride[0];
  lowlux_stage_params params = {.size = sizeof params, .valid = LOWLUX_STAGE_HAS_BLACK};
  for (int i = 0; i < 4; ++i) params.black_level[i] = 64;
  lowlux_stage_result result = {.size = sizeof result};
  if (lowlux.process(stage, &source, &planes, &params, &result, NULL) < 0) {
    fprintf(stderr, "%s\n", lowlux.last_error(stage));
    return 1;
  }
  printf("%d x %d, exposure %+.1f EV, noise %.2f DN/e-, level %d\n", out.width, out.height, result.exposure_ev,
         result.noise_gain, result.level);

  FILE* const file = fopen(argv[2], "wb");
  if (file == NULL) {
    perror(argv[2]);
    return 1;
  }
  fprintf(file, "P6\n%d %d\n255\n", out.width, out.height);
  const size_t written = fwrite(picture, 1, out.bytes[0], file);
  const int closed = fclose(file);
  lowlux.release(stage);
  free(frame);
  free(picture);
  return written == out.bytes[0] && closed == 0 ? 0 : 1;
}
