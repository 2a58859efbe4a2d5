#pragma once

#include <memory>

#include "io/file.h"
#include "io/torch/pickle.h"

namespace splat::io {

/// A file of torch.save(): a pickle, and the bytes of its storages. Since PyTorch 1.6 it is a zip with a file for
/// each storage. Before, it is a magic number, a protocol number, facts of the machine, the pickle and the list of
/// keys, all of them pickles, and then, for each key, the number of elements as int64 and the elements.
class PthArchive : NoCopy {
  public:
    virtual ~PthArchive() = default;

    /// `source` must outlive the archive.
    ///
    /// Errors   kFormat if it is damaged or asks for more than the budget allows; kUnsupported for big-endian
    ///          files; as Pickle::read()
    /// Source   PyTorch's torch.serialization
    static Result<std::unique_ptr<PthArchive>> open(const Source& source, DecodeBudget& budget);

    [[nodiscard]] const Pickle& pickle() const { return pickle_; }

    /// The value that was saved.
    [[nodiscard]] const PickleNode& root() const { return pickle_.root(root_); }

    /// Bytes of a storage. Errors: kFormat if there is none of this key; `user` names a tensor that needs it.
    [[nodiscard]] virtual Result<std::uint64_t> size_of(const std::string& key,
                                                        const std::string& user) const = 0;

    /// All bytes of a storage. Errors: as size_of(), and kFormat if they are damaged.
    virtual Status read(const std::string& key, Buffer& to) const = 0;

  protected:
    Pickle pickle_;
    std::size_t root_ = 0;  ///< index of the root in pickle_
};

/// True if an archive with these files was written by torch.save().
bool is_pth_entry(const std::string& name);

/// The first bytes of a file from before PyTorch 1.6.
bool is_legacy_pth(Bytes head);

}  // namespace splat::io
