#pragma once

#include <vector>

#include "core/no_copy.h"
#include "vk/command_list.h"

namespace splat::vk {

class Context;

/// What a call asked for while a BatchScope was open: a list (kDispatch), or a copy or fill of its own.
struct Noted {
    CommandKind kind = CommandKind::kDispatch;
    CommandList list = {};
    BufferView from = {}, to = {};
    std::uint32_t word = 0;
    bool staged = false;        ///< copies what Context::write was given
    double* seconds = nullptr;  ///< Context::charge
    bool whole = false;         ///< see Uncancelled

    [[nodiscard]] bool same(const Noted& other) const;
    [[nodiscard]] bool touches(const BufferView& view) const;
    [[nodiscard]] double estimated_seconds() const;
};

/// Joins lists that follow one another into one, and keeps it for the next time that the same follow: one encoding, cut
/// into as few submits as their time allows. Destroy it before its context.
class Batch {
  public:
    /// `most`: lists to keep, at least the different ones of what it is used for, as the latest are kept.
    explicit Batch(std::size_t most = 32) : most_(most) {}

    /// The list that does all of `work` in its order. Errors: those of CommandList::create.
    Result<CommandList*> join(Context& context, const std::vector<Noted>& work);

  private:
    struct Joined {
        std::vector<Noted> work;  ///< keeps its lists, so that no other has their address
        CommandList list;
    };
    std::size_t most_;
    std::vector<Joined> lists_;  ///< the latest used first
};

/// While it lives, lists, fills and writes of a context are noted and run together: before Context::read, in
/// Context::flush, and at finish(). A scope within another one is part of it. Buffers freed meanwhile are not reused.
///
/// What is noted must not depend on the host's view of results: read them by Context::read or read_later. An error
/// leaves out the lists noted since the last flush; what was written is still written, before the next list.
class BatchScope : NoCopy {
  public:
    BatchScope(Context& context, Batch& batch);
    ~BatchScope();

    /// Run what is noted, unless an outer scope will.
    Status finish();

  private:
    Context& context_;
    bool outer_;
};

}  // namespace splat::vk
