#include <algorithm>
#include <cmath>

#include "api/api_guard.h"
#include "api/core/tensor_arguments.h"
#include "train/optimiser_groups.h"

using namespace splat;

namespace {

/// The parameters of a call's items, and the objects that hold them.
struct OptimizerItems {
    train::OptimiserDesc adam;
    std::vector<std::shared_ptr<api::ModelObject>> models;
    std::vector<std::shared_ptr<api::ModuleObject>> modules;
    std::vector<std::shared_ptr<api::TensorObject>> tensors;
};

Status on_device(const api::OfDevice& object, const vk::Context& context, const std::string& what) {
    if (object.context.get() == &context) return {};
    return invalid("%s is on another device than the optimizer", what.c_str());
}

Status add_tensor(const splat_optimizer_item& item, const std::string& what,
                  const vk::Context& context, OptimizerItems& to) {
    SPLAT_TRY(api::require(item.name, (what + ".name").c_str()));
    SPLAT_TRY(api::require(item.parameter, (what + ".parameter").c_str()));
    SPLAT_TRY(api::require(item.gradient, (what + ".gradient").c_str()));
    SPLAT_ASSIGN(auto value, api::find_tensor(item.parameter, (what + ".parameter").c_str(),
                                              context, "optimizer"));
    SPLAT_ASSIGN(auto grad, api::find_tensor(item.gradient, (what + ".gradient").c_str(), context,
                                             "optimizer"));
    if (value == grad)
        return invalid("%s.gradient is the same tensor as its parameter", what.c_str());
    if (!(value->view.shape == grad->view.shape))
        return error(Code::kShape, "%s.gradient has the shape %s, expected %s", what.c_str(),
                     grad->view.shape.text().c_str(), value->view.shape.text().c_str());
    to.adam.parameters.push_back({item.name, value->view.shape, value->view, grad->view});
    to.tensors.push_back(std::move(value));
    to.tensors.push_back(std::move(grad));
    return {};
}

Status check_gradients(bool made, const std::string& what, const char* flag) {
    if (made) return {};
    return bad_state("%s was created without %s, so it has no gradients", what.c_str(), flag);
}

Status add_item(const splat_optimizer_item& item, const std::string& what,
                const vk::Context& context, OptimizerItems& to) {
    const bool tensor = item.parameter != nullptr || item.gradient != nullptr;
    const int kinds = (item.model != nullptr) + (item.module != nullptr) + (tensor ? 1 : 0);
    if (kinds != 1)
        return invalid("%s has %d of a model, a module and a tensor, expected one of them",
                       what.c_str(), kinds);
    if (tensor) return add_tensor(item, what, context, to);
    const std::string prefix = item.name == nullptr ? "" : item.name;
    if (item.model != nullptr) {
        SPLAT_ASSIGN(auto model, api::Models::find(item.model, (what + ".model").c_str()));
        SPLAT_TRY(on_device(*model, context, what + ".model"));
        SPLAT_TRY(check_gradients(model->model->has_gradients(), what + ".model",
                                  "SPLAT_MODEL_GRADIENTS"));
        SPLAT_TRY(train::add_parameters(to.adam, model->model->parameters(), prefix));
        to.models.push_back(std::move(model));
        return {};
    }
    SPLAT_ASSIGN(auto module, api::Modules::find(item.module, (what + ".module").c_str()));
    SPLAT_TRY(on_device(*module, context, what + ".module"));
    SPLAT_TRY(check_gradients(module->module->has_gradients(), what + ".module",
                              "SPLAT_MODULE_GRADIENTS"));
    SPLAT_TRY(train::add_parameters(to.adam, module->module->parameters(), prefix));
    to.modules.push_back(std::move(module));
    return {};
}

Status add_groups(const splat_optimizer_desc& desc, OptimizerItems& to) {
    if (desc.group_count > 0) SPLAT_TRY(api::require(desc.groups, "splat_optimizer_desc.groups"));
    std::vector<train::OptimiserGroup> groups;
    for (std::uint64_t i = 0; i < desc.group_count; ++i) {
        const splat_optimizer_group& group = desc.groups[i];
        const std::string what = format("groups[%llu]", llu(i));
        SPLAT_TRY(api::require(group.pattern, (what + ".pattern").c_str()));
        if (!std::isfinite(group.rate_factor) || group.rate_factor < 0)
            return invalid("%s.rate_factor is %g, expected a finite number of 0 or more",
                           what.c_str(), group.rate_factor);
        groups.push_back({group.pattern, group.rate_factor, {group.beta1, group.beta2}, group.eps});
    }
    train::OptimiserRule base;
    if (desc.beta1 != 0) base.betas[0] = desc.beta1;
    if (desc.beta2 != 0) base.betas[1] = desc.beta2;
    if (desc.eps != 0) base.eps = desc.eps;
    return train::apply_groups(to.adam, base, groups);
}

/// Errors: kInvalidArgument for a number that is out of range, missing or without effect.
Status check_schedule(const splat_optimizer_desc& desc) {
    const auto refuse = [](const char* field, const char* why) {
        return invalid("splat_optimizer_desc.%s %s", field, why);
    };
    const bool cosine = desc.schedule == SPLAT_SCHEDULE_COSINE;
    const bool step = desc.schedule == SPLAT_SCHEDULE_STEP;
    if (desc.schedule < 0 || desc.schedule > SPLAT_SCHEDULE_STEP)
        return refuse("schedule", "is unknown, expected 0 to 3");
    if (!std::isfinite(desc.rate) || desc.rate < 0)
        return refuse("rate", "is out of range, expected a finite number of 0 or more");
    if (cosine && desc.total_steps <= desc.warmup_steps)
        return refuse("total_steps", "is too small, expected more than warmup_steps");
    if (!cosine && desc.total_steps != 0)
        return refuse("total_steps", "has no effect without SPLAT_SCHEDULE_COSINE");
    if (step && desc.step_at == 0)
        return refuse("step_at", "is 0, expected a step with SPLAT_SCHEDULE_STEP");
    if (!step && desc.step_at != 0)
        return refuse("step_at", "has no effect without SPLAT_SCHEDULE_STEP");
    if (!(desc.ema_decay >= 0 && desc.ema_decay < 1))
        return refuse("ema_decay", "is out of range, expected 0 to less than 1");
    if (desc.ema_decay == 0 && (desc.ema_every != 0 || desc.ema_after != 0))
        return refuse("ema_decay", "is 0, so ema_every and ema_after have no effect");
    return {};
}

config::TrainConfig schedule_of(const splat_optimizer_desc& desc) {
    config::TrainConfig schedule;
    if (desc.rate != 0) schedule.learning_rate = desc.rate;
    schedule.warmup = desc.warmup_steps;
    schedule.iterations = desc.total_steps;
    schedule.step_lr_at = desc.step_at;
    if (desc.schedule == SPLAT_SCHEDULE_COSINE) schedule.schedule = config::Schedule::kCosine;
    if (desc.schedule == SPLAT_SCHEDULE_STEP) schedule.schedule = config::Schedule::kStep;
    return schedule;
}

/// Set what splat_optimizer_get_info gives. The context's mutex is held.
void describe(api::OptimizerObject& object) {
    const train::Optimiser& optimiser = *object.optimiser;
    const train::OptimiserStep& last = object.last;
    splat_optimizer_info info{};
    info.was_skipped = last.was_skipped ? 1 : 0;
    info.step = optimiser.steps();
    info.skipped = optimiser.skipped();
    info.rate = object.stepped ? last.rate : optimiser.rate();
    info.non_finite = last.gradients.non_finite;
    info.gradients_zero = object.stepped && last.gradients.zero ? 1 : 0;
    info.averaged = optimiser.averages() ? 1 : 0;
    for (const train::OptimiserParameter& parameter : optimiser.parameters()) {
        info.parameters += 1;
        info.elements += parameter.shape.elements();
    }
    const std::lock_guard lock(object.info_mutex);
    object.info = info;
}

Status check_tensors(const api::OptimizerObject& object) {
    for (const auto& tensor : object.tensors) SPLAT_TRY(api::check_unmapped(*tensor));
    for (const auto& model : object.models) SPLAT_TRY(model->model->check_unmapped());
    return {};
}

/// Weights made by `make(object, weights)`, as a new handle.
template <class Make>
splat_result give_weights(splat_optimizer optimizer, const char* argument, splat_weights* weights,
                          const Make& make) {
    return api::locked(optimizer, [&](auto& object) -> Status {
        SPLAT_TRY(api::require(weights, argument));
        SPLAT_TRY(check_tensors(object));
        auto made = std::make_shared<api::WeightsObject>();
        SPLAT_TRY(make(object, made->file));
        made->from = "optimizer";
        *weights = api::Weights::add(std::move(made));
        return {};
    });
}

}  // namespace

