#include "io/torch/pickle.h"

#include <array>
#include <unordered_map>
#include <utility>

#include "io/reader.h"
#include "io/torch/pickle_globals.h"

namespace splat::io {

namespace {

using Kind = PickleNode::Kind;
using Role = PickleRole;

}  // namespace

/// The stack machine that runs a pickle's opcodes.
class Unpickler {
  public:
    Unpickler(Pickle& pickle, DecodeBudget& budget)
        : pickle_(pickle), budget_(budget), reader_(pickle.bytes_, "pickle") {
        node({});
        for (const std::int64_t value : {0, 1}) node({.kind = Kind::kBool, .integer = value});
    }

    /// Run pickles that follow each other.
    Status run(std::size_t count) {
        while (count-- > 0) SPLAT_TRY(run_one());
        pickle_.size_ = reader_.position();
        return {};
    }

  private:
    using Run = Status (Unpickler::*)();
    static const std::array<Run, 256>& handlers();

    /// Nodes that every pickle has.
    enum Constant : std::uint32_t { kNone, kFalse, kTrue };
    static constexpr std::size_t kToMark = SIZE_MAX;  ///< all values above the last mark

    Status run_one() {
        memo_.clear();
        std::uint8_t op = 0;
        while (true) {
            at_ = reader_.position();
            SPLAT_TRY(reader_.read(op, "opcode"));
            if (op == '.') break;
            const Run handler = handlers()[op];
            if (handler == nullptr)
                return unsupported(
                    "pickle: byte %zu: opcode 0x%02x is not one that weights need; the "
                    "file is damaged, or holds more than a state dict",
                    at_, op);
            SPLAT_TRY((this->*handler)());
            SPLAT_TRY(budget_.take(std::exchange(cost_, 0), 1, "pickle: values"));
            if (pickle_.nodes_.size() > Pickle::kMaxNodes)
                return bad(format("more than %zu values", Pickle::kMaxNodes));
        }
        if (stack_.size() != 1 || !marks_.empty()) return bad("it does not end with one value");
        pickle_.roots_.push_back(stack_[0]);
        stack_.clear();
        return {};
    }

    [[nodiscard]] Status bad(const std::string& problem) const {
        return damaged("pickle: byte %zu: %s", at_, problem.c_str());
    }

    std::uint32_t node(PickleNode value) {
        cost_ += 2 * sizeof(PickleNode);  // the vector grows by doubling
        pickle_.nodes_.push_back(std::move(value));
        return static_cast<std::uint32_t>(pickle_.nodes_.size() - 1);
    }

    Status push_items(Kind kind, std::vector<std::uint32_t> items) {
        cost_ += items.size() * sizeof items[0];
        return push(node({.kind = kind, .items = std::move(items)}));
    }

    [[nodiscard]] PickleNode& at(std::uint32_t i) { return pickle_.nodes_[i]; }

    Status push(std::uint32_t value) {
        stack_.push_back(value);
        return {};
    }

    Status push_new(Kind kind, std::int64_t integer = 0, std::string_view text = {}) {
        PickleNode value{.kind = kind, .integer = integer, .text = text};
        return push(node(std::move(value)));
    }

    /// An opcode may take the values above the last mark; without a mark, all.
    [[nodiscard]] std::size_t floor() const { return marks_.empty() ? 0 : marks_.back(); }

    Status need(std::size_t count) const {
        if (stack_.size() - floor() >= count) return {};
        return bad("an opcode takes more values than there are");
    }

    Result<std::uint32_t> pop() {
        SPLAT_TRY(need(1));
        const std::uint32_t value = stack_.back();
        stack_.pop_back();
        return value;
    }

    Result<std::vector<std::uint32_t>> pop_to_mark() {
        if (marks_.empty()) return bad("an opcode needs a mark, and there is none");
        std::vector<std::uint32_t> values(
            stack_.begin() + static_cast<std::ptrdiff_t>(marks_.back()), stack_.end());
        stack_.resize(marks_.back());
        marks_.pop_back();
        return values;
    }

