#pragma once

#include <any>
#include <deque>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <tuple>
#include <typeindex>

#include "api/raster_calls.h"
#include "support/system.h"

namespace splat::test {

/// One wrong (or barely right) way to call a function of the header.
struct Misuse {
    std::string function;
    std::string parameter;  ///< the wrong parameter; "" for a function without parameters
    std::string what;
    splat_result expected;
    std::function<splat_result()> call;
};

/// Outputs of the calls, one of each type. A failed call leaves them unchanged.
class Outputs {
  public:
    template <class Value>
    Value* of() {
        std::unique_ptr<Any>& held = held_[typeid(Value)];
        if (held == nullptr) held = std::make_unique<Held<Value>>();
        return static_cast<Held<Value>&>(*held).output.out();
    }
    [[nodiscard]] bool untouched() const {
        for (const auto& [type, held] : held_)
            if (!held->untouched()) return false;
        return true;
    }

  private:
    struct Any {
        virtual ~Any() = default;
        [[nodiscard]] virtual bool untouched() const = 0;
    };
    template <class Value>
    struct Held : Any {
        Held() {
            if constexpr (requires(Value value) { value.struct_size; })
                output.set_struct_size(sizeof(Value));
        }
        [[nodiscard]] bool untouched() const override { return output.untouched(); }
        Output<Value> output;
    };
    std::map<std::type_index, std::unique_ptr<Any>> held_;
};

/// True for the types of handles.
template <class Type>
constexpr bool kIsHandle = false;
#define SPLAT_HANDLE(type) \
    template <>            \
    constexpr bool kIsHandle<type> = true;
#define SPLAT_CALL(...)
#include "calls.inc"
#undef SPLAT_HANDLE
#undef SPLAT_CALL

/// A struct as a later version of the library may have it.
template <class Known>
struct Later {
    Known known;
    std::uint64_t added[2];
};

/// A parameter as its annotation describes it.
struct Parameter {
    explicit Parameter(const std::string& text);  ///< text: one parameter in calls.inc

    std::string name;
    bool nullable;
    std::optional<std::uint32_t> flags;    ///< known bits
    std::optional<std::int32_t> greatest;  ///< the last value of its enum
};

/// Live and destroyed objects, and the wrong calls: those that follow from the annotations, made from one right
/// call of each function, and those that are written by hand.
class MisuseTable {
  public:
    MisuseTable();
    MisuseTable(const MisuseTable&) = delete;
    MisuseTable& operator=(const MisuseTable&) = delete;
    ~MisuseTable() { std::filesystem::remove(image_file_); }
    [[nodiscard]] const std::vector<Misuse>& rows() const { return rows_; }
    [[nodiscard]] bool untouched() const { return outputs_.untouched(); }
    /// The parameters of each function of the headers.
    [[nodiscard]] const std::map<std::string, std::vector<Parameter>>& functions() const {
        return functions_;
    }

  private:
    void keep_objects();
    void right_descs();
    void right_calls();
    void generated_rows();
    void device_rows();
    void tensor_rows();
    void scene_rows();
    void scene_file_rows();
    void camera_rows();
    void camera_file_rows();
    void rasterizer_rows();
    void forward_rows();
    void raster_output_rows();
    void scene_render_rows();
    void mesh_rows();
    void image_rows();
    void image_memory_rows();
    void weights_rows();
    void memory_rows();
    void dataset_rows();
    void table_rows();
    void model_rows();
    void model_pass_rows();
    void module_rows();
    void config_rows();
    void training_rows();
    void picture_rows();
    void predictor_rows();
    void evaluator_rows();
    void comparison_rows();
    void optimizer_rows();
    void prior_score_rows();
    void point_rows();
    void prior_model_rows();

    template <class Handle>
    static std::uintptr_t number(Handle handle) {
        return reinterpret_cast<std::uintptr_t>(handle);
    }
    template <class Value>
    Value* out() {
        return outputs_.of<Value>();
    }
    float* values_out() { return *out<float[16]>(); }
    char* text_out() { return *out<char[16]>(); }

