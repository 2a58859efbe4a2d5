// Prints one line per operator and set of kernels: a hash of every result. thread_count.cmake runs
// it with different numbers of driver threads and compares.
#include <cstdio>

#include "ops/conv2d_case.h"
#include "ops/group_norm_case.h"
#include "ops/op_harness.h"

namespace splat::test {
namespace {

int print_hashes(const OpCall& call, const std::string& what) {
    for (const vk::Kernels kernels : kernels_to_test()) {
        const OpResult result = run_op(*shared_context(kernels), call);
        if (!result.status.ok()) {
            std::fprintf(stderr, "%s: %s\n", what.c_str(), result.status.message().c_str());
            return 1;
        }
        std::printf("%s %s", what.c_str(), vk::kernels_name(kernels));
        for (const auto* tensors : {&result.outputs, &result.saved, &result.grad_inputs})
            for (const auto& tensor : *tensors)
                std::printf(" %016llx", static_cast<unsigned long long>(bit_hash(tensor)));
        std::printf("\n");
    }
    return 0;
}

OpCall linear_call(std::uint32_t rows, std::uint32_t in, std::uint32_t out) {
    OpCall call;
    call.op = "linear";
    call.inputs = {{{rows, in}, normal_fill(std::size_t{rows} * in, 1)},
                   {{out, in}, normal_fill(std::size_t{out} * in, 2)},
                   {{out}, normal_fill(out, 3)}};
    call.grad_outputs = {{{rows, out}, normal_fill(std::size_t{rows} * out, 4)}};
    return call;
}

int print_all() {
    int failed = 0;
    for (const ConvShape& shape : {ConvShape{2, 33, 12, 12, 40, 3}, ConvShape{3, 7, 5, 7, 9, 1}})
        for (const int winograd : winograds(vk::Kernels::kCpu, shape)) {
            Conv2dCase c = Conv2dCase::normal(shape, 1);
            c.winograd = winograd;
            failed |= print_hashes(c.call(), "conv2d " + c.text());
        }
    for (const NormShape& shape :
         {NormShape{2, 32, 33, 31, 8}, NormShape{3, 9, 17, 15, 3}, NormShape{1, 4, 128, 128, 1}})
        failed |= print_hashes(GroupNormCase(shape, true, 1).call(), "group_norm " + shape.text());
    failed |= print_hashes(linear_call(257, 129, 65), "linear 257 129 65");
    failed |= print_hashes(linear_call(8192, 5, 7), "linear 8192 5 7");
    int number = 0;
    for (const OpCall& call : op_samples())
        failed |= print_hashes(call, call.op + " sample " + std::to_string(number++));
    return failed;
}

}  // namespace
}  // namespace splat::test

int main() {
    const int failed = splat::test::print_all();
    splat::test::close_shared_contexts();
    return failed;
}
