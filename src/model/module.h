#pragma once

#include <map>
#include <memory>
#include <string>
#include <vector>

#include "core/json.h"
#include "model/song_unet.h"
#include "nn/executor.h"
#include "ops/op_table.h"

namespace splat::model {

/// A tensor that the caller writes, named after a port of an operator or residual block.
struct ModulePort {
    std::string name;
    Shape shape;
    bool optional = false;  ///< an input that the type works without, too
    bool graded = false;    ///< a pass computes or takes its gradient
};

struct ModuleDesc {
    std::string type;  ///< an operator of ops::op_table(), or kResidualBlock
    std::vector<JsonScalar> attributes;
    std::vector<ModulePort> ports;
    bool gradients = false;
    bool input_gradients = false;
    BuildOptions build;
};

/// A block of the network (song_unet.h) with all optional parts.
///
/// Ports: x [N,C,H,W]; embedding [N,E] adds FiLM; tokens [N,D,T,1] add attention to them; random_counter [4]
/// (bits of seed, seed >> 32, step, 0) if dropout acts. Parameters are named "block." and as in the state dict;
/// the output is "y".
inline constexpr const char* kResidualBlock = "residual_block";

/// One operator or one block with its parameters as a separate graph, run by names of ports.
class Module {
  public:
    /// Parameters are zero until init() or write(). Errors: kInvalidArgument (type, an attribute, a port
    /// that the type does not have), kShape, kUnsupported, kOutOfDeviceMemory.
    static Result<std::unique_ptr<Module>> create(vk::Context& context, const ModuleDesc& desc);

    /// Initialise the parameters from a seed: of a block like the network's (init.h); of an operator gamma is
    /// 1, other vectors are 0, matrices and kernels have Xavier's uniform distribution.
    Status init(std::uint64_t seed);

    /// Write "x" (a port), "block.conv0.weight" (a parameter) or "grad:y" (of an output); ports start at zero.
    /// Errors: kNotFound for an unknown name (lists the known ones); kInvalidArgument for values that are not finite,
    /// except in constants, which may hold bits; kShape (bytes); kInvalidState (created without gradients).
    Status write(const std::string& name, const float* values, std::size_t bytes);

    /// Read those and "y", "grad:x", "grad:block.conv0.weight". Errors: as write(); kInvalidState before the
    /// pass that computes them, or if none does.
    Status read(const std::string& name, float* values, std::size_t bytes);

    Status forward();

    /// kInvalidState as nn::Executor::backward, and if an input has been written since; gradients stay.
    Status backward();

    [[nodiscard]] nn::Parameters& parameters() { return *parameters_; }

    struct Names {
        std::vector<ModulePort> inputs, outputs;
    };
    [[nodiscard]] const Names& names() const { return names_; }
    [[nodiscard]] const std::string& type() const { return desc_.type; }
    [[nodiscard]] bool has_gradients() const { return desc_.gradients; }
    [[nodiscard]] nn::ExecutorMemory memory() const { return executor_->memory(); }

  private:
    Module(vk::Context& context, ModuleDesc desc)
        : context_(context), desc_(std::move(desc)), graph_(context) {}
    Result<vk::BufferView> target(const std::string& name);
    Result<vk::BufferView> source(const std::string& name);
    Status build_operator();
    Status build_block();
    Status check_ports(const std::vector<std::string>& known) const;
    [[nodiscard]] const ModulePort* port(const std::string& name) const;
    void add_input(const ModulePort& port, ops::Layout layout, bool constant, bool optional);
    void add_output(const std::string& name, nn::ValueId value);
    [[nodiscard]] Status unknown(const std::string& name) const;

    vk::Context& context_;
    ModuleDesc desc_;
    nn::Graph graph_;
    ModelConfig config_;  ///< configuration of a block
    std::map<std::string, Init> inits_;
    std::unique_ptr<nn::Parameters> parameters_;
    std::unique_ptr<nn::Executor> executor_;
    Names names_;
    std::map<std::string, nn::ValueId> inputs_, outputs_;
    std::vector<nn::ValueId> differentiable_;  ///< inputs that can have a gradient
    bool ran_ = false;
    bool went_back_ = false;
    bool input_changed_ = false;  ///< since forward
};

}  // namespace splat::model
