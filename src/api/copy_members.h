#pragma once

// SPLAT_COPY(to, from, a, b) is to.a = from.a; to.b = from.b; for up to 64 members.
#define SPLAT_COPY(to, from, ...)                              \
    do {                                                       \
        SPLAT_COPY_64(SPLAT_COPY_FIRST(to, from, __VA_ARGS__)) \
    } while (false)
#define SPLAT_COPY_FIRST(to, from, name, ...) \
    (to).name = (from).name;                  \
    __VA_OPT__(SPLAT_COPY_REST SPLAT_COPY_LATER(to, from, __VA_ARGS__))
#define SPLAT_COPY_LATER ()
#define SPLAT_COPY_REST() SPLAT_COPY_FIRST
#define SPLAT_COPY_64(...) SPLAT_COPY_16(SPLAT_COPY_16(SPLAT_COPY_16(SPLAT_COPY_16(__VA_ARGS__))))
#define SPLAT_COPY_16(...) SPLAT_COPY_4(SPLAT_COPY_4(SPLAT_COPY_4(SPLAT_COPY_4(__VA_ARGS__))))
#define SPLAT_COPY_4(...) SPLAT_COPY_1(SPLAT_COPY_1(SPLAT_COPY_1(SPLAT_COPY_1(__VA_ARGS__))))
#define SPLAT_COPY_1(...) __VA_ARGS__