    Result<std::vector<std::uint32_t>> pop_many(std::size_t count) {
        if (count == kToMark) return pop_to_mark();
        SPLAT_TRY(need(count));
        std::vector<std::uint32_t> values(stack_.end() - static_cast<std::ptrdiff_t>(count),
                                          stack_.end());
        stack_.resize(stack_.size() - count);
        return values;
    }

    template <Constant kNode>
    Status push_constant() {
        return push(kNode);
    }

    template <Kind kKind>
    Status push_empty() {
        return push_new(kKind);
    }

    Status push_mark() {
        if (marks_.size() == Pickle::kMaxMarks)
            return bad(format("it nests deeper than %zu levels", Pickle::kMaxMarks));
        marks_.push_back(stack_.size());
        return {};
    }

    template <std::size_t kCount>
    Status push_tuple() {
        SPLAT_ASSIGN(std::vector<std::uint32_t> values, pop_many(kCount));
        return push_items(Kind::kTuple, std::move(values));
    }

    /// Append to the list or dict on top.
    template <Kind kKind, std::size_t kCount>
    Status extend() {
        SPLAT_ASSIGN(const std::vector<std::uint32_t> values, pop_many(kCount));
        SPLAT_TRY(need(1));
        PickleNode& to = at(stack_.back());
        if (to.kind != kKind || (kKind == Kind::kDict && values.size() % 2 != 0))
            return bad(std::string("items for ") + kind_name(to.kind) + ", expected " +
                       kind_name(kKind));
        cost_ += 2 * values.size() * sizeof values[0];
        to.items.insert(to.items.end(), values.begin(), values.end());
        return {};
    }

    Status skip_frame() { return reader_.take(8, "frame").status(); }

    Status check_protocol() {
        std::uint8_t version = 0;
        SPLAT_TRY(reader_.read(version, "protocol"));
        if (version >= 2 && version <= 4) return {};
        return unsupported("pickle: protocol %u, expected 2 to 4", version);
    }

    template <class T>
    Status push_number() {
        T value = 0;
        SPLAT_TRY(reader_.read(value, "number"));
        return push_new(Kind::kInt, value);
    }

    Status push_real() {
        SPLAT_ASSIGN(const Bytes data, reader_.take(8, "number"));
        return push(
            node({.kind = Kind::kFloat, .real = number<double>(data.data(), std::endian::big)}));
    }

    /// Little-endian, two's complement, of any length.
    Status push_long() {
        std::uint8_t size = 0;
        SPLAT_TRY(reader_.read(size, "size of a number"));
        SPLAT_ASSIGN(const Bytes data, reader_.take(size, "number"));
        if (size > 8) return bad("a whole number of more than 64 bits");
        std::uint64_t value = 0;
        for (std::size_t i = 0; i < size; ++i)
            value |= std::to_integer<std::uint64_t>(data[i]) << (8 * i);
        if (size > 0 && size < 8 && (value >> (8U * size - 1)) != 0)
            value |= ~std::uint64_t{0} << (8U * size);
        return push_new(Kind::kInt, static_cast<std::int64_t>(value));
    }

    template <Kind kKind, class Size>
    Status push_sized() {
        Size size = 0;
        SPLAT_TRY(reader_.read(size, "size of a text"));
        SPLAT_ASSIGN(const Bytes data, reader_.take(size, "text"));
        return push_new(kKind, 0, as_text(data));
    }

    template <class Index>
    Status memo_put() {
        Index index = 0;
        SPLAT_TRY(reader_.read(index, "place in the memo"));
        return remember(index);
    }

    Status memoize() { return remember(memo_.size()); }

    Status remember(std::size_t index) {
        SPLAT_TRY(need(1));
        constexpr std::size_t kMemoBytes = 48;  // bytes per entry of the map
        if (memo_.insert_or_assign(index, stack_.back()).second) cost_ += kMemoBytes;
        if (memo_.size() <= Pickle::kMaxNodes) return {};
        return bad(format("more than %zu values in the memo", Pickle::kMaxNodes));
    }

