/* Consumer of libsplat in plain C. */
#include <splat.h>
#include <stdio.h>

int main(void) {
    char weights[4096];
    printf("%s\n", splat_version_string());
    if (splat_builtin_weights("cars64", weights, sizeof weights, NULL) != SPLAT_OK)
        return fprintf(stderr, "%s\n", splat_last_error_message()), 1;
    return splat_version() == SPLAT_VERSION ? 0 : 1;
}
