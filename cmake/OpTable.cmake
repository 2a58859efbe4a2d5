# cmake "-DSOURCES=<a.cpp;b.cpp...>" -DOUT=<out.cpp> -P OpTable.cmake: see splat_op_table.
set(rows "")
foreach(source IN LISTS SOURCES)
  file(STRINGS ${source} found REGEX "^const OpRow k[A-Za-z0-9]+Row ")
  list(APPEND rows ${found})
endforeach()
list(TRANSFORM rows REPLACE "^const OpRow (k[A-Za-z0-9]+Row) .*" "\\1")
list(SORT rows)
list(JOIN rows ", &" table)
list(JOIN rows ", " declared)
file(WRITE ${OUT} "#include \"ops/op_table.h\"

namespace splat::ops {

extern const OpRow ${declared};

std::span<const OpRow* const> op_table() {
    static constexpr const OpRow* kOps[] = {&${table}};
    return kOps;
}

}  // namespace splat::ops
")
