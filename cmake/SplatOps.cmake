# splat_op_table(<out.cpp> <source>...): op_table() of src/ops/op_table.h, of the rows that begin a line of the sources
# as "const OpRow kFooRow".
function(splat_op_table out)
  add_custom_command(
    OUTPUT ${out}
    COMMAND ${CMAKE_COMMAND} "-DSOURCES=${ARGN}" -DOUT=${out} -P ${PROJECT_SOURCE_DIR}/cmake/OpTable.cmake
    DEPENDS ${ARGN} ${PROJECT_SOURCE_DIR}/cmake/OpTable.cmake
    COMMENT "Table of operators"
    VERBATIM)
endfunction()
