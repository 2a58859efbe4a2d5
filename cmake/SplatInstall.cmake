# Install rules: headers, library, pkg-config file, CMake package, and vkrun with vkrun-bench where they are built.
# Included by the root CMakeLists.txt after all targets exist. Components, for packages: Splat_Runtime (the library,
# weights, presets, licences), Splat_Development, Splat_Tools; and Splat_Mpi, which is installed by its name alone.

include(CMakePackageConfigHelpers)
include(GNUInstallDirs)

foreach(folder IN ITEMS BINDIR DATADIR INCLUDEDIR LIBDIR MANDIR)
  if(IS_ABSOLUTE "${CMAKE_INSTALL_${folder}}")
    message(FATAL_ERROR "CMAKE_INSTALL_${folder} is ${CMAKE_INSTALL_${folder}}, expected a folder below the prefix, as "
                        "an installed libsplat can be moved")
  endif()
endforeach()

set(SPLAT_CMAKE_DIR ${CMAKE_INSTALL_LIBDIR}/cmake/Splat)
set(SPLAT_PC_DIR ${CMAKE_INSTALL_LIBDIR}/pkgconfig)

install(DIRECTORY ${PROJECT_SOURCE_DIR}/include/ DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}
        COMPONENT Splat_Development FILES_MATCHING PATTERN "*.h" PATTERN "*.hpp")
install(FILES ${PROJECT_SOURCE_DIR}/LICENSE ${PROJECT_SOURCE_DIR}/THIRD-PARTY.md ${PROJECT_SOURCE_DIR}/CHANGELOG.md
              ${PROJECT_SOURCE_DIR}/README.md
        DESTINATION ${CMAKE_INSTALL_DOCDIR} COMPONENT Splat_Runtime)
install(TARGETS splat EXPORT SplatTargets
        LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT Splat_Runtime NAMELINK_COMPONENT Splat_Development
        RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR} COMPONENT Splat_Runtime
        ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT Splat_Development)

# The built-in weights; src/predict/weights_place.cpp looks for them here.
install(DIRECTORY ${PROJECT_SOURCE_DIR}/tools/weights
        DESTINATION ${CMAKE_INSTALL_DATADIR}/libsplat
        COMPONENT Splat_Runtime PATTERN "*.difference" EXCLUDE)
if(TARGET splat_weights)
  install(FILES ${SPLAT_WEIGHTS}/cars64-depth-normal/weights.safetensors
          DESTINATION ${CMAKE_INSTALL_DATADIR}/libsplat/weights/cars64-depth-normal COMPONENT Splat_Runtime)
endif()

# The presets, for reading; the library has them inside.
install(DIRECTORY ${PROJECT_SOURCE_DIR}/src/prior_models/presets
        DESTINATION ${CMAKE_INSTALL_DATADIR}/libsplat COMPONENT Splat_Runtime)

# The prefix follows from the location of the file, so an installed folder can be moved.
file(RELATIVE_PATH SPLAT_PC_PREFIX /${SPLAT_PC_DIR} /)
string(REGEX REPLACE "/$" "" SPLAT_PC_PREFIX "${SPLAT_PC_PREFIX}")
configure_file(${PROJECT_SOURCE_DIR}/cmake/splat.pc.in ${PROJECT_BINARY_DIR}/splat.pc @ONLY)
install(FILES ${PROJECT_BINARY_DIR}/splat.pc DESTINATION ${SPLAT_PC_DIR} COMPONENT Splat_Development)

configure_package_config_file(
  ${PROJECT_SOURCE_DIR}/cmake/SplatConfig.cmake.in ${PROJECT_BINARY_DIR}/SplatConfig.cmake
  INSTALL_DESTINATION ${SPLAT_CMAKE_DIR})
# Before 1.0 a new minor version may break callers.
write_basic_package_version_file(${PROJECT_BINARY_DIR}/SplatConfigVersion.cmake
                                 COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/SplatConfig.cmake ${PROJECT_BINARY_DIR}/SplatConfigVersion.cmake
        DESTINATION ${SPLAT_CMAKE_DIR} COMPONENT Splat_Development)
install(EXPORT SplatTargets NAMESPACE splat:: DESTINATION ${SPLAT_CMAKE_DIR} COMPONENT Splat_Development)

if(TARGET vkrun)
  file(RELATIVE_PATH SPLAT_LIB_FROM_BIN /${CMAKE_INSTALL_BINDIR} /${CMAKE_INSTALL_LIBDIR})
  set_target_properties(vkrun vkrun-bench PROPERTIES INSTALL_RPATH "\$ORIGIN/${SPLAT_LIB_FROM_BIN}")
  install(TARGETS vkrun vkrun-bench RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR} COMPONENT Splat_Tools)
  # Packages have the source of the plugin for MPI; what is built fits the MPI of this machine only.
  set(source ${PROJECT_SOURCE_DIR}/tools/vkrun/ranks/mpi_plugin)
  install(FILES ${source}.c ${source}.h DESTINATION ${CMAKE_INSTALL_DATADIR}/libsplat/mpi COMPONENT Splat_Tools)
  foreach(plugin IN ITEMS vkrun-mpi-openmpi vkrun-mpi-mpich)
    if(TARGET ${plugin})
      install(TARGETS ${plugin} LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR}/vkrun COMPONENT Splat_Mpi EXCLUDE_FROM_ALL)
    endif()
  endforeach()
  if(TARGET vkrun_pages)
    set(pages ${PROJECT_BINARY_DIR}/tools/vkrun)
    install(DIRECTORY ${pages}/man/ DESTINATION ${CMAKE_INSTALL_MANDIR}/man1 COMPONENT Splat_Tools)
    foreach(pair IN ITEMS "vkrun.bash;bash-completion/completions;vkrun" "_vkrun;zsh/site-functions;_vkrun"
                          "vkrun.fish;fish/vendor_completions.d;vkrun.fish")
      list(POP_FRONT pair file folder name)
      install(FILES ${pages}/completion/${file} DESTINATION ${CMAKE_INSTALL_DATADIR}/${folder} RENAME ${name}
              COMPONENT Splat_Tools)
    endforeach()
  endif()
endif()

# The loader searches the system's folders by itself; programs and library there need no path of their own. The linker's
# folders may be more, as LIBRARY_PATH adds some.
function(splat_remove_rpath component)
  install(CODE "
    set(system_folders \"${CMAKE_CXX_IMPLICIT_LINK_DIRECTORIES}\")
    list(FILTER system_folders INCLUDE REGEX \"^/(usr/)?lib(/|$|32|64)\")
    list(FIND system_folders \"\${CMAKE_INSTALL_PREFIX}/${CMAKE_INSTALL_LIBDIR}\" at)
    if(NOT at EQUAL -1)
      foreach(file ${ARGN})
        file(RPATH_REMOVE FILE \"\$ENV{DESTDIR}\${CMAKE_INSTALL_PREFIX}/\${file}\")
      endforeach()
    endif()" COMPONENT ${component})
endfunction()
if(NOT WIN32)
  splat_remove_rpath(Splat_Runtime ${CMAKE_INSTALL_LIBDIR}/$<TARGET_FILE_NAME:splat>)
endif()
if(TARGET vkrun AND NOT WIN32)
  splat_remove_rpath(Splat_Tools ${CMAKE_INSTALL_BINDIR}/vkrun ${CMAKE_INSTALL_BINDIR}/vkrun-bench)
endif()