    /// Name a live object, and one to destroy, to the rows of wrong handles.
    template <class Owner>
    void keep(const Owner& live, Owner destroyed) {
        objects_[typeid(decltype(live.get()))] = {number(live.get()), number(destroyed.destroy())};
    }
    template <class Handle>
    [[nodiscard]] Handle stale() const {
        return reinterpret_cast<Handle>(objects_.at(typeid(Handle)).stale);
    }
    /// Give the value that pointers to such structs have in right calls.
    template <class Struct>
    void good(const Struct& value) {
        goods_[typeid(Struct)] = std::make_shared<Struct>(value);
    }
    template <class Struct>
    Struct& good() {
        std::shared_ptr<void>& held = goods_[typeid(Struct)];
        if (held == nullptr) {
            auto made = std::make_shared<Struct>();
            if constexpr (requires { made->struct_size; }) *made = sized<Struct>();
            held = std::move(made);
        }
        return *static_cast<Struct*>(held.get());
    }
    /// Say what right arguments are, where usual() does not, and what a call with a text of no room returns.
    template <class... Types>
    void right(const char* function, splat_result (*call)(Types...), splat_result without_room,
               std::type_identity_t<Types>... arguments) {
        static_cast<void>(call);
        rights_[function] = {std::tuple<Types...>(arguments...), without_room};
    }
    /// An argument that is right for most functions: objects and structs of this table.
    template <class Type>
    Type usual(const Parameter& parameter);

    [[nodiscard]] Optimizer make_optimizer(const splat_optimizer_item& item) const;
    void add(const std::string& function, const std::string& parameter, const char* what,
             splat_result expected, std::function<splat_result()> call);
    /// The rows that follow from a function's annotations.
    template <class Result, class... Types>
    void follow(const char* function, Result (*call)(Types...),
                const std::vector<Parameter>& parameters);
    template <class... Types, std::size_t... I>
    void follow_each(const char* function, splat_result (*call)(Types...),
                     const std::vector<Parameter>& parameters, std::index_sequence<I...> indices);
    /// The rows of one parameter: `call` gives it another value.
    template <class Type>
    void wrong(const std::string& function, const Parameter& parameter, Type given,
               std::function<splat_result(Type)> call);
    /// All invalid handles of the kind: NULL, destroyed, of other kinds, never created.
    template <class Handle>
    void handles(const std::string& function, const std::string& parameter,
                 std::function<splat_result(Handle)> call, std::optional<splat_result> for_null);
    /// An info or stats struct: sizes of no version.
    template <class Info>
    void infos(const std::string& function, const std::string& parameter,
               std::function<splat_result(Info*)> call);
    /// A struct that is read: the same, unknown flags, a next that is not NULL, a reserved member.
    template <class Desc>
    void descs(const std::string& function, const std::string& parameter, const Desc& good,
               std::function<splat_result(const Desc*)> call);
    /// A buffer, capacity and needed: NULL and 0.
    void texts(const char* function, const std::function<splat_result(bool, std::size_t)>& call,
               splat_result without_room);

    template <class... Types>
    class WrongCalls;
    template <class... Types>
    WrongCalls<Types...> wrong_calls(const char* function, splat_result (*call)(Types...)) {
        return {*this, function, call};
    }

    /// Adds rows of a struct that is read with one wrong member.
    template <class Struct>
    struct WrongStructs {
        MisuseTable& table;
        std::string function, parameter, named;

        void operator()(const char* what, splat_result expected,
                        const std::function<void(Struct&)>& change) const {
            const auto& read = std::any_cast<const Read<Struct>&>(
                table.reads_.at(function + "(" + parameter + ")"));
            Struct value = read.good;
            change(value);
            table.add(function, named, what, expected,
                      [call = read.call, value] { return call(&value); });
        }
    };
    /// The rows name `named`, where that is not the parameter that is wrong.
    template <class Struct>
    WrongStructs<Struct> wrong_structs(const char* function, const char* parameter = "desc",
                                       const char* named = nullptr) {
        return {*this, function, parameter, named == nullptr ? parameter : named};
    }

    void mesh_views_rows(const WrongStructs<splat_mesh_views_desc>& invalid);

