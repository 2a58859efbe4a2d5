find_package(PkgConfig REQUIRED)
pkg_check_modules(SPLAT REQUIRED IMPORTED_TARGET splat>=0.1)
add_library(splat::splat ALIAS PkgConfig::SPLAT)
