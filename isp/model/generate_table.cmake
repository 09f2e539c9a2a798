# Turns a table of isp/model/data into a C++ source that defines its function of cie_table.h.
#   cmake -DCSV=<in> -DOUT=<out> -DNAME=<name> -P generate_table.cmake
# A table is lines starting with '#', then one line of column names, then lines of numbers, without empty cells.
file(STRINGS "${CSV}" lines REGEX "^[^#]")
list(POP_FRONT lines header)
string(REPLACE "," "\", \"" columns "${header}")
list(TRANSFORM lines APPEND ",")
list(JOIN lines "\n    " cells)
if(cells MATCHES ",," OR NOT cells MATCHES "^[-+0-9.eE, \n]+$")
  message(FATAL_ERROR "${CSV}: a cell is empty or not a number")
endif()
file(WRITE "${OUT}.new" "// Generated from isp/model/data/${NAME}.csv.
#include \"isp/model/spectrum/cie_data.h\"

namespace lowlux::isp {
CieTable ${NAME}_table() {
  static constexpr std::string_view columns[] = {\"${columns}\"};
  static constexpr double cells[] = {
    ${cells}
  };
  static_assert(sizeof(cells) / sizeof(double) % (sizeof(columns) / sizeof(std::string_view)) == 0);
  return {columns, cells};
}

}  // namespace lowlux::isp
")
file(RENAME "${OUT}.new" "${OUT}")
