/* Must be refused: a hole before the second field. */
#include <stdint.h>

struct padded {
    uint32_t a;
    uint64_t b;
};

struct padded sample;