    template <class Index>
    Status memo_get() {
        Index index = 0;
        SPLAT_TRY(reader_.read(index, "place in the memo"));
        const auto found = memo_.find(index);
        if (found == memo_.end()) return bad("the memo has no value of this number");
        return push(found->second);
    }

    Result<std::string_view> line() {
        const std::string_view rest = as_text(Bytes(pickle_.bytes_).subspan(reader_.position()));
        const std::size_t end = rest.find('\n');
        if (end == std::string_view::npos || end > 1000)
            return bad("the name of a global is cut off");
        SPLAT_TRY(reader_.take(end + 1, "name").status());
        return rest.substr(0, end);
    }

    Status push_global_lines() {
        SPLAT_ASSIGN(const std::string_view module, line());
        SPLAT_ASSIGN(const std::string_view name, line());
        return push_global(module, name);
    }

    Status push_global_stack() {
        SPLAT_ASSIGN(const std::vector<std::uint32_t> names, pop_many(2));
        if (at(names[0]).kind != Kind::kText || at(names[1]).kind != Kind::kText)
            return bad("the name of a global is not text");
        return push_global(at(names[0]).text, at(names[1]).text);
    }

    Status push_global(std::string_view module, std::string_view name) {
        const std::string full =
            std::string(module.substr(0, 200)) + "." + std::string(name.substr(0, 200));
        const std::span<const PickleGlobal> known = pickle_globals();
        for (std::size_t i = 0; i < known.size(); ++i) {
            if (known[i].name != full) continue;
            return push_new(Kind::kGlobal, static_cast<std::int64_t>(i), known[i].name);
        }
        return unsupported(
            "pickle: byte %zu: it asks for '%s', which is not part of a state dict and is "
            "not run; in Python, save the weights alone: "
            "torch.save(model.state_dict(), path)",
            at_, full.c_str());
    }

    /// A call of a global with a tuple of arguments.
    Status reduce() {
        SPLAT_ASSIGN(const std::vector<std::uint32_t> call, pop_many(2));
        if (at(call[0]).kind != Kind::kGlobal || at(call[1]).kind != Kind::kTuple)
            return bad("a call of something that is not a function");
        const PickleGlobal& global =
            pickle_globals()[static_cast<std::size_t>(at(call[0]).integer)];
        constexpr std::size_t kMostArguments = 16;
        if (at(call[1]).items.size() > kMostArguments)
            return bad("more arguments than any function of a state dict has");
        const std::vector<std::uint32_t> arguments = at(call[1]).items;
        const bool fits = call_global(global.role, arguments);
        return fits ? Status() : bad("arguments that do not fit " + std::string(global.name));
    }

    /// False if the arguments do not fit.
    bool call_global(Role role, const std::vector<std::uint32_t>& arguments) {
        const auto is = [&](std::size_t i, Kind kind) {
            return i < arguments.size() && at(arguments[i]).kind == kind;
        };
        const auto pushed = [](const Status& status) { return status.ok(); };
        switch (role) {
            case Role::kTensor:
                return arguments.size() >= 4 && is(0, Kind::kStorage) &&
                       pushed(push_items(Kind::kTensor, arguments));
            case Role::kParameter:
                return is(0, Kind::kTensor) && pushed(push(arguments[0]));
            case Role::kDict:
                return push_dict(arguments);
            case Role::kSize:
                return arguments.size() == 1 && is(0, Kind::kTuple) && pushed(push(arguments[0]));
            case Role::kEncode:
                return arguments.size() == 2 && is(0, Kind::kText) && encode(arguments);
            case Role::kDtype:
                return is(0, Kind::kText) &&
                       pushed(push_new(Kind::kDtype, 0, at(arguments[0]).text));
            case Role::kScalar:
                return arguments.size() == 2 && is(0, Kind::kDtype) &&
                       (is(1, Kind::kBytes) || is(1, Kind::kText)) && scalar(arguments);
            case Role::kDefaultDict:
                return (arguments.empty() || (arguments.size() == 1 && is_type(arguments[0]))) &&
                       pushed(push_new(Kind::kDict));
            case Role::kObject:
            case Role::kType:
            case Role::kStorageType:
                break;
        }
        return false;
    }

