// Gradients that leave the device while the rest of a backward pass runs.
#include "train/gradient_exchange.h"

#include <chrono>
#include <thread>

#include "ops/add.h"
#include "support/gpu_buffers.h"
#include "train/gradient_sum.h"
#include "train/rank_contexts.h"
#include "train/trainer_fixture.h"

namespace splat::test {
namespace {

using train::GradientSum;

constexpr std::uint32_t kWidth = 48;
constexpr std::uint32_t kTensors = 3;
/// The pass adds to gradients in this order.
constexpr std::uint32_t kOrder[kTensors] = {2, 0, 1};

/// Three tensors, whose gradients a slice's pass adds in three parts.
class Pass {
  public:
    explicit Pass(vk::Context& context) : context_(context) {
        nn::Graph graph(context);
        for (const char* name : {"a", "b", "c"}) graph.parameter(name, Shape{kWidth, kWidth});
        parameters.emplace(need(nn::Parameters::create(context, graph)));
        for (std::uint32_t part = 0; part < kTensors; ++part) final_in[kOrder[part]] = part;
    }
    [[nodiscard]] GradientSum sum(std::uint32_t slices, run::Group* group) {
        return need(
            GradientSum::create(context_, *parameters, slices, group, false, {kTensors, final_in}));
    }
    /// Add numbers[i] to tensor i.
    Status run(const std::vector<std::vector<float>>& numbers, const nn::BetweenParts& between) {
        for (std::uint32_t part = 0; part < kTensors; ++part) {
            if (part > 0 && between) SPLAT_TRY(between(part - 1));
            kept_.push_back(upload(context_, numbers[kOrder[part]]));
            const vk::BufferView& sum = parameters->all()[kOrder[part]].grad;
            vk::Recorder recorder(context_);
            const ops::AddDesc desc{{.n = static_cast<std::uint32_t>(sum.bytes / 16), .c = 4}};
            SPLAT_TRY(ops::add_forward(recorder, desc, sum, kept_.back().range(), sum));
            SPLAT_ASSIGN(vk::CommandList list, recorder.finish());
            SPLAT_TRY(context_.run(list));
        }
        return {};
    }
    std::vector<float> gradient(std::uint32_t tensor) {
        return download(context_, parameters->all()[tensor].grad, kWidth * kWidth);
    }
    /// Every number of a slice is a power of two of its own.
    static std::vector<std::vector<float>> numbers(std::uint32_t slice) {
        return {kTensors, std::vector<float>(kWidth * kWidth, static_cast<float>(1U << slice))};
    }
    std::vector<std::uint32_t> final_in = std::vector<std::uint32_t>(kTensors);
    std::optional<nn::Parameters> parameters;

  private:
    vk::Context& context_;
    std::vector<vk::Buffer> kept_;
};

class GradientExchanges : public RankContexts {
  protected:
    static void expect_sum(Pass& pass, std::uint32_t slices) {
        for (std::uint32_t tensor = 0; tensor < kTensors; ++tensor)
            EXPECT_EQ(pass.gradient(tensor),
                      std::vector<float>(kWidth * kWidth, static_cast<float>((1U << slices) - 1)))
                << tensor;
    }
};

/// Pieces are sent when they are final, with what waits: one, two and four slices of a rank.
TEST_F(GradientExchanges, SendFinalPieces) {
    for (const std::uint32_t ranks : {2U, 4U})
        for (const std::uint32_t slices : {4U, 8U, 12U})
            on_ranks(ranks, [&](vk::Context& context, run::Group* group, std::uint32_t rank) {
                Pass pass(context);
                auto sum = pass.sum(slices, group);
                double seconds = 0;
                const auto slice = [&](std::uint32_t i, const nn::BetweenParts& between) {
                    return pass.run(Pass::numbers(rank * slices / ranks + i), between);
                };
                for (int again = 0; again < 2; ++again) EXPECT_OK(sum.sum(slice, seconds));
                expect_sum(pass, slices);
            });
}

/// A tensor that is said to be final a part too early has a wrong sum, and others have theirs.
TEST_F(GradientExchanges, DependOnTheOrder) {
    on_ranks(2, [&](vk::Context& context, run::Group* group, std::uint32_t rank) {
        Pass pass(context);
        pass.final_in[0] = 0;
        auto sum = pass.sum(2, group);
        double seconds = 0;
        EXPECT_OK(sum.sum(
            [&](std::uint32_t, const nn::BetweenParts& between) {
                return pass.run(Pass::numbers(rank), between);
            },
            seconds));
        EXPECT_NE(pass.gradient(0).front(), 3);
        EXPECT_EQ(pass.gradient(1).front(), 3);
        EXPECT_EQ(pass.gradient(2).front(), 3);
    });
}

/// Calls of a group that wait until they are let go.
struct Gate {
    run::GroupCalls inner;
    ThreadGroup* leaves = nullptr;  ///< leave it in place of a call
    std::atomic<bool> open = false;

