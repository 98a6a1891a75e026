# selvedge_messages(FOLDER HEADERS): C++ for the messages of the bus, as FOLDER/selvedge_rig/NAME.hpp; their paths into
# the variable HEADERS. lcm-gen's decoder believes the array size that a message states; the sed makes it check that
# size against what was received before it allocates. A text has at least its end's zero: without that check a length of
# -2^31 reads 2 GiB beyond the message.
set(selvedge_messages_from ${CMAKE_CURRENT_LIST_DIR}/messages)
find_program(LCM_GEN lcm-gen REQUIRED)
function(selvedge_messages folder headers)
  file(GLOB message_files CONFIGURE_DEPENDS ${selvedge_messages_from}/*.lcm)
  foreach(message_file ${message_files})
    get_filename_component(message ${message_file} NAME_WE)
    set(header ${folder}/selvedge_rig/${message}.hpp)
    add_custom_command(
      OUTPUT ${header}
      COMMAND ${LCM_GEN} -x --cpp-std c++11 --cpp-hpath ${folder} ${message_file}
      COMMAND sed -i -E
        -e "s|\\.resize\\((this->[a-z_]+)\\)|.resize(selvedge::rig::bounded_size(\\1, maxlen - pos))|"
        -e "s/if\\((__[a-z_]+) > maxlen - pos\\)/if(\\1 < 1 || \\1 > maxlen - pos)/"
        -e "s|^#include <lcm/lcm_coretypes.h>|&\\n#include \"rig/messages/bounded_size.h\"|" ${header}
      DEPENDS ${message_file}
      COMMENT "lcm-gen ${message}.lcm" VERBATIM)
    list(APPEND made ${header})
  endforeach()
  set(${headers} ${made} PARENT_SCOPE)
endfunction()
