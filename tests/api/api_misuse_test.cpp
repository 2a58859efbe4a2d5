// Calls every function of the header with each parameter wrong. Each call returns a documented code
// and a sentence, leaves its outputs alone, and does not crash.
#include <map>
#include <set>

#include "api/misuse/misuse_table.h"

namespace splat::test {
namespace {

/// Parameters of each function.
using Functions = std::map<std::string, std::vector<Parameter>>;

/// Functions and parameters of the header that no row of the table gets wrong.
std::vector<std::string> missing(const Functions& functions, const std::vector<Misuse>& rows) {
    std::set<std::string> covered;
    for (const Misuse& row : rows) {
        covered.insert(row.function + "()");
        covered.insert(row.function + "(" + row.parameter + ")");
    }
    std::vector<std::string> gaps;
    for (const auto& [function, parameters] : functions) {
        if (covered.count(function + "()") == 0) gaps.push_back(function);
        for (const Parameter& parameter : parameters)
            if (covered.count(function + "(" + parameter.name + ")") == 0)
                gaps.push_back(function + "(" + parameter.name + ")");
    }
    return gaps;
}

TEST(ApiMisuse, HasARowForEachParameterOfTheHeader) {
    const MisuseTable table;
    ASSERT_GE(table.functions().size(), 200U);
    for (const std::string& gap : missing(table.functions(), table.rows()))
        ADD_FAILURE() << "no row for " << gap << " in tests/api/misuse/";
    for (const Misuse& row : table.rows())
        EXPECT_EQ(table.functions().count(row.function), 1U) << row.function << " is no function";
}

TEST(ApiMisuse, FindsWhatHasNoRow) {
    const Functions functions = {{"splat_a", {}},
                                 {"splat_b", {Parameter("device"), Parameter("data?")}}};
    const std::vector<Misuse> rows = {{"splat_b", "device", "", SPLAT_OK, nullptr}};
    EXPECT_EQ(missing(functions, rows), (std::vector<std::string>{"splat_a", "splat_b(data)"}));
}

TEST(ApiMisuse, IsRefusedWithACodeAndASentence) {
    MisuseTable table;
    EXPECT_GT(table.rows().size(), 5000U);
    for (const Misuse& row : table.rows()) {
        const std::string what = row.function + ", " + row.parameter + ": " + row.what;
        const splat_result result = row.call();
        EXPECT_STREQ(splat_result_name(result), splat_result_name(row.expected)) << what;
        if (result >= SPLAT_OK) continue;
        EXPECT_REFUSED(result, row.expected, "") << what;
        EXPECT_TRUE(table.untouched()) << what << ": an output was written";
        const std::string text = splat_last_error_message();
        EXPECT_GT(text.size(), 8U) << what;
        // The text names the parameter, or the kind of handle that was expected.
        std::string part;
        if (row.what == "NULL") part = row.parameter;
        if (row.expected == kHandle) part = "expected a";
        EXPECT_TRUE(holds(text, part)) << what << ": " << text;
    }
    std::printf("%zu wrong calls\n", table.rows().size());
}

TEST(ApiMisuse, LeavesTheObjectsUnchanged) {
    const Tensor tensor = upload(shared_device(), {2}, {1, 2});
    EXPECT_EQ(splat_device_destroy(reinterpret_cast<splat_device>(tensor.get())), kHandle);
    EXPECT_EQ(splat_op_destroy(reinterpret_cast<splat_op>(tensor.get())), kHandle);
    EXPECT_EQ(download(tensor), (Floats{1, 2}));
}

TEST(ApiMisuse, DestroyingTwiceIsRefused) {
    Device device = open_device();
    Tensor tensor = make_tensor(device, {2, 2});
    Tensor result = make_tensor(device, {2, 2});
    Op op = make_op(device, OpRequest("linear", {tensor, tensor, nullptr}, {result}));
    const splat_op stale_op = op.destroy();
    const splat_tensor stale_tensor = tensor.destroy();
    const splat_device stale_device = device.destroy();
    for (int i = 0; i < 2; ++i) {
        EXPECT_REFUSED(splat_op_destroy(stale_op), kHandle, "destroyed");
        EXPECT_REFUSED(splat_tensor_destroy(stale_tensor), kHandle, "destroyed");
        EXPECT_REFUSED(splat_device_destroy(stale_device), kHandle, "destroyed");
    }
}

TEST(ApiMisuse, StaleHandlesNeverComeBack) {
    std::set<splat_tensor> seen;
    for (int i = 0; i < 200; ++i)
        EXPECT_TRUE(seen.insert(make_tensor(shared_device(), {1}).destroy()).second);
}

}  // namespace
}  // namespace splat::test
