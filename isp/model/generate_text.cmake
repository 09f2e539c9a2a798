# Turns a table with text in it into a C++ source that defines a function giving the file's text.
#   cmake -DCSV=<in> -DOUT=<out> -DNAME=<name> -P generate_text.cmake
file(READ "${CSV}" text)
if(text MATCHES "\\)csv\"")
  message(FATAL_ERROR "${CSV}: holds the end mark of a raw string")
endif()
file(WRITE "${OUT}.new" "// Generated from isp/model/data/${NAME}.csv.
#include \"isp/model/text_table.h\"

namespace lowlux::isp {

std::string_view ${NAME}_text() { return R\"csv(${text})csv\"; }

}  // namespace lowlux::isp
")
file(RENAME "${OUT}.new" "${OUT}")
