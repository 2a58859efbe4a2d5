/* What the files of the smoke list in C share. */
#ifndef SMOKE_H
#define SMOKE_H

#include <splat.h>

/* Print the sentence and end the program. */
_Noreturn void fail(const char* what);
/* End the program unless the call succeeded. */
void check(splat_result result);
/* FNV-1a with 64 bits. */
uint64_t hash(const void* data, size_t bytes);
/* The picture of the case predict. */
void make_disc(unsigned char pixels[64][80][4]);

void case_judge(splat_scene scene);
void case_maps(void);
void case_data(const char* folder);

#endif /* SMOKE_H */