    [[nodiscard]] run::GroupCalls calls() {
        run::GroupCalls made = inner;
        made.user = this;
        made.send_receive = [](void* user, std::uint32_t peer, const void* sent, void* received,
                               std::uint64_t bytes) {
            auto& gate = *static_cast<Gate*>(user);
            // What agreements send is smaller.
            if (bytes > 1000 && gate.leaves != nullptr) {
                gate.leaves->leave();
                return ThreadGroup::kNobody;
            }
            for (int tries = 0; bytes > 1000 && !gate.open; ++tries) {
                if (tries == 20'000) return ThreadGroup::kNobody;
                std::this_thread::sleep_for(std::chrono::milliseconds(1));
            }
            return gate.inner.send_receive(gate.inner.user, peer, sent, received, bytes);
        };
        return made;
    }
};

/// The first exchange ends only once the next part has begun.
TEST_F(GradientExchanges, OverlapWithThePass) {
    ThreadGroup threads(2);
    threads.run([&](const run::GroupCalls& calls) {
        Gate gate{calls, nullptr};
        run::Group group(gate.calls());
        Pass pass(rank_context(calls.rank));
        auto sum = pass.sum(2, &group);
        double seconds = 0;
        const auto slice = [&](std::uint32_t, const nn::BetweenParts& between) {
            return pass.run(Pass::numbers(calls.rank), [&](std::uint32_t part) {
                const Status done = between(part);
                gate.open = true;
                return done;
            });
        };
        EXPECT_OK(sum.sum(slice, seconds));
        expect_sum(pass, 2);
    });
}

/// A pass that fails in any of its parts on one rank is every rank's error, and the next sum is right.
TEST_F(GradientExchanges, FailOnAllRanks) {
    on_ranks(4, [](vk::Context& context, run::Group* group, std::uint32_t rank) {
        Pass pass(context);
        auto sum = pass.sum(8, group);
        double seconds = 0;
        for (std::uint32_t fails = 0; fails <= kTensors; ++fails) {
            const Status done = sum.sum(
                [&](std::uint32_t i, const nn::BetweenParts& between) {
                    const auto failing = [&](std::uint32_t part) -> Status {
                        if (rank == 2 && part == fails) return invalid("no more");
                        SPLAT_TRY(between(part));
                        return rank == 2 && part + 1 == fails ? invalid("no more") : Status();
                    };
                    return pass.run(Pass::numbers(2 * rank + i),
                                    between ? failing : nn::BetweenParts());
                },
                seconds);
            if (fails == kTensors) {
                EXPECT_OK(done);
            } else {
                EXPECT_ERROR(done, Code::kInvalidArgument, "rank 2: no more");
            }
        }
        expect_sum(pass, 8);
    });
}

/// A cancelled call, too, and the next one is not.
TEST_F(GradientExchanges, AreCancelledOnAllRanks) {
    on_ranks(2, [](vk::Context& context, run::Group* group, std::uint32_t rank) {
        Pass pass(context);
        auto sum = pass.sum(2, group);
        double seconds = 0;
        for (const bool cancelled : {true, false}) {
            const std::lock_guard lock(context.mutex);
            const Status done = sum.sum(
                [&](std::uint32_t, const nn::BetweenParts& between) {
                    return pass.run(Pass::numbers(rank), [&](std::uint32_t part) {
                        if (cancelled && part == 1 && rank == 1) context.mutex.interrupt().raise();
                        return between(part);
                    });
                },
                seconds);
            EXPECT_EQ(done.code(), cancelled ? Code::kCancelled : Code::kOk);
        }
        expect_sum(pass, 2);
    });
}

/// Where a rank leaves in the middle, the group's error ends the sum.
TEST_F(GradientExchanges, EndWithTheGroup) {
    ThreadGroup threads(2);
    threads.run([&](const run::GroupCalls& calls) {
        Gate gate{calls, calls.rank == 1 ? &threads : nullptr};
        gate.open = true;
        run::Group group(gate.calls());
        Pass pass(rank_context(calls.rank));
        auto sum = pass.sum(2, &group);
        double seconds = 0;
        const auto slice = [&](std::uint32_t, const nn::BetweenParts& between) {
            return pass.run(Pass::numbers(calls.rank), between);
        };
        for (int again = 0; again < 2; ++again)
            EXPECT_ERROR(sum.sum(slice, seconds), Code::kIo, "a thread is gone");
    });
}

/// What a model's passes say is final does not change any more, and each part makes some gradients final.
TEST_F(GradientExchanges, KnowWhatAPassHasFinished) {
    vk::Context& context = rank_context(0);
    const model::ModelConfig network = small_network();
    model::ModelOptions options;
    options.gradients = true;
    options.objects = 2;
    options.most_bytes = 1;  // two slices of an object
    options.backward_parts = 1;
    const auto whole = need(model::Model::create(context, network, options));
    options.backward_parts = 4;
    const auto cut = need(model::Model::create(context, network, options));
    const Batch batch(network, small_training());
    model::ModelInput input;
    input.images = batch.images;
    input.view_to_world = batch.poses;
    input.quaternions = batch.quaternions;
    std::vector<std::vector<float>> then(cut->parameters().all().size());
    const auto read = [&](model::Model& model, std::size_t i) {
        std::vector<float> values;
        EXPECT_OK(model.parameters().read(model.parameters().all()[i].grad, values));
        return values;
    };
    const nn::BackwardParts& parts = cut->executor().parts();
    EXPECT_EQ(parts.count, 4U);
    EXPECT_EQ(whole->executor().parts().count, 1U);
    std::vector<std::uint32_t> calls;
    const auto between = [&](std::uint32_t part) -> Status {
        calls.push_back(part);
        for (std::size_t i = 0; i < then.size(); ++i)
            if (parts.final_in[i] == part) then[i] = read(*cut, i);
        return {};
    };
    for (model::Model* model : {whole.get(), cut.get()}) {
        EXPECT_OK(model->init(7));
        EXPECT_OK(model->set_input(input));
        EXPECT_OK(model->forward());
        EXPECT_OK(context.fill(model->sets(true).gaussians, 0x3f800000));
        EXPECT_OK(context.fill(model->sets(true).colors, 0x3f800000));
        EXPECT_OK(model->backward(true, model == cut.get() ? between : nn::BetweenParts()));
    }
    EXPECT_EQ(calls, (std::vector<std::uint32_t>{0, 1, 2}));
    for (std::uint32_t part = 0; part < 4; ++part)
        EXPECT_NE(std::ranges::find(parts.final_in, part), parts.final_in.end()) << part;
    for (std::size_t i = 0; i < then.size(); ++i) {
        SCOPED_TRACE(cut->parameters().all()[i].name);
        const std::vector<float> end = read(*cut, i);
        EXPECT_TRUE(end == read(*whole, i));
        if (parts.final_in[i] < 3) {
            EXPECT_TRUE(end == then[i]);
        }
    }
}

}  // namespace
}  // namespace splat::test
