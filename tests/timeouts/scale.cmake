# Run by ctest when it starts, after the list that CMakeLists.txt writes (splat_timeouts: name=seconds). It
# multiplies the timeout of each test by SPLAT_TIMEOUT_SCALE times (1 + load / processors), and sets the same
# factor for the waits of programs for a device. Neither number is known at configure time. The load is
# that of the last minute, or of this moment if that is more; load that begins later does not count.

# Thousandths of a decimal number; empty for any other text.
function(splat_thousandths out text)
  set(${out} "" PARENT_SCOPE)
  if(NOT text STREQUAL "." AND text MATCHES "^([0-9]*)[.]?([0-9]*)$")
    string(SUBSTRING "${CMAKE_MATCH_2}000" 0 3 fraction)
    math(EXPR value "${CMAKE_MATCH_1}0 / 10 * 1000 + 1${fraction} - 1000")
    set(${out} ${value} PARENT_SCOPE)
  endif()
endfunction()

function(splat_load_factor out)
  set(${out} 1000 PARENT_SCOPE)
  if(NOT EXISTS /proc/loadavg)
    return()
  endif()
  cmake_host_system_information(RESULT processors QUERY NUMBER_OF_LOGICAL_CORES)
  file(STRINGS /proc/loadavg text LIMIT_COUNT 1)
  if(NOT text MATCHES "^([0-9.]+) [^/]* ([0-9]+)/")
    return()
  endif()
  math(EXPR load "${CMAKE_MATCH_2} * 1000 - 1000") # without ctest itself
  splat_thousandths(average ${CMAKE_MATCH_1})
  if(average GREATER load)
    set(load ${average})
  endif()
  math(EXPR factor "1000 + ${load} / ${processors}")
  set(${out} ${factor} PARENT_SCOPE)
endfunction()

set(splat_scale 1000)
if(NOT "$ENV{SPLAT_TIMEOUT_SCALE}" STREQUAL "")
  splat_thousandths(splat_scale "$ENV{SPLAT_TIMEOUT_SCALE}")
endif()
if(splat_scale)
  splat_load_factor(splat_load)
  math(EXPR splat_scale "${splat_scale} * ${splat_load} / 1000")
  math(EXPR splat_wait_scale "${splat_scale} * ${splat_base_scale}")
  math(EXPR splat_whole "${splat_wait_scale} / 1000")
  math(EXPR splat_fraction "${splat_wait_scale} % 1000 + 1000")
  string(SUBSTRING ${splat_fraction} 1 3 splat_fraction)
  foreach(splat_test IN LISTS house_test_TESTS) # discovered after the build
    list(APPEND splat_timeouts ${splat_test}=${splat_house_timeout})
  endforeach()
  foreach(splat_test IN LISTS splat_timeouts)
    string(REGEX REPLACE "=[0-9]+$" "" splat_name ${splat_test})
    string(REGEX REPLACE ".*=" "" splat_seconds ${splat_test})
    math(EXPR splat_seconds "${splat_seconds} * ${splat_scale} / 1000")
    set_tests_properties(${splat_name} PROPERTIES TIMEOUT ${splat_seconds})
    list(FIND splat_own_scales ${splat_name} splat_found)
    if(splat_found LESS 0)
      set_tests_properties(${splat_name} PROPERTIES ENVIRONMENT_MODIFICATION
                           SPLAT_TIMEOUT_SCALE=set:${splat_whole}.${splat_fraction})
    endif()
  endforeach()
  message(NOTICE "Timeouts of tests and waits: times ${splat_whole}.${splat_fraction} "
                 "(SPLAT_TIMEOUT_SCALE and the machine's load)")
else()
  message(NOTICE "SPLAT_TIMEOUT_SCALE=$ENV{SPLAT_TIMEOUT_SCALE} is not a positive decimal number: "
                 "timeouts of tests stay")
endif()