splat_result splat_optimizer_create(splat_device device, const splat_optimizer_desc* desc,
                                    splat_optimizer* optimizer) {
    const auto make = [&](const auto& owner) -> api::Optimizers::Made {
        SPLAT_TRY(api::check_desc(desc, 0));
        SPLAT_TRY(check_schedule(*desc));
        if (desc->item_count > 0)
            SPLAT_TRY(api::require(desc->items, "splat_optimizer_desc.items"));
        OptimizerItems items;
        for (std::uint64_t i = 0; i < desc->item_count; ++i)
            SPLAT_TRY(
                add_item(desc->items[i], format("items[%llu]", llu(i)), *owner->context, items));
        SPLAT_TRY(train::check_distinct(items.adam));
        SPLAT_TRY(add_groups(*desc, items));
        items.adam.schedule = schedule_of(*desc);
        if (desc->ema_decay > 0)
            items.adam.ema = ops::EmaSchedule{std::max<std::uint64_t>(desc->ema_every, 1),
                                              desc->ema_after, desc->ema_decay};
        auto object = std::make_shared<api::OptimizerObject>(owner->context);
        object->models = std::move(items.models);
        object->modules = std::move(items.modules);
        object->tensors = std::move(items.tensors);
        const std::lock_guard lock(object->context->mutex);
        SPLAT_TRY(object->context->device().alive());
        SPLAT_ASSIGN(train::Optimiser made,
                     train::Optimiser::create(*object->context, std::move(items.adam)));
        object->optimiser = std::make_unique<train::Optimiser>(std::move(made));
        describe(*object);
        return object;
    };
    return api::create_of(device, optimizer, make);
}

