#pragma once

#include <string>
#include <string_view>

namespace lowlux {

/// A camera as people name it: "Canon EOS 550D" of the make "Canon" and the model "Canon EOS 550D", "NIKON D750" of
/// "NIKON CORPORATION", "Nokia RX-51" of "Nokia" and "RX-51".
std::string camera_name(std::string_view make, std::string_view model);

}  // namespace lowlux
