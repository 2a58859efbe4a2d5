# cmake -DROW=<namespace::Type> -DTABLE=<function> "-DFILES=<a.cpp;b.cpp...>" -DHEADER=<its.h> [-DROOT=<folder>]
# -DOUT=<out.cpp> -P RowTable.cmake: see splat_row_table.
string(REGEX MATCH "^(.*)::([A-Za-z0-9]+)$" _ "${ROW}")
set(namespace ${CMAKE_MATCH_1})
set(type ${CMAKE_MATCH_2})
set(rows "")
set(includes "#include \"${HEADER}\"\n")
foreach(file IN LISTS FILES)
  file(STRINGS ${file} found REGEX "^(inline constexpr|const|extern const) ${type} k[A-Za-z0-9]+")
  foreach(line IN LISTS found)
    string(REGEX REPLACE "^[a-z ]* ${type} (k[A-Za-z0-9]+).*" "\\1" row "${line}")
    list(APPEND rows ${row})
  endforeach()
  if(found AND DEFINED ROOT)
    file(RELATIVE_PATH header ${ROOT} ${file})
    string(APPEND includes "#include \"${header}\"\n")
  endif()
endforeach()
list(SORT rows)
list(JOIN rows ", &" table)
list(JOIN rows ", " names)
set(declared "extern const ${type} ${names};\n\n")
if(DEFINED ROOT)
  set(declared "")
endif()
file(WRITE ${OUT} "${includes}
namespace ${namespace} {

${declared}std::span<const ${type}* const> ${TABLE}() {
    static constexpr const ${type}* kRows[] = {&${table}};
    return kRows;
}

}  // namespace ${namespace}
")
