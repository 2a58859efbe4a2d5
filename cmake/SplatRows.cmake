# splat_row_table(<out.cpp> <namespace::Type> <function> <its.h> FILES <file>... [ROOT <folder>]): the function,
# declared in its header, gives pointers to all rows, each of which begins a line of the files: "const Type kFoo" of
# sources, or, with the folder from which they are included, "inline constexpr Type kFoo" of headers.
function(splat_row_table out row table header)
  cmake_parse_arguments(PARSE_ARGV 4 arg "" "ROOT" "FILES")
  set(root "")
  if(arg_ROOT)
    set(root -DROOT=${arg_ROOT})
  endif()
  add_custom_command(
    OUTPUT ${out}
    COMMAND ${CMAKE_COMMAND} -DROW=${row} -DTABLE=${table} "-DFILES=${arg_FILES}" -DHEADER=${header} ${root}
            -DOUT=${out} -P ${PROJECT_SOURCE_DIR}/cmake/RowTable.cmake
    DEPENDS ${arg_FILES} ${PROJECT_SOURCE_DIR}/cmake/RowTable.cmake
    COMMENT "Table of ${row}"
    VERBATIM)
endfunction()
