# Writes OUT, the source of lowlux_module_stamp: VERSION and a hash of all headers and of BUILD, a hash of compiler and
# flags. They stand for the layout of all that the command and its modules hand to each other.
# cmake -DSOURCE_DIR=... -DVERSION=... -DBUILD=... -DOUT=... -P module_stamp.cmake
file(GLOB_RECURSE headers RELATIVE ${SOURCE_DIR}
  ${SOURCE_DIR}/isp/*.h ${SOURCE_DIR}/capture/*.h ${SOURCE_DIR}/calib/*.h ${SOURCE_DIR}/denoise/*.h)
list(SORT headers)
set(hashes ${BUILD})
foreach(header IN LISTS headers)
  file(SHA256 ${SOURCE_DIR}/${header} hash)
  string(APPEND hashes ${header} ${hash})
endforeach()
string(SHA256 hash "${hashes}")
file(WRITE ${OUT} "extern \"C\" {\nextern const char lowlux_module_stamp[];\nconst char lowlux_module_stamp[] = \"${VERSION} ${hash}\";\n}\n")