    [[nodiscard]] bool is_type(std::uint32_t i) {
        return at(i).kind == Kind::kGlobal &&
               pickle_globals()[static_cast<std::size_t>(at(i).integer)].role == Role::kType;
    }

    /// An object without arguments, of a class that nothing here needs: a stand-in without attributes.
    Status push_object() {
        SPLAT_ASSIGN(const std::vector<std::uint32_t> call, pop_many(2));
        const PickleNode& global = at(call[0]);
        const PickleNode& arguments = at(call[1]);
        if (global.kind != Kind::kGlobal || arguments.kind != Kind::kTuple)
            return bad("an object of something that is not a class");
        const PickleGlobal& row = pickle_globals()[static_cast<std::size_t>(global.integer)];
        if (row.role != Role::kObject || !arguments.items.empty())
            return bad("an object of " + std::string(row.name) +
                       ", which is made by a call or has arguments here");
        return push_new(Kind::kObject);
    }

    /// OrderedDict(), and OrderedDict([[key, value], ...]), as Python 2 writes it.
    bool push_dict(const std::vector<std::uint32_t>& arguments) {
        std::vector<std::uint32_t> items;
        if (arguments.size() > 1) return false;
        if (!arguments.empty() && at(arguments[0]).kind != Kind::kList) return false;
        for (std::size_t i = 0; !arguments.empty() && i < at(arguments[0]).items.size(); ++i) {
            const PickleNode& pair = at(at(arguments[0]).items[i]);
            if (pair.kind != Kind::kList || pair.items.size() != 2) return false;
            items.insert(items.end(), pair.items.begin(), pair.items.end());
        }
        return push_items(Kind::kDict, std::move(items)).ok();
    }

    /// _codecs.encode(text, 'latin1'): bytes, in protocol 2.
    bool encode(const std::vector<std::uint32_t>& arguments) {
        const auto bytes = latin1(at(arguments[0]).text);
        if (!bytes || at(arguments[1]).text != "latin1") return false;
        cost_ += bytes->size();
        pickle_.texts_.push_back(*bytes);
        return push_new(Kind::kBytes, 0, pickle_.texts_.back()).ok();
    }

    /// numpy.core.multiarray.scalar(dtype, bytes).
    bool scalar(const std::vector<std::uint32_t>& arguments) {
        const auto value = numpy_scalar(at(arguments[0]).text, as_bytes(at(arguments[1]).text));
        return value && push(node(*value)).ok();
    }

    /// The state of an object: attributes of a dict, a parameter or a stand-in, which are ignored; a dtype's byte
    /// order.
    Status build() {
        SPLAT_ASSIGN(const std::uint32_t state, pop());
        SPLAT_TRY(need(1));
        const PickleNode& object = at(stack_.back());
        const Kind kind = at(state).kind;
        if ((object.kind == Kind::kDict || object.kind == Kind::kObject) && kind == Kind::kDict)
            return {};
        if (object.kind == Kind::kTensor && kind == Kind::kTuple) return {};
        if (object.kind == Kind::kDtype && kind == Kind::kTuple && at(state).items.size() >= 2) {
            const std::string_view order = at(at(state).items[1]).text;
            if (order == "<" || order == "|") return {};
        }
        return bad(std::string("a state for ") + kind_name(object.kind) +
                   ", which has no known state");
    }

