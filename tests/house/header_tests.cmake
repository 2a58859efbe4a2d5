# The public headers compile in every language that they support, with both compilers, without warnings and
# without padding in its structs. Samples that break a rule must not compile.

set(c_standards c99 c11 c17)
set(cxx_standards c++11 c++14 c++17 c++20)
set(flags -pedantic -Wall -Wextra -Wpadded -Werror -c -o /dev/null -I${PROJECT_SOURCE_DIR}/include)
set(refused ${CMAKE_CURRENT_SOURCE_DIR}/refused)

find_program(SPLAT_GCC gcc)
find_program(SPLAT_CLANG clang)

# header_test(<name> <compiler> <language> <standard> <source> [refused])
function(header_test name compiler language standard source)
  add_test(NAME ${name} COMMAND ${compiler} -x ${language} -std=${standard} ${flags} ${source})
  splat_test_properties(${name} LABEL quick TIMEOUT 60)
  if(ARGN)
    set_tests_properties(${name} PROPERTIES PASS_REGULAR_EXPRESSION "${ARGN}")
  endif()
endfunction()

foreach(compiler IN ITEMS gcc clang)
  string(TOUPPER SPLAT_${compiler} program)
  if(NOT ${program})
    add_test(NAME Header.${compiler}_is_missing COMMAND ${CMAKE_COMMAND} -E echo "no ${compiler} here")
    splat_test_properties(Header.${compiler}_is_missing LABEL quick TIMEOUT 60)
    set_tests_properties(Header.${compiler}_is_missing PROPERTIES SKIP_REGULAR_EXPRESSION "no ${compiler} here")
    continue()
  endif()
  foreach(standard IN LISTS c_standards)
    header_test(Header.${compiler}_${standard} ${${program}} c ${standard}
                ${CMAKE_CURRENT_SOURCE_DIR}/header_unit.c)
  endforeach()
  foreach(standard IN LISTS cxx_standards)
    header_test(Header.${compiler}_${standard} ${${program}} c++ ${standard}
                ${CMAKE_CURRENT_SOURCE_DIR}/header_unit.c)
  endforeach()
  foreach(header IN ITEMS core scene render model predict priors train evaluate)
    header_test(Header.${compiler}_${header}_alone ${${program}} c c99
                ${PROJECT_SOURCE_DIR}/include/splat/${header}.h)
  endforeach()
  header_test(Header.${compiler}_refuses_padding ${${program}} c c99 ${refused}/padding.c
              "error: .*padd")
  header_test(Header.${compiler}_refuses_later_c ${${program}} c c99 ${refused}/later_c.c
              "error: .*(pedantic|extension)")
  header_test(Header.${compiler}_refuses_missing_include ${${program}} c c99
              ${refused}/missing_include.c "error: .*uint32_t")
endforeach()
