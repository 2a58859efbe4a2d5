#include "io/torch/pickle.h"

#include <gtest/gtest.h>

#include "io/sample_scene.h"
#include "io/sample_weights.h"
#include "support/expect_status.h"

namespace splat::io {
namespace {

using namespace test;
using Kind = Pickle::Kind;

Result<Pickle> read_pickles(Buffer bytes, std::size_t count = 1) {
    DecodeBudget budget(0, {0, 1ULL << 40U});
    return Pickle::read(std::move(bytes), budget, count);
}

Result<Pickle> read(const std::string& text) {
    return read_pickles(bytes_of(text));
}

void expect_pickle_refused(const std::string& text, const char* part, Code code = Code::kFormat) {
    EXPECT_ERROR(read(text), code, part);
}

TEST(Pickle, ReadsPlainValues) {
    // {'a': (1, -2, 70000, 1.5, None, True), 'b': ['x', b'y', 2**40]} as Python writes it.
    constexpr char kText[] =
        "\x80\x02}q\0(X\1\0\0\0aq\1(K\1J\xfe\xff\xff\xffJp\x11\1\0G?\xf8\0\0\0\0\0\0N\x88tq\2"
        "X\1\0\0\0bq\3]q\4(X\1\0\0\0xq\5U\1yq\6\x8a\6\0\0\0\0\0\1eu.";
    const std::string text(kText, sizeof kText - 1);
    const Pickle p = need(read(text));
    const PickleNode* a = p.find(p.root(), "a");
    ASSERT_TRUE(a != nullptr && a->kind == Kind::kTuple && a->items.size() == 6);
    EXPECT_EQ(p[a->items[0]].integer, 1);
    EXPECT_EQ(p[a->items[1]].integer, -2);
    EXPECT_EQ(p[a->items[2]].integer, 70000);
    EXPECT_EQ(p[a->items[3]].real, 1.5);
    EXPECT_EQ(p[a->items[4]].kind, Kind::kNone);
    EXPECT_EQ(p[a->items[5]].kind, Kind::kBool);
    const PickleNode* b = p.find(p.root(), "b");
    ASSERT_TRUE(b != nullptr && b->kind == Kind::kList && b->items.size() == 3);
    EXPECT_EQ(p[b->items[0]].text, "x");
    EXPECT_EQ(p[b->items[1]].kind, Kind::kText) << "bytes of Python 2 are texts";
    EXPECT_EQ(read("\x80\x02"
                   "C\1y.")
                  .value()
                  .root()
                  .kind,
              Kind::kBytes);
    EXPECT_EQ(p[b->items[2]].integer, 1LL << 40);
    EXPECT_EQ(p.find(p.root(), "c"), nullptr);
    EXPECT_EQ(p.find(*a, "c"), nullptr);
    for (std::size_t size = 0; size < text.size(); ++size)
        EXPECT_FALSE(read(text.substr(0, size)).ok()) << size;
}

TEST(Pickle, ReadsOrderedDictsOfPython2) {
    PickleText text;
    text.global("collections", "OrderedDict").raw("(](](U\1aK\7e](U\1bNeetR");
    const auto pickle = need(read(text.done()));
    EXPECT_EQ(pickle.root().items.size(), 4U);
    const PickleNode* a = pickle.find(pickle.root(), "a");
    ASSERT_NE(a, nullptr);
    EXPECT_EQ(a->integer, 7);
}

TEST(Pickle, ReadsSeveralThatFollowEachOther) {
    const std::string two = "\x80\x02K\1q\1.\x80\x02K\2.rest";
    const auto pickle = need(read_pickles(bytes_of(two), 2));
    EXPECT_EQ(pickle.root(0).integer, 1);
    EXPECT_EQ(pickle.root(1).integer, 2);
    EXPECT_EQ(pickle.size(), two.size() - 4);
    EXPECT_ERROR(read_pickles(bytes_of("\x80\x02K\1q\1.\x80\x02h\1."), 2), Code::kFormat,
                 "the memo has no value")
        << "each has its own memo";
}

TEST(Pickle, NumbersOfAnyLength) {
    const auto value = [](const std::string& op) {
        return need(read("\x80\x02" + op + ".")).root().integer;
    };
    EXPECT_EQ(value(std::string("\x8a\0", 2)), 0);
    EXPECT_EQ(value("\x8a\1\xff"), -1);
    EXPECT_EQ(value(std::string("\x8a\2\xff\0", 4)), 255);
    EXPECT_EQ(value("\x8a\x08" + std::string(7, '\0') + "\x80"), INT64_MIN);
    expect_pickle_refused("\x80\x02\x8a\x09" + std::string(9, '\1') + ".", "more than 64 bits");
}

TEST(Pickle, RunsNothing) {
    for (const auto& [module, name] :
         {std::pair("os", "system"), std::pair("posix", "system"), std::pair("nt", "system"),
          std::pair("builtins", "eval"), std::pair("__builtin__", "eval"),
          std::pair("subprocess", "Popen"), std::pair("torch", "load"),
          std::pair("torch.serialization", "load"), std::pair("argparse", "Namespace"),
          std::pair("torch._utils", "_rebuild_qtensor"), std::pair("torch", "_utils"),
          std::pair("torch", "FloatStorage.__class__"), std::pair("collections", "deque")}) {
        const std::string full = "'" + std::string(module) + "." + name + "'";
        // The name alone is enough, whether or not it is called, and by either opcode.
        expect_pickle_refused(PickleText().global(module, name).done(), full.c_str(),
                              Code::kUnsupported);
        expect_pickle_refused(
            PickleText().global(module, name).raw("(").text("true").raw("tR").done(), full.c_str(),
            Code::kUnsupported);
        expect_pickle_refused(PickleText().text(module).text(name).raw("\x93").done(), full.c_str(),
                              Code::kUnsupported);
    }
    for (const char* op : {"i", "o", "\x92", "\x82", "P", "S'x'\n", "I1\n", "\x8b", "0", "2"})
        expect_pickle_refused(std::string("\x80\x02}") + op + "....", "opcode", Code::kUnsupported);
    expect_pickle_refused("\x80\x05N.", "protocol 5", Code::kUnsupported);
    expect_pickle_refused(std::string("\x80\0N.", 4), "protocol 0", Code::kUnsupported);
}

/// An object of a class that is not run, without a state.
PickleText& object(PickleText& text, const char* name = "dictconfig DictConfig") {
    const std::string full = name;
    const std::size_t blank = full.find(' ');
    return text.global("omegaconf." + full.substr(0, blank), full.substr(blank + 1)).raw(")\x81");
}

TEST(Pickle, StandsInForConfigurations) {
    PickleText text;
    text.raw("}");
    object(text.text("betas"), "listconfig ListConfig").raw("q\1}q\2(");
    text.text("_parent").raw("h\1");  // a cycle
    text.text("_metadata");
    object(text, "base ContainerMetadata").raw("}(").text("object_type");
    text.global("__builtin__", "list").text("ref_type").global("typing", "Any");
    text.text("resolver_cache").global("collections", "defaultdict");
    text.global("__builtin__", "dict").raw("\x85Rub");
    text.text("_content").raw("]");
    object(text, "nodes AnyNode").raw("}").text("_val").real(0.9).raw("sbaubs");
    const Pickle p = need(read(text.done()));
    const PickleNode* betas = p.find(p.root(), "betas");
    EXPECT_TRUE(betas != nullptr && betas->kind == Kind::kObject);
}

TEST(Pickle, RefusesOtherUsesOfConfigurations) {
    const auto refused = [](const std::string& text, const char* part) {
        PickleText pickle;
        expect_pickle_refused(object(pickle).raw(text).done(), part);
    };
    refused("K\1b", "a state for an object");
    refused("]b", "a state for an object");
    refused(")R", "not a function");
    refused("K\1a", "items for an object");
    const auto made = [](const char* module, const char* name, const char* rest, const char* part) {
        expect_pickle_refused(PickleText().global(module, name).raw(rest).done(), part);
    };
    made("omegaconf.dictconfig", "DictConfig", "K\1\x85\x81", "has arguments here");
    made("omegaconf.dictconfig", "DictConfig", ")R", "do not fit omegaconf");
    made("__builtin__", "list", ")\x81", "an object of __builtin__.list");
    made("__builtin__", "list", ")R", "do not fit __builtin__.list");
    made("torch", "FloatStorage", ")\x81", "an object of torch.FloatStorage");
    made("collections", "defaultdict", "K\1\x85R", "do not fit collections.defaultdict");
    made("collections", "defaultdict", ")\x81", "an object of collections.defaultdict");
    expect_pickle_refused("\x80\x02})\x81.", "not a class");
    for (const char* name : {"_impl instantiate", "omegaconf OmegaConf", "base Node"}) {
        PickleText pickle;
        expect_pickle_refused(object(pickle, name).done(), "not part of a state dict",
                              Code::kUnsupported);
    }
    // Many may share a state: objects take no attributes.
    PickleText many;
    many.raw("(}q\1(");
    for (int i = 0; i < 1000; ++i) many.text(std::to_string(i)).raw("N");
    many.raw("u");
    for (int i = 0; i < 1000; ++i) object(many).raw("h\1b");
    DecodeBudget budget(0, {0, 1ULL << 20U});
    EXPECT_OK(Pickle::read(bytes_of(many.raw("t").done()), budget));
}

TEST(Pickle, RefusesCallsThatDoNotFit) {
    const auto call = [](const std::string& module, const std::string& name,
                         const std::string& arguments) {
        return PickleText().global(module, name).raw(arguments).done();
    };
    for (const char* arguments : {"(K\1tR", "(]K\1atR", "(]]K\1aatR", "(]]tR"})
        expect_pickle_refused(call("collections", "OrderedDict", arguments),
                              "do not fit collections");
    expect_pickle_refused(call("torch._utils", "_rebuild_tensor_v2", ")R"),
                          "do not fit torch._utils");
    expect_pickle_refused(call("torch._utils", "_rebuild_tensor_v2", "(K\1K\1K\1K\1tR"),
                          "do not fit");
    expect_pickle_refused(call("torch", "FloatStorage", ")R"), "do not fit torch.FloatStorage");
    expect_pickle_refused(call("torch", "FloatStorage", "NR"), "not a function");
    expect_pickle_refused(PickleText().text("print").raw(")R").done(), "not a function");
    expect_pickle_refused(call("_codecs", "encode", "(X\2\0\0\0\xc4\x80X\6\0\0\0latin1tR"),
                          "size of");
    expect_pickle_refused(PickleText().raw("]}b").done(), "a state for a list");
    expect_pickle_refused(PickleText().text("id").raw("Q").done(), "not the storage of a tensor");
    PickleText id;
    id.raw("(").text("storage").global("collections", "OrderedDict").text("0").text("cpu");
    expect_pickle_refused(id.integer(1).raw("tQ").done(), "not a storage type", Code::kUnsupported);
}

TEST(Pickle, RefusesBrokenPrograms) {
    expect_pickle_refused("", "opcode");
    expect_pickle_refused("\x80\x02.", "does not end with one value");
    expect_pickle_refused("\x80\x02NN.", "does not end with one value");
    expect_pickle_refused("\x80\x02(N.", "does not end with one value");
    expect_pickle_refused("\x80\x02Nt.", "needs a mark");
    expect_pickle_refused("\x80\x02s.", "more values than there are");
    expect_pickle_refused("\x80\x02}(NNs.", "more values than there are");
    expect_pickle_refused("\x80\x02]NNs.", "items for a list, expected a dict");
    expect_pickle_refused("\x80\x02}Na.", "items for a dict, expected a list");
    expect_pickle_refused("\x80\x02}(Nu.", "items for a dict");
    expect_pickle_refused("\x80\x02h\7.", "the memo has no value");
    expect_pickle_refused("\x80\x02q\1.", "more values than there are");
    expect_pickle_refused("\x80\x02X\xff\xff\xff\x7f.", "'text' at byte 7 needs 2147483647");
    expect_pickle_refused(
        "\x80\x02"
        "cos\nsystem",
        "cut off");
}

TEST(Pickle, CyclesAndDepthAreHarmless) {
    // A list that holds itself, and one of 200000 levels.
    const auto cycle = need(read(std::string("\x80\x02]q\0h\0a.", 9)));
    EXPECT_EQ(&cycle[cycle.root().items[0]], &cycle.root());
    std::string deep = "\x80\x02";
    for (int i = 0; i < 200000; ++i) deep += "]";
    for (int i = 1; i < 200000; ++i) deep += "a";
    EXPECT_OK(read(deep + "."));
    expect_pickle_refused("\x80\x02" + std::string(257, '('), "deeper than 256 levels");
}

TEST(Pickle, HasLimits) {
    expect_pickle_refused("\x80\x02" + std::string(Pickle::kMaxNodes + 1, ']'),
                          "more than 4194304 values");
    EXPECT_ERROR(read_pickles(Buffer(Pickle::kMaxBytes + 1)), Code::kFormat,
                 "the limit is 67108864");
}

}  // namespace
}  // namespace splat::io
