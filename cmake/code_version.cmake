# cmake -DOUT=FILE -DSOURCES="a;b;…" -P code_version.cmake: a source that holds the hash of what the sources hold.
set(all "")
foreach(source ${SOURCES})
  file(SHA256 ${source} hash)
  string(APPEND all "${hash}\n")
endforeach()
string(SHA256 version "${all}")
set(text "#include \"estimate/kept_input.h\"\n\nnamespace selvedge::estimate {\n\n\
const char* code_version() { return \"${version}\"; }\n\n}  // namespace selvedge::estimate\n")
file(WRITE ${OUT} "${text}")
