// Consumer of an installed libsplat in C++, found through its CMake package.
#include <splat.h>

#include <iostream>

int main() {
    std::cout << splat_version_string() << '\n';
    return splat_version() == SPLAT_VERSION ? 0 : 1;
}
