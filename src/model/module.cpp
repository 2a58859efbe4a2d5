#include "model/module.h"

#include <algorithm>

#include "core/finite.h"

namespace splat::model {
namespace {

using nn::kNoValue;
using nn::ValueId;
using ops::Layout;

constexpr ops::Attribute kBlockAttributes[] = {
    {"out_channels", "integer", "0", "0: as many as x has"},
    {"up", "boolean", "false", "twice the resolution"},
    {"down", "boolean", "false", "half the resolution"},
    {"attention", "boolean", "false", "self-attention"},
    {"views", "integer", "1", "images that attend to each other"},
    {"affine_film", "boolean", "false", "gamma x + beta instead of the published shift"},
    {"dropout", "number", "0", "of activations, in training"},
    {"lora_rank", "integer", "0", "of adapters, which alone are then trained; 0: none"},
    {"lora_alpha", "number", "1", "adapters are scaled by alpha / rank"},
    {"lora_dropout", "number", "0", "of adapters' inputs, in training"},
};

/// Only its attributes matter: complete_attributes() checks and completes them.
constexpr ops::OpRow kBlockRow = {.name = kResidualBlock, .attributes = kBlockAttributes};

/// One block, without the rest of the network.
class BlockBuilder : public SongUnet {
  public:
    using SongUnet::SongUnet;

