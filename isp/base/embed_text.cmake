# Turns a text file into a C++ source that defines a function of lowlux::isp, declared in a header, which returns it.
#   cmake -DIN=<in> -DOUT=<out> -DNAME=<function> -DHEADER=<header> -P embed_text.cmake
# As bytes: compilers limit the length of string literals.
file(READ "${IN}" bytes HEX)
string(REGEX REPLACE "([0-9a-f][0-9a-f])" "'\\\\x\\1'," bytes "${bytes}")
string(REGEX REPLACE "(('[^']*',)('[^']*',)('[^']*',)('[^']*',)('[^']*',)('[^']*',)('[^']*',)('[^']*',))" "\\1\n" bytes
  "${bytes}")
file(WRITE "${OUT}.new" "// Generated from ${NAME}'s file.
#include \"${HEADER}\"

namespace lowlux::isp {
std::string_view ${NAME}() {
  static constexpr char text[] = {
${bytes}
  };
  return {text, sizeof(text)};
}

}  // namespace lowlux::isp
")
file(RENAME "${OUT}.new" "${OUT}")