splat_result splat_optimizer_step(splat_optimizer optimizer, splat_optimizer_info* info) {
    return api::locked(optimizer, [&](auto& object) -> Status {
        if (info != nullptr) SPLAT_TRY(api::check_fill(info, "info"));
        SPLAT_TRY(check_tensors(object));
        for (const auto& tensor : object.tensors) tensor->written();
        SPLAT_TRY(object.optimiser->step(object.last));
        object.stepped = true;
        describe(object);
        if (info != nullptr) api::give(object.info, info);
        return {};
    });
}

splat_result splat_optimizer_gather_rows(splat_optimizer optimizer, const char* pattern,
                                         const int64_t* rows, uint64_t count) {
    return api::locked(optimizer, [&](auto& object) -> Status {
        SPLAT_TRY(api::require(pattern, "pattern", rows, "rows"));
        SPLAT_ASSIGN(const std::vector<std::size_t> found,
                     train::find_parameters(object.optimiser->parameters(), pattern));
        SPLAT_TRY(check_tensors(object));
        for (const auto& tensor : object.tensors) tensor->written();
        SPLAT_TRY(object.optimiser->gather_rows(found, {rows, count}));
        describe(object);
        return {};
    });
}

splat_result splat_optimizer_zero_gradients(splat_optimizer optimizer) {
    return api::locked(optimizer, [&](auto& object) -> Status {
        SPLAT_TRY(check_tensors(object));
        return object.optimiser->zero_gradients();
    });
}

splat_result splat_optimizer_set_rate(splat_optimizer optimizer, double rate) {
    return api::locked(optimizer, [&](auto& object) -> Status {
        if (!std::isfinite(rate) || rate < 0)
            return invalid("rate is %g, expected a finite number of 0 or more", rate);
        object.optimiser->set_rate(rate);
        describe(object);
        return {};
    });
}

splat_result splat_optimizer_get_info(splat_optimizer optimizer, splat_optimizer_info* info) {
    return api::describe(optimizer, info, "info", [](auto& object) {
        const std::lock_guard lock(object.info_mutex);
        return object.info;
    });
}

splat_result splat_optimizer_store(splat_optimizer optimizer, splat_weights* weights) {
    return give_weights(optimizer, "weights", weights,
                        [](api::OptimizerObject& object, io::WeightsFile& file) -> Status {
                            SPLAT_ASSIGN(file.tensors, object.optimiser->averaged());
                            return {};
                        });
}

splat_result splat_optimizer_save(splat_optimizer optimizer, splat_weights* state) {
    return give_weights(optimizer, "state", state,
                        [](api::OptimizerObject& object, io::WeightsFile& file) -> Status {
                            SPLAT_ASSIGN(file, object.optimiser->state());
                            return {};
                        });
}

splat_result splat_optimizer_load(splat_optimizer optimizer, splat_weights state) {
    return api::locked(optimizer, [&](auto& object) -> Status {
        SPLAT_ASSIGN(const auto weights, api::weights_to_use(state, "state"));
        SPLAT_TRY(object.optimiser->load_state(weights->file));
        object.stepped = false;
        object.last = {};
        describe(object);
        return {};
    });
}
