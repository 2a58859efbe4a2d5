// The rows that follow from the annotations of the headers.
#include <algorithm>
#include <limits>

#include "api/misuse/misuse_table.h"

namespace splat::test {
namespace {

template <class Type>
concept Versioned = requires(std::remove_pointer_t<Type> value) {
    value.struct_size;
};

}  // namespace

Parameter::Parameter(const std::string& text)
    : name(text.substr(0, text.find_first_of("?|<"))), nullable(text.find('?') != text.npos) {
    const std::size_t at = text.find_first_of("|<");
    if (at == text.npos) return;
    const std::int64_t number = std::stoll(text.substr(at + 1));
    if (text[at] == '|')
        flags = static_cast<std::uint32_t>(number);
    else
        greatest = static_cast<std::int32_t>(number);
}

template <class Info>
void MisuseTable::infos(const std::string& function, const std::string& parameter,
                        std::function<splat_result(Info*)> call) {
    for (const std::size_t size :
         {std::size_t{0}, std::size_t{4}, sizeof(Info) / 2, std::size_t{0x7FFFFFFFU}})
        add(function, parameter, "a struct_size of no version", kArgument, [call, size] {
            Output<Info> info;
            info.set_struct_size(static_cast<std::uint32_t>(size));
            const splat_result result = call(info.out());
            return info.untouched() ? result : SPLAT_ERROR_INTERNAL;
        });
}

template <class Desc>
void MisuseTable::descs(const std::string& function, const std::string& parameter, const Desc& good,
                        std::function<splat_result(const Desc*)> call) {
    const auto invalid = [&](const char* what, void (*change)(Desc&)) {
        Desc desc = good;
        change(desc);
        add(function, parameter, what, kArgument, [call, desc] { return call(&desc); });
    };
    invalid("struct_size 0", [](Desc& desc) { desc.struct_size = 0; });
    invalid("struct_size 4", [](Desc& desc) { desc.struct_size = 4; });
    invalid("struct_size beyond all versions", [](Desc& desc) { desc.struct_size = 0x7FFFFFFFU; });
    invalid("struct_size cut", [](Desc& desc) { desc.struct_size /= 2; });
    const Later<Desc> later = {good, {0, 1}};
    add(function, parameter, "a member of a later version", kUnsupported, [call, later] {
        Later<Desc> given = later;
        given.known.struct_size = sizeof given;
        return call(&given.known);
    });
    if constexpr (requires(Desc desc) { desc.flags; }) {
        invalid("unknown flags", [](Desc& desc) { desc.flags |= 1U << 31; });
        invalid("unknown flags", [](Desc& desc) { desc.flags |= 1U << 20; });
    }
    if constexpr (requires(Desc desc) { desc.next; })
        invalid("a next", [](Desc& desc) { desc.next = &desc; });
    if constexpr (requires(Desc desc) { desc.reserved; })
        invalid("a reserved member", [](Desc& desc) { desc.reserved = 1; });
}

void MisuseTable::texts(const char* function,
                        const std::function<splat_result(bool, std::size_t)>& call,
                        splat_result without_room) {
    add(function, "buffer", "none with a capacity", without_room,
        [call] { return call(true, SIZE_MAX); });
    add(function, "capacity", "0", without_room, [call] { return call(false, 0); });
    add(function, "needed", "none", without_room, [call] { return call(true, 0); });
}

template <class Type>
Type MisuseTable::usual(const Parameter& parameter) {
    static double zeros[32] = {};
    if constexpr (kIsHandle<Type>) {
        const auto found = objects_.find(typeid(Type));
        return found == objects_.end() ? nullptr : reinterpret_cast<Type>(found->second.live);
    } else if constexpr (std::is_arithmetic_v<Type>) {
        const bool one =
            parameter.greatest || parameter.name == "count" || parameter.name == "capacity";
        return static_cast<Type>(parameter.name == "bytes" ? 64 : one ? 1 : 0);
    } else if constexpr (std::is_same_v<Type, const char*>) {
        return "x";
    } else if constexpr (std::is_same_v<Type, char*>) {
        return text_out();
    } else if constexpr (std::is_same_v<Type, float*> || std::is_same_v<Type, void*>) {
        return values_out();
    } else if constexpr (std::is_same_v<Type, const void*>) {
        return zeros;
    } else if constexpr (!std::is_object_v<std::remove_pointer_t<Type>>) {
        return nullptr;  // a callback
    } else {
        using Target = std::remove_pointer_t<Type>;
        using Plain = std::remove_const_t<Target>;
        if constexpr (std::is_arithmetic_v<Plain> && std::is_const_v<Target>)
            return reinterpret_cast<Type>(zeros);
        else if constexpr (std::is_const_v<Target> || std::is_same_v<Plain, splat_image>)
            return &good<Plain>();
        else
            return out<Plain>();
    }
}

template <class Type>
void MisuseTable::wrong(const std::string& function, const Parameter& parameter, Type given,
                        std::function<splat_result(Type)> call) {
    const std::string& name = parameter.name;
    if constexpr (kIsHandle<Type>) {
        std::optional<splat_result> for_null = kHandle;
        if (parameter.nullable) for_null.reset();
        if (function.ends_with("_destroy")) for_null = SPLAT_OK;
        handles<Type>(function, name, call, for_null);
        return;
    } else if constexpr (std::is_pointer_v<Type>) {
        if (!parameter.nullable)
            add(function, name, "NULL", kArgument, [call] { return call(nullptr); });
        using Target = std::remove_pointer_t<Type>;
        using Struct = std::remove_const_t<Target>;
        if constexpr (std::is_class_v<Struct> && std::is_const_v<Target>) {
            const Struct right = given != nullptr ? *given : good<Struct>();
            reads_[function + "(" + name + ")"] = Read<Struct>{right, call};
            if constexpr (Versioned<Type>) descs<Struct>(function, name, right, call);
        } else if constexpr (Versioned<Type>) {
            infos<Target>(function, name, call);
        }
    } else if constexpr (std::is_same_v<Type, std::uint32_t>) {
        if (!parameter.flags) return;
        for (const std::uint32_t unknown : {*parameter.flags + 1, 1U << 31U, ~*parameter.flags})
            add(function, name, "unknown", kArgument, [call, unknown] { return call(unknown); });
    } else if constexpr (std::is_same_v<Type, std::int32_t>) {
        if (!parameter.greatest) return;
        for (const std::int32_t none : {INT32_MIN, -1, *parameter.greatest + 1, INT32_MAX})
            add(function, name, "no value", kArgument, [call, none] { return call(none); });
    }
}

template <class... Types, std::size_t... I>
void MisuseTable::follow_each(const char* function, splat_result (*call)(Types...),
                              const std::vector<Parameter>& parameters,
                              std::index_sequence<I...> /*indices*/) {
    using Arguments = std::tuple<Types...>;
    const auto [found, usual_ones] = rights_.try_emplace(function);
    if (usual_ones) found->second = {Arguments(usual<Types>(parameters[I])...), SPLAT_INCOMPLETE};
    const auto right_ones = std::any_cast<Arguments>(found->second.arguments);
    (wrong<Types>(function, parameters[I], std::get<I>(right_ones),
                  [call, right_ones](Types value) {
                      Arguments given = right_ones;
                      std::get<I>(given) = value;
                      return std::apply(call, given);
                  }),
     ...);
    constexpr std::size_t kCount = sizeof...(Types);
    if constexpr (kCount >= 3) {
        using Buffer = std::tuple_element_t<kCount - 3, Arguments>;
        if constexpr ((std::is_same_v<Buffer, char*> || std::is_same_v<Buffer, void*>)&&std::
                          is_same_v<std::tuple_element_t<kCount - 1, Arguments>, std::size_t*>)
            texts(
                function,
                [call, right_ones](bool null, std::size_t capacity) {
                    Arguments given = right_ones;
                    if (null) std::get<kCount - 3>(given) = nullptr;
                    std::get<kCount - 2>(given) = capacity;
                    std::get<kCount - 1>(given) = nullptr;
                    return std::apply(call, given);
                },
                found->second.without_room);
    }
}

template <class Result, class... Types>
void MisuseTable::follow(const char* function, Result (*call)(Types...),
                         const std::vector<Parameter>& parameters) {
    functions_[function] = parameters;
    if constexpr (std::is_same_v<Result, splat_result>)
        follow_each(function, call, parameters, std::index_sequence_for<Types...>());
}

void MisuseTable::generated_rows() {
    const auto parsed = [](std::initializer_list<const char*> texts) {
        return std::vector<Parameter>(texts.begin(), texts.end());
    };
#define SPLAT_HANDLE(type)
#define SPLAT_CALL(function, ...) follow(#function, function, parsed({__VA_ARGS__}));
#include "calls.inc"
}

}  // namespace splat::test