    Status push_storage() {
        SPLAT_ASSIGN(const std::uint32_t id, pop());
        const std::vector<std::uint32_t> items = at(id).items;
        constexpr std::array kKinds = {Kind::kText, Kind::kGlobal, Kind::kText, Kind::kText,
                                       Kind::kInt};
        bool good = at(id).kind == Kind::kTuple && items.size() >= kKinds.size();
        for (std::size_t i = 0; good && i < kKinds.size(); ++i)
            good = at(items[i]).kind == kKinds[i];
        if (!good || at(items[0]).text != "storage")
            return bad("a persistent id that is not the storage of a tensor");
        SPLAT_TRY(Pickle::storage_type(at(items[1])).status());
        return push_items(Kind::kStorage, items);
    }

    Pickle& pickle_;
    DecodeBudget& budget_;
    std::uint64_t cost_ = 0;  ///< bytes of this step
    Reader reader_;
    std::size_t at_ = 0;
    std::vector<std::uint32_t> stack_;
    std::vector<std::size_t> marks_;
    std::unordered_map<std::size_t, std::uint32_t> memo_;
};

const std::array<Unpickler::Run, 256>& Unpickler::handlers() {
    using U = Unpickler;
    struct Opcode {
        std::uint8_t code;
        Run run;
    };
    static constexpr Opcode kOpcodes[] = {
        {0x80, &U::check_protocol},  // PROTO
        {0x95, &U::skip_frame},
        {'(', &U::push_mark},
        {'}', &U::push_empty<Kind::kDict>},
        {']', &U::push_empty<Kind::kList>},
        {')', &U::push_empty<Kind::kTuple>},
        {'t', &U::push_tuple<kToMark>},
        {0x85, &U::push_tuple<1>},
        {0x86, &U::push_tuple<2>},
        {0x87, &U::push_tuple<3>},
        {'a', &U::extend<Kind::kList, 1>},
        {'e', &U::extend<Kind::kList, kToMark>},
        {'s', &U::extend<Kind::kDict, 2>},
        {'u', &U::extend<Kind::kDict, kToMark>},
        {'N', &U::push_constant<kNone>},
        {0x88, &U::push_constant<kTrue>},
        {0x89, &U::push_constant<kFalse>},
        {'c', &U::push_global_lines},
        {0x93, &U::push_global_stack},  // STACK_GLOBAL
        {'R', &U::reduce},
        {0x81, &U::push_object},  // NEWOBJ
        {'b', &U::build},
        {'Q', &U::push_storage},
        {'J', &U::push_number<std::int32_t>},
        {'K', &U::push_number<std::uint8_t>},
        {'M', &U::push_number<std::uint16_t>},
        {0x8A, &U::push_long},  // LONG1
        {'G', &U::push_real},
        {'X', &U::push_sized<Kind::kText, std::uint32_t>},
        {0x8C, &U::push_sized<Kind::kText, std::uint8_t>},  // SHORT_BINUNICODE
        {'T', &U::push_sized<Kind::kText, std::uint32_t>},  // BINSTRING, a text of Python 2
        {'U', &U::push_sized<Kind::kText, std::uint8_t>},   // SHORT_BINSTRING
        {'B', &U::push_sized<Kind::kBytes, std::uint32_t>},
        {'C', &U::push_sized<Kind::kBytes, std::uint8_t>},
        {'q', &U::memo_put<std::uint8_t>},
        {'r', &U::memo_put<std::uint32_t>},
        {0x94, &U::memoize},
        {'h', &U::memo_get<std::uint8_t>},
        {'j', &U::memo_get<std::uint32_t>}};
    static constexpr auto kHandlers = [] {
        std::array<Run, 256> handlers{};
        for (const Opcode& opcode : kOpcodes) handlers[opcode.code] = opcode.run;
        return handlers;
    }();
    return kHandlers;
}

Result<Pickle> Pickle::read(Buffer bytes, DecodeBudget& budget, std::size_t count) {
    if (bytes.size() > kMaxBytes)
        return damaged("pickle: %zu bytes, the limit is %zu", bytes.size(), kMaxBytes);
    Pickle pickle;
    pickle.bytes_ = std::move(bytes);
    SPLAT_TRY(Unpickler(pickle, budget).run(count));
    return pickle;
}

}  // namespace splat::io
