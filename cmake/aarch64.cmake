# Toolchain: Linux on aarch64 from another machine, with Debian's cross-compiler and, to run what is built, qemu. The
# system to compile for lies in SPLAT_AARCH64_SYSROOT, made by tools/aarch64/libraries.

set(CMAKE_SYSTEM_NAME Linux)
set(CMAKE_SYSTEM_PROCESSOR aarch64)
set(CMAKE_C_COMPILER aarch64-linux-gnu-gcc)
set(CMAKE_CXX_COMPILER aarch64-linux-gnu-g++)
set(CMAKE_LIBRARY_ARCHITECTURE aarch64-linux-gnu)

if(NOT SPLAT_AARCH64_SYSROOT)
  get_filename_component(SPLAT_AARCH64_SYSROOT ${CMAKE_CURRENT_LIST_DIR}/../build/aarch64-libraries/sysroot ABSOLUTE)
endif()
list(APPEND CMAKE_TRY_COMPILE_PLATFORM_VARIABLES SPLAT_AARCH64_SYSROOT)
set(CMAKE_SYSROOT ${SPLAT_AARCH64_SYSROOT})
set(CMAKE_FIND_ROOT_PATH_MODE_PROGRAM NEVER)
set(CMAKE_FIND_ROOT_PATH_MODE_LIBRARY ONLY)
set(CMAKE_FIND_ROOT_PATH_MODE_INCLUDE ONLY)
set(CMAKE_FIND_ROOT_PATH_MODE_PACKAGE ONLY)
set(ENV{PKG_CONFIG_LIBDIR} ${CMAKE_SYSROOT}/usr/lib/aarch64-linux-gnu/pkgconfig:${CMAKE_SYSROOT}/usr/share/pkgconfig)
set(ENV{PKG_CONFIG_SYSROOT_DIR} ${CMAKE_SYSROOT})

find_program(SPLAT_QEMU NAMES qemu-aarch64-static qemu-aarch64)
if(SPLAT_QEMU)
  set(CMAKE_CROSSCOMPILING_EMULATOR ${SPLAT_QEMU} -L ${CMAKE_SYSROOT})
endif()
