# Flags and functions shared by all targets.

# Warnings; sanitizers and coverage as the options say.
function(splat_compile_options target)
  if(MSVC)
    # 4996: functions of C that Microsoft holds for unsafe; 4324: structs padded as alignas says.
    target_compile_options(${target} PRIVATE /W4 /wd4996 /wd4324)
  else()
    target_compile_options(${target} PRIVATE -Wall -Wextra -Wshadow -Wconversion -Wdouble-promotion)
  endif()
  if(SPLAT_WERROR)
    target_compile_options(${target} PRIVATE $<IF:$<BOOL:${MSVC}>,/WX,-Werror>)
  endif()
  # gcc 12 warns of its own std::string (https://gcc.gnu.org/PR105651).
  if(CMAKE_CXX_COMPILER_ID STREQUAL GNU AND CMAKE_CXX_COMPILER_VERSION VERSION_LESS 13)
    target_compile_options(${target} PRIVATE $<$<COMPILE_LANGUAGE:CXX>:-Wno-restrict>)
  endif()
  if(SPLAT_SANITIZE)
    target_compile_options(${target} PRIVATE -fsanitize=${SPLAT_SANITIZE} -fno-omit-frame-pointer
                                             -fno-sanitize-recover=all)
    target_link_options(${target} PRIVATE -fsanitize=${SPLAT_SANITIZE})
  endif()
  if(SPLAT_COVERAGE)
    target_compile_options(${target} PRIVATE --coverage)
    target_link_options(${target} PRIVATE --coverage)
  endif()
endfunction()

# splat_layer(<name> SOURCES <file>... USES <layer>...)
#
# One static library per folder of src/. The headers of a layer are included through a folder that holds
# only a link to them, so `#include "vk/device.h"` does not compile in a layer that does not use vk.
function(splat_layer name)
  cmake_parse_arguments(ARG "" "FOLDER" "SOURCES;USES" ${ARGN})
  set(folder ${name})
  if(ARG_FOLDER)
    set(folder ${ARG_FOLDER})
  endif()
  set(view ${PROJECT_BINARY_DIR}/layers/${name})
  if(CMAKE_HOST_WIN32)  # whose users may not make symbolic links
    set(view ${CMAKE_CURRENT_SOURCE_DIR})
  else()
    get_filename_component(parent ${view}/${folder} DIRECTORY)
    file(MAKE_DIRECTORY ${parent})
    file(CREATE_LINK ${CMAKE_CURRENT_SOURCE_DIR}/${folder} ${view}/${folder} SYMBOLIC)
  endif()
  list(TRANSFORM ARG_SOURCES PREPEND ${folder}/)
  add_library(splat_${name} STATIC ${ARG_SOURCES})
  target_include_directories(splat_${name} PUBLIC ${view})
  list(TRANSFORM ARG_USES PREPEND splat_)
  target_link_libraries(splat_${name} PUBLIC ${ARG_USES})
  target_compile_definitions(splat_${name} PUBLIC SPLAT_FAULT_POINTS=$<BOOL:${SPLAT_FAULT_POINTS}>)
  splat_compile_options(splat_${name})
endfunction()
