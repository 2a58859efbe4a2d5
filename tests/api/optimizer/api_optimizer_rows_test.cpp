// Rows of an optimizer's tensors against a plain model on the host: gathered, grown, shrunk, saved and resumed.
#include <cmath>
#include <map>

#include "api/api_calls.h"
#include "support/rng_fill.h"

namespace splat::test {
namespace {

using Rows = std::vector<std::int64_t>;

constexpr std::size_t kCapacity = 9;

/// The attributes of some Gaussians, a tensor of no rows of theirs, and an optimizer of all.
struct Set {
    explicit Set(std::uint64_t seed) {
        std::vector<splat_optimizer_item> items;
        for (Attribute& attribute : attributes) {
            const auto rows = static_cast<std::int64_t>(attribute.capacity);
            const Dims dims = attribute.length == 1
                                  ? Dims{rows}
                                  : Dims{rows, static_cast<std::int64_t>(attribute.length)};
            const std::size_t floats = attribute.capacity * attribute.length;
            attribute.value = upload(shared_device(), dims, normal_fill(floats, seed++));
            attribute.grad = make_tensor(shared_device(), dims);
            items.push_back({attribute.name, nullptr, nullptr, attribute.value, attribute.grad});
        }
        splat_optimizer_desc desc = optimizer_desc(items.data(), items.size());
        desc.rate = 1e-2;
        desc.ema_decay = 0.9;
        EXPECT_DONE(splat_optimizer_create(shared_device(), &desc, optimizer.out()));
    }
    /// A step; gradients depend on the step and the place in the rows.
    splat_optimizer_info step(std::uint64_t number) {
        for (Attribute& attribute : attributes) {
            const std::size_t floats = attribute.capacity * attribute.length;
            write(attribute.grad, normal_fill(floats, 50 + number));
        }
        return got(splat_optimizer_step, optimizer);
    }
    splat_result gather(const char* pattern, const Rows& rows) {
        return splat_optimizer_gather_rows(optimizer, pattern, rows.data(), rows.size());
    }
    /// Moments and averages by their names in a state, values by "p:NAME"; rows in use.
    [[nodiscard]] std::map<std::string, Floats> contents() const {
        std::map<std::string, Floats> all;
        const Weights state = got(splat_optimizer_save, optimizer);
        for (const Attribute& attribute : attributes)
            for (const char* kind : {"m:", "v:", "ema:"}) {
                const std::string name = kind + std::string(attribute.name);
                const auto index = got(splat_weights_find, state, name.c_str());
                const auto info = got(splat_weights_get_info, state, index);
                all[name] = floats_of(info.elements, splat_weights_read, state, index);
                Floats& value = all["p:" + std::string(attribute.name)] = download(attribute.value);
                value.resize(info.elements);
            }
        return all;
    }

