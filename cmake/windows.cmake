# Toolchain: Windows on x86-64 from Linux, with Debian's mingw-w64 and, to run what is built, Wine. The libraries lie in
# SPLAT_WINDOWS_PREFIX, made by tools/windows/libraries.

set(CMAKE_SYSTEM_NAME Windows)
set(CMAKE_SYSTEM_PROCESSOR x86_64)
set(CMAKE_C_COMPILER x86_64-w64-mingw32-gcc-posix)
set(CMAKE_CXX_COMPILER x86_64-w64-mingw32-g++-posix)
set(CMAKE_RC_COMPILER x86_64-w64-mingw32-windres)

if(NOT SPLAT_WINDOWS_PREFIX)
  get_filename_component(SPLAT_WINDOWS_PREFIX ${CMAKE_CURRENT_LIST_DIR}/../build/windows-libraries/prefix ABSOLUTE)
endif()
list(APPEND CMAKE_TRY_COMPILE_PLATFORM_VARIABLES SPLAT_WINDOWS_PREFIX)
set(CMAKE_FIND_ROOT_PATH ${SPLAT_WINDOWS_PREFIX})
set(CMAKE_PREFIX_PATH ${SPLAT_WINDOWS_PREFIX})
set(CMAKE_FIND_ROOT_PATH_MODE_PROGRAM NEVER)
set(CMAKE_FIND_ROOT_PATH_MODE_LIBRARY ONLY)
set(CMAKE_FIND_ROOT_PATH_MODE_INCLUDE ONLY)
set(CMAKE_FIND_ROOT_PATH_MODE_PACKAGE ONLY)
set(ENV{PKG_CONFIG_LIBDIR} ${SPLAT_WINDOWS_PREFIX}/lib/pkgconfig)
set(ENV{PKG_CONFIG_SYSROOT_DIR} "")

# Windows 10; what is built needs no library of the compiler, and two builds have the same bytes.
set(CMAKE_C_FLAGS_INIT "-D_WIN32_WINNT=0x0A00")
set(CMAKE_CXX_FLAGS_INIT "-D_WIN32_WINNT=0x0A00")
set(CMAKE_EXE_LINKER_FLAGS_INIT "-static -Wl,--no-insert-timestamp")
set(CMAKE_SHARED_LINKER_FLAGS_INIT "-static -Wl,--no-insert-timestamp")
find_program(SPLAT_WINE NAMES wine64 wine)
if(SPLAT_WINE)
  set(CMAKE_CROSSCOMPILING_EMULATOR ${SPLAT_WINE})
endif()
