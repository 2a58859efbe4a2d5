/* Consumer of an installed libsplat in plain C, found through pkg-config. */
#include <splat.h>
#include <stdio.h>

int main(void) {
    printf("%s\n", splat_version_string());
    return splat_version() == SPLAT_VERSION ? 0 : 1;
}
