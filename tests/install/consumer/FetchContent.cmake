include(FetchContent)
include(unchanged.cmake)
remember()
FetchContent_Declare(splat SOURCE_DIR ${SPLAT})  # others: GIT_REPOSITORY, or URL of an archive
FetchContent_MakeAvailable(splat)
expect_unchanged()
