// What vkrun bench ops measures: the shapes that the operators' references name.

#include "bench/ops/op_bench.h"
#include "vkrun/cli/json.h"

namespace vkrun::bench {

std::vector<std::string> bench_ops() {
    std::vector<std::string> names;
    for (const Json& op : library_json(splat_op_list))
        names.push_back(op.at("name").get<std::string>());
    return names;
}

std::vector<OpCase> bench_cases(const std::string& op, bool quick) {
    const splat::ref::OpRef* ref = splat::ref::find_op(op);
    if (ref == nullptr) throw Failure(kFailed, "operator '" + op + "' has no case to measure");
    if (quick) return {example_case(op, ref->examples().front())};
    std::vector<OpCase> cases;
    for (const splat::ref::OpExample& size : ref->sizes()) cases.push_back(example_case(op, size));
    return cases;
}

}  // namespace vkrun::bench
