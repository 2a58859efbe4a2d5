// write_small_moge FILE: weights of a small MoGe-2, for tests of programs.
#include <cstdio>

#include "io/weights_file.h"
#include "vision/small_moge.h"

int main(int count, char** arguments) {
    if (count != 2) return 2;
    splat::io::WeightsFile file;
    file.tensors = splat::test::small_moge();
    const splat::Status saved = splat::io::save_weights(file, arguments[1]);
    if (!saved.ok()) std::fprintf(stderr, "%s\n", saved.message().c_str());
    return saved.ok() ? 0 : 1;
}