    struct Attribute {
        const char* name;
        std::size_t length;  ///< numbers of a row
        std::size_t capacity = kCapacity;
        Tensor value = {}, grad = {};
    };
    Attribute attributes[4] = {
        {"set.means", 3}, {"set.opacities", 1}, {"set.sh", 45}, {"pose", 6, 2}};
    Optimizer optimizer;
};

/// What gather_rows promises, on the host.
void gather(const Set& set, std::map<std::string, Floats>& contents, const Rows& rows) {
    for (const Set::Attribute& attribute : set.attributes) {
        if (attribute.capacity != kCapacity) continue;
        const std::string name = attribute.name;
        const Floats memory = download(attribute.value);  // before the call
        for (const char* kind : {"ema:", "m:", "v:", "p:"}) {
            const Floats old = contents.at(kind + name);
            const bool moment = kind[0] == 'm' || kind[0] == 'v';
            Floats& values = contents[kind + name];
            values.clear();
            for (std::size_t i = 0; i < rows.size(); ++i)
                for (std::size_t c = 0; c < attribute.length; ++c) {
                    const auto row = static_cast<std::size_t>(rows[i]);
                    values.push_back(rows[i] >= 0 ? old[row * attribute.length + c]
                                     : moment     ? 0
                                                  : memory[i * attribute.length + c]);
                }
        }
    }
}

/// Bit by bit: no value is NaN.
void expect_equal(const Set& set, const std::map<std::string, Floats>& expected) {
    const auto contents = set.contents();
    for (const auto& [name, values] : expected) EXPECT_EQ(contents.at(name), values) << name;
}

const Rows kDropped = {8, 2, 3, 7, 0};           // five of nine, in another order
const Rows kGrown = {0, 1, 2, 3, 4, -1, -1};     // two new ones
const Rows kMixed = {6, -1, 6, 5, 0, -1, 1, 2};  // a row twice, new ones between

TEST(ApiOptimizerRows, MatchesTheHost) {
    Set set(1);
    set.step(1);
    set.step(2);
    auto expected = set.contents();
    for (const Rows& rows : {kDropped, kGrown, kMixed, Rows{3}}) {
        gather(set, expected, rows);
        ASSERT_DONE(set.gather("set.*", rows));
        expect_equal(set, expected);
        const splat_optimizer_info info = set.step(3 + rows.size());
        EXPECT_EQ(info.elements, rows.size() * 49 + 12);
        EXPECT_EQ(info.was_skipped, 0U);
        expected = set.contents();
    }
}

/// A step updates rows as it would wherever they lay, and none that is not in use.
TEST(ApiOptimizerRows, StepsUpdateRowsInUse) {
    Set gathered(1), plain(1);
    for (Set* set : {&gathered, &plain}) set->step(1);
    const Rows kept = {0, 1, 2, 3, 4, 5, 6, 7};  // 8 rows: no quad has numbers of two states
    ASSERT_DONE(gathered.gather("set.*", kept));
    const Floats before = download(gathered.attributes[0].value);
    gathered.step(2);
    plain.step(2);
    const auto all = plain.contents();
    for (auto [name, values] : gathered.contents()) {
        Floats expected = all.at(name);
        expected.resize(values.size());
        EXPECT_EQ(values, expected) << name;
    }
    const Floats after = download(gathered.attributes[0].value);
    EXPECT_NE(after[0], before[0]);
    for (std::size_t i = 24; i < 27; ++i) EXPECT_EQ(after[i], before[i]) << "not in use";
    Floats grads(27, 0);
    grads[26] = NAN;
    write(gathered.attributes[0].grad, grads);
    const auto info = got(splat_optimizer_step, gathered.optimizer);
    EXPECT_EQ(info.was_skipped, 0U) << "a gradient that is not in use";
    ASSERT_DONE(splat_optimizer_zero_gradients(gathered.optimizer));
    EXPECT_EQ(download(gathered.attributes[0].grad), Floats(27)) << "of all rows";
}

TEST(ApiOptimizerRows, ResumesBitForBit) {
    Set whole(1);
    whole.step(1);
    ASSERT_DONE(whole.gather("set.*", kDropped));
    whole.step(2);
    Weights state, stored;
    ASSERT_DONE(splat_optimizer_save(whole.optimizer, state.out()));
    ASSERT_DONE(splat_optimizer_store(whole.optimizer, stored.out()));
    std::uint32_t index = 0;
    auto means = sized<splat_weights_info>();
    ASSERT_DONE(splat_weights_find(stored, "set.means", &index));
    ASSERT_DONE(splat_weights_get_info(stored, index, &means));
    EXPECT_EQ(means.dims[0], 5) << "the rows in use";
    Set resumed(20);
    resumed.step(1);
    ASSERT_DONE(resumed.gather("set.*", Rows{1}));
    const auto copy_memory = [&] {
        for (std::size_t i = 0; i < 4; ++i) {
            const Floats values = download(whole.attributes[i].value);
            ASSERT_DONE(splat_tensor_write(resumed.attributes[i].value, values.data(),
                                           4 * values.size(), nullptr));
        }
    };
    copy_memory();
    ASSERT_DONE(splat_optimizer_load(resumed.optimizer, state));
    expect_equal(resumed, whole.contents());
    for (Set* set : {&whole, &resumed}) set->step(3);
    expect_equal(resumed, whole.contents());
    copy_memory();  // the new rows, too
    for (Set* set : {&whole, &resumed}) {
        ASSERT_DONE(set->gather("set.*", kGrown));
        set->step(4);
    }
    expect_equal(resumed, whole.contents());
}

TEST(ApiOptimizerRows, RefusesWhatDoesNotFit) {
    Set set(1);
    set.step(1);
    const auto before = set.contents();
    const auto refuse = [&](const char* pattern, const Rows& rows, splat_result code,
                            const char* part) {
        EXPECT_REFUSED(set.gather(pattern, rows), code, part);
        expect_equal(set, before);
    };
    refuse("se?", {0}, kArgument, "'se?' matches none of the 4 parameters");
    refuse("*", {0}, kShape, "'pose' has 2 rows in use of 2, expected 9 of 9");
    refuse("set.*", Rows(10, 0), kArgument, "10 rows, expected 1 to 9");
    refuse("set.*", {0, 9}, kArgument, "rows[1] is 9");
    refuse("set.*", {-2}, kArgument, "rows[0] is -2");
    // One of the set alone: the others have other rows then.
    ASSERT_DONE(set.gather("set.sh", kDropped));
    EXPECT_REFUSED(set.gather("set.*", {0}), kShape,
                   "'set.sh' has 5 rows in use of 9, expected 9 of 9");
    EXPECT_REFUSED(set.gather("set.sh", {5}), kArgument, "expected one of the 5 rows in use");
}

TEST(ApiOptimizerRows, RefusesWhatIsNoTensorOfRows) {
    Model model;
    splat_model_desc desc = model_desc();
    desc.flags = SPLAT_MODEL_GRADIENTS;
    ASSERT_DONE(splat_model_create(shared_device(), &desc, model.out()));
    const splat_optimizer_item item = {nullptr, model, nullptr, nullptr, nullptr};
    const splat_optimizer_desc made = optimizer_desc(&item);
    const Optimizer optimizer = got(splat_optimizer_create, shared_device(), &made);
    const std::int64_t row = 0;
    EXPECT_REFUSED(splat_optimizer_gather_rows(optimizer, "*out.bias", &row, 1), kUnsupported,
                   "belongs to a network");
}

}  // namespace
}  // namespace splat::test
