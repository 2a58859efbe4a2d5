find_package(Splat 0.1 REQUIRED)
