// The program lowlux-decode-jxl: see decoder_process.h.
#include "capture/decoder/decoder_program.h"
#include "capture/decoder/jpeg_xl_decoder.h"

int main(int count, char** arguments) {
  lowlux::capture::run_decoder(std::span(arguments, static_cast<std::size_t>(count)),
                               lowlux::capture::decode_with_libjxl);
}