    ValueId build_block(ValueId x, ValueId embedding, ValueId tokens, ValueId counter,
                        std::uint32_t out, const ops::Attributes& attributes) {
        embedding_ = embedding;
        tokens_ = tokens;
        counter_ = counter;
        return block(
            "block", x,
            {graph_.value(x).shape[1], out, attributes.boolean("up"), attributes.boolean("down"),
             attributes.boolean("attention"), tokens != kNoValue});
    }
};

Status wrong_attribute(const char* name, double got, const char* expected) {
    return invalid("%s: attribute '%s' is %g, expected %s", kResidualBlock, name, got, expected);
}

Status check_groups(const char* what, std::uint32_t channels) {
    const std::uint32_t groups = norm_groups(channels);
    if (channels % groups == 0) return {};
    return error(Code::kShape, "%s: %s has %u channels, which do not divide into %u groups",
                 kResidualBlock, what, channels, groups);
}

/// [images, ..., last], of a port that may be absent.
Status check_port(const ModulePort* port, std::uint32_t images, std::uint32_t rank,
                  const char* expected) {
    if (port == nullptr) return {};
    const Shape& s = port->shape;
    const bool fits =
        s.rank() == rank && (rank == 1 ? s[0] == 4 : s[0] == images) && (rank < 4 || s[3] == 1);
    if (fits) return {};
    return error(Code::kShape, "%s: port '%s' has shape %s, expected %s for %u images of x",
                 kResidualBlock, port->name.c_str(), s.text().c_str(), expected, images);
}

Status check_block(const ops::Attributes& a, const Shape& x) {
    for (const char* name : {"dropout", "lora_dropout"})
        if (!(a.number(name) >= 0 && a.number(name) < 1))
            return wrong_attribute(name, a.number(name), "0 and more, below 1");
    for (const char* name : {"out_channels", "lora_rank"})
        if (a.integer(name) < 0 || a.integer(name) > (1 << 20))
            return wrong_attribute(name, a.number(name), "0 to 1048576");
    if (a.boolean("up") && a.boolean("down"))
        return invalid("%s: both 'up' and 'down' are set, expected one", kResidualBlock);
    if (a.integer("views") < 1 || x[0] % a.integer("views") != 0)
        return wrong_attribute("views", a.number("views"), "a divisor of the images of x");
    SPLAT_TRY(check_groups("port 'x'", x[1]));
    if (a.integer("out_channels") > 0)
        SPLAT_TRY(check_groups("attribute 'out_channels'",
                               static_cast<std::uint32_t>(a.integer("out_channels"))));
    return {};
}

}  // namespace

const ModulePort* Module::port(const std::string& name) const {
    const auto found =
        std::ranges::find_if(desc_.ports, [&](const ModulePort& p) { return p.name == name; });
    return found == desc_.ports.end() ? nullptr : &*found;
}

Status Module::check_ports(const std::vector<std::string>& known) const {
    std::string list;
    for (const std::string& name : known) list += " " + name;
    for (const ModulePort& given : desc_.ports) {
        if (std::ranges::find(known, given.name) == known.end())
            return invalid("%s: no port '%s'; there are:%s", desc_.type.c_str(), given.name.c_str(),
                           list.c_str());
        if (port(given.name) != &given)
            return invalid("%s: port '%s' is given twice", desc_.type.c_str(), given.name.c_str());
    }
    return {};
}

void Module::add_input(const ModulePort& port, Layout layout, bool constant, bool optional) {
    const ValueId id = graph_.input(port.name, port.shape, layout);
    const bool graded = !constant && desc_.gradients && desc_.input_gradients;
    names_.inputs.push_back({port.name, port.shape, optional, graded});
    inputs_[port.name] = id;
    if (!constant) differentiable_.push_back(id);
}

void Module::add_output(const std::string& name, ValueId value) {
    names_.outputs.push_back({name, graph_.value(value).shape, false, desc_.gradients});
    outputs_[name] = value;
}

/// Row-major ports that have gradients are parameters.
Status Module::build_operator() {
    SPLAT_ASSIGN(const ops::OpRow* row, ops::find_op(desc_.type));
    if (desc_.build.training || desc_.build.precision != Precision::kBalanced)
        return invalid(
            "%s: training and precision apply to %s; an operator does what its attributes "
            "say",
            desc_.type.c_str(), kResidualBlock);
    std::vector<std::string> known;
    for (const ops::Port& p : row->inputs) known.emplace_back(p.name);
    SPLAT_TRY(check_ports(known));
    std::vector<ValueId> values;
    for (const ops::Port& p : row->inputs) {
        const ModulePort* given = port(p.name);
        if (given == nullptr) {
            values.push_back(kNoValue);
        } else if (p.layout == Layout::kRowMajor && !p.constant) {
            const bool one = given->name == "gamma";
            const bool vector = given->shape.rank() == 1;
            inits_[p.name] = vector ? Init{Init::Kind::kConstant, one ? 1.0F : 0.0F}
                                    : Init{Init::Kind::kXavierUniform, 1};
            values.push_back(graph_.parameter(p.name, given->shape, desc_.gradients));
        } else {
            add_input(*given, p.layout, p.constant, p.optional);
            values.push_back(inputs_.at(p.name));
        }
    }
    const std::vector<ValueId> results =
        graph_.node(row->name, std::move(values), desc_.attributes);
    SPLAT_TRY(graph_.status());
    for (std::size_t i = 0; i < results.size(); ++i) add_output(row->outputs[i].name, results[i]);
    return {};
}

Status Module::build_block() {
    SPLAT_TRY(check_ports({"x", "embedding", "tokens", "random_counter"}));
    SPLAT_ASSIGN(const ops::Attributes a, ops::complete_attributes(kBlockRow, desc_.attributes));
    const ModulePort* x = port("x");
    if (x == nullptr || x->shape.rank() != 4)
        return error(Code::kShape, "%s: port 'x' has shape %s, expected [N,C,H,W]", kResidualBlock,
                     x == nullptr ? "none" : x->shape.text().c_str());
    SPLAT_TRY(check_block(a, x->shape));
    config_.views = static_cast<std::uint32_t>(a.integer("views"));
    config_.film = a.boolean("affine_film") ? Film::kAffine : Film::kReference;
    config_.dropout = static_cast<float>(a.number("dropout"));
    config_.lora.rank = static_cast<std::uint32_t>(a.integer("lora_rank"));
    config_.lora.alpha = static_cast<float>(a.number("lora_alpha"));
    config_.lora.dropout = static_cast<float>(a.number("lora_dropout"));
    const bool lora_drops = config_.lora.rank > 0 && config_.lora.dropout > 0;
    const bool random = desc_.build.training && (config_.dropout > 0 || lora_drops);
    if (random && port("random_counter") == nullptr)
        return error(Code::kShape,
                     "%s: port 'random_counter' is absent, and dropout acts: give it, of shape [4]",
                     kResidualBlock);
    if (!random && port("random_counter") != nullptr)
        return invalid(
            "%s: port 'random_counter' is given, but nothing is random: set dropout and "
            "training",
            kResidualBlock);
    const std::uint32_t images = x->shape[0];
    SPLAT_TRY(check_port(port("embedding"), images, 2, "[N,E]"));
    SPLAT_TRY(check_port(port("tokens"), images, 4, "[N,D,T,1]"));
    SPLAT_TRY(check_port(port("random_counter"), images, 1, "[4]"));
    for (const ModulePort& given : desc_.ports) {
        const bool counter = given.name == "random_counter";
        add_input(given, counter ? Layout::kRowMajor : Layout::kQuads, counter,
                  given.name == "embedding" || given.name == "tokens");
    }
    const auto value = [&](const char* name) {
        const auto found = inputs_.find(name);
        return found == inputs_.end() ? kNoValue : found->second;
    };
    const auto out = static_cast<std::uint32_t>(a.integer("out_channels"));
    BlockBuilder builder(graph_, config_, desc_.build);
    const ValueId y = builder.build_block(value("x"), value("embedding"), value("tokens"),
                                          value("random_counter"), out == 0 ? x->shape[1] : out, a);
    SPLAT_TRY(graph_.status());
    inits_ = builder.inits();
    add_output("y", y);
    return {};
}

Result<std::unique_ptr<Module>> Module::create(vk::Context& context, const ModuleDesc& desc) {
    std::unique_ptr<Module> made(new Module(context, desc));
    SPLAT_TRY(desc.type == kResidualBlock ? made->build_block() : made->build_operator());
    SPLAT_ASSIGN(nn::Parameters parameters,
                 nn::Parameters::create(context, made->graph_, desc.gradients));
    made->parameters_ = std::make_unique<nn::Parameters>(std::move(parameters));
    const auto& all = made->parameters_->all();
    const bool trained =
        std::ranges::any_of(all, [](const nn::Parameter& p) { return p.trainable; });
    if (desc.gradients && !desc.input_gradients && !trained)
        return invalid(
            "%s: no parameter of it is trained: gradients need "
            "SPLAT_MODULE_INPUT_GRADIENTS",
            desc.type.c_str());
    nn::ExecutorDesc executor;
    executor.backward = desc.gradients;
    for (const auto& [name, value] : made->outputs_) executor.outputs.push_back(value);
    if (desc.gradients) executor.grad_outputs = executor.outputs;
    if (desc.gradients && desc.input_gradients) executor.grad_inputs = made->differentiable_;
    SPLAT_ASSIGN(made->executor_,
                 nn::Executor::create(context, made->graph_, *made->parameters_, executor));
    for (const auto& [name, value] : made->inputs_)
        SPLAT_TRY(context.fill(made->executor_->tensor(value), 0));
    for (const ValueId value : executor.grad_outputs)
        SPLAT_TRY(context.fill(made->executor_->gradient(value), 0));
    return made;
}

Status Module::init(std::uint64_t seed) {
    for (const nn::Parameter& parameter : parameters_->all())
        SPLAT_TRY(
            parameters_->write(parameter, initial_values(config_, inits_.at(parameter.name),
                                                         parameter.name, parameter.shape, seed)));
    return {};
}

Status Module::unknown(const std::string& name) const {
    std::string list;
    for (const auto& [known, value] : inputs_) list += " " + known;
    for (const auto& [known, value] : outputs_) list += " " + known;
    for (const nn::Parameter& parameter : parameters_->all()) list += " " + parameter.name;
    return not_found(
        "%s: there is no '%s' here; ports and parameters are:%s, their gradients 'grad:' "
        "and the name; inputs, parameters and gradients of outputs are written",
        desc_.type.c_str(), name.c_str(), list.c_str());
}

Result<vk::BufferView> Module::target(const std::string& name) {
    if (const auto input = inputs_.find(name); input != inputs_.end())
        return executor_->tensor(input->second);
    if (const nn::Parameter* parameter = parameters_->find(name)) return parameter->value;
    const auto output = name.starts_with("grad:") ? outputs_.find(name.substr(5)) : outputs_.end();
    if (output == outputs_.end()) return unknown(name);
    if (!desc_.gradients)
        return bad_state("%s: '%s': the module was made without gradients", desc_.type.c_str(),
                         name.c_str());
    return executor_->gradient(output->second);
}

Result<vk::BufferView> Module::source(const std::string& name) {
    if (const auto output = outputs_.find(name); output != outputs_.end()) {
        if (!ran_)
            return bad_state("%s: '%s': the module has not run forward", desc_.type.c_str(),
                             name.c_str());
        return executor_->tensor(output->second);
    }
    if (!name.starts_with("grad:")) return target(name);
    const std::string of = name.substr(5);
    const nn::Parameter* parameter = parameters_->find(of);
    const auto input = inputs_.find(of);
    if (parameter == nullptr && input == inputs_.end()) return target(name);
    const bool wanted =
        parameter != nullptr
            ? parameter->grad.block != nullptr
            : desc_.gradients && desc_.input_gradients &&
                  std::ranges::find(differentiable_, input->second) != differentiable_.end();
    if (!wanted)
        return bad_state(
            "%s: '%s' is not computed: the module was made without gradients (of inputs), "
            "or it is not trained or constant",
            desc_.type.c_str(), name.c_str());
    if (parameter != nullptr) return parameter->grad;
    if (!went_back_)
        return bad_state("%s: '%s': the module has not run backward", desc_.type.c_str(),
                         name.c_str());
    return executor_->gradient(input->second);
}

namespace {

Status check_bytes(const std::string& name, const vk::BufferView& view, std::size_t bytes) {
    const std::size_t needed = view.shape.elements() * sizeof(float);
    if (bytes == needed) return {};
    return error(Code::kShape, "bytes is %zu, but '%s' of shape %s takes %zu", bytes, name.c_str(),
                 view.shape.text().c_str(), needed);
}

}  // namespace

Status Module::write(const std::string& name, const float* values, std::size_t bytes) {
    SPLAT_ASSIGN(const vk::BufferView view, target(name));
    SPLAT_TRY(check_bytes(name, view, bytes));
    const std::span<const float> given(values, bytes / sizeof(float));
    const auto input = inputs_.find(name);
    const bool constant =
        input != inputs_.end() &&
        std::ranges::find(differentiable_, input->second) == differentiable_.end();
    const std::size_t bad = constant ? given.size() : find_not_finite(given);
    if (bad < given.size())
        return invalid("'%s' holds %g at %zu, expected finite numbers", name.c_str(),
                       static_cast<double>(given[bad]), bad);
    if (const nn::Parameter* parameter = parameters_->find(name))
        return parameters_->write(*parameter, given);
    if (input != inputs_.end()) input_changed_ = true;
    return context_.write(view, values, bytes);
}

Status Module::read(const std::string& name, float* values, std::size_t bytes) {
    SPLAT_ASSIGN(const vk::BufferView view, source(name));
    SPLAT_TRY(check_bytes(name, view, bytes));
    return context_.read(view, values, bytes);
}

Status Module::forward() {
    ran_ = went_back_ = input_changed_ = false;
    SPLAT_TRY(executor_->forward());
    ran_ = true;
    return {};
}

Status Module::backward() {
    if (input_changed_)
        return bad_state(
            "%s: backward was called after an input had been written: run forward again",
            desc_.type.c_str());
    const Status done = executor_->backward();
    if (done.code() != Code::kInvalidState) went_back_ = done.ok();
    return done;
}

}  // namespace splat::model
