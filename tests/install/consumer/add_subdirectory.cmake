include(unchanged.cmake)
remember()
add_subdirectory(${SPLAT} splat)
expect_unchanged()