    /// A function that reads a struct: a right one, and the call with another.
    template <class Struct>
    struct Read {
        Struct good;
        std::function<splat_result(const Struct*)> call;
    };
    struct Object {
        std::uintptr_t live, stale;
    };
    struct Right {
        std::any arguments;
        splat_result without_room;
    };
    Outputs outputs_;
    const std::string image_file_ =
        (std::filesystem::temp_directory_path() / ("splat-misuse-" + test::process_text() + ".png"))
            .string();
    Device device_ = open_device(SPLAT_DEVICE_PROFILE);
    Tensor tensor_ = make_tensor(device_, {4}, "mine");
    Tensor matrix_ = make_tensor(device_, {2, 2});
    Tensor result_ = make_tensor(device_, {2, 2});
    OpRequest request_{"linear", {matrix_, matrix_, nullptr}, {result_}};
    Op op_ = make_op(device_, request_);
    Scene scene_ = SampleScene(3).create();
    Mesh mesh_ = make_mesh();
    Rasterizer rasterizer_ =
        make_rasterizer(device_, rasterizer_desc(3, 16, 16, SPLAT_RASTERIZER_BACKWARD, 1));
    Rasterizer drawn_ = make_rasterizer(device_, rasterizer_desc(3, 16, 16));
    RasterState state_ = make_state(rasterizer_);
    /// Belongs to another rasterizer.
    RasterState foreign_state_ = make_state(make_rasterizer(device_, rasterizer_desc(3, 16, 16)));
    Weights weights_ = make_weights();
    splat_weights weights_handle_ = weights_.get();  ///< handle that descs point to
    Model model_ = make_model(device_);
    Module module_ = make_module(device_);
    Predictor predictor_ = make_predictor(device_);
    Trainer trainer_ = make_trainer(device_);
    splat_optimizer_item item_{"mine", nullptr, nullptr, matrix_, result_};
    Optimizer optimizer_ = make_optimizer(item_);
    Dataset dataset_ = make_dataset();
    Batches batches_ = make_batches();
    Training run_ = make_training(device_);
    Evaluator evaluator_ = make_evaluator(dataset_);
    Comparison comparison_ = make_comparison();
    std::deque<splat_optimizer_item> items_;  ///< items to which wrong descs point
    std::map<std::type_index, Object> objects_;
    std::map<std::type_index, std::shared_ptr<void>> goods_;
    std::map<std::string, Right> rights_;
    std::map<std::string, std::any> reads_;
    std::map<std::string, std::vector<Parameter>> functions_;
    std::vector<Misuse> rows_;
};

/// Adds rows of one function: its right call with some arguments replaced.
template <class... Types>
class MisuseTable::WrongCalls {
  public:
    WrongCalls(MisuseTable& table, const char* function, splat_result (*call)(Types...))
        : table_(table),
          function_(function),
          call_(call),
          arguments_(std::any_cast<Arguments>(table.rights_.at(function).arguments)) {}

    [[nodiscard]] const char* function() const { return function_.c_str(); }
    /// The same with another right argument. A value to which the parameter points is copied.
    template <class Value>
    [[nodiscard]] WrongCalls given(const std::string& parameter, const Value& value) const {
        WrongCalls other = *this;
        const std::vector<Parameter>& parameters = table_.functions_.at(function_);
        const bool found = [&]<std::size_t... I>(std::index_sequence<I...> /*indices*/) {
            return ((parameters[I].name == parameter && other.template assign<I>(value)) || ...);
        }
        (std::index_sequence_for<Types...>());
        EXPECT_TRUE(found) << function_ << ": " << parameter;
        return other;
    }
    /// A row of these arguments, named by one of them.
    const WrongCalls& as_is(const char* parameter, const char* what, splat_result expected) const {
        table_.add(function_, parameter, what, expected,
                   [call = call_, arguments = arguments_, held = held_] {
                       return std::apply(call, arguments);
                   });
        return *this;
    }
    /// A row for each value of one parameter.
    template <class... Values>
    const WrongCalls& each(const char* parameter, const char* what, splat_result expected,
                           const Values&... values) const {
        (given(parameter, values).as_is(parameter, what, expected), ...);
        return *this;
    }

  private:
    using Arguments = std::tuple<Types...>;

    template <std::size_t I, class Value>
    bool assign(const Value& value) {
        using Type = std::tuple_element_t<I, Arguments>;
        if constexpr (std::is_convertible_v<const Value&, Type>) {
            std::get<I>(arguments_) = static_cast<Type>(value);
        } else if constexpr (std::is_same_v<Value*, Type> || std::is_same_v<const Value*, Type>) {
            auto copy = std::make_shared<Value>(value);
            std::get<I>(arguments_) = copy.get();
            held_.push_back(std::move(copy));
        } else {
            return false;
        }
        return true;
    }

    MisuseTable& table_;
    std::string function_;
    splat_result (*call_)(Types...);
    Arguments arguments_;
    std::vector<std::shared_ptr<void>> held_;  ///< values to which arguments point
};

/// Rows of this function.
#define SPLAT_WRONG(function) wrong_calls(#function, function)

template <class Handle>
void MisuseTable::handles(const std::string& function, const std::string& parameter,
                          std::function<splat_result(Handle)> call,
                          std::optional<splat_result> for_null) {
    if (for_null) add(function, parameter, "NULL", *for_null, [call] { return call(nullptr); });
    const auto bad = [&](const char* what, std::uintptr_t key) {
        add(function, parameter, what, kHandle,
            [call, key] { return call(reinterpret_cast<Handle>(key)); });
    };
    for (const auto& [type, object] : objects_) {
        if (type != typeid(Handle)) bad("a handle of another kind", object.live);
        bad("a destroyed handle", object.stale);
    }
    bad("a small number", 1);
    bad("an address", number(&rows_));
    bad("all ones", ~std::uintptr_t{0});
    bad("a handle not yet given", number(op_.get()) + (1U << 20));
}

}  // namespace splat::test
