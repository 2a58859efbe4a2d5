#pragma once

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

namespace vkrun {

/// Appends scalars to an event file that TensorBoard reads.
///
/// A record is its length (uint64), the masked CRC-32C of those bytes, the payload and the masked
/// CRC-32C of it, all little-endian; the payload is an Event in protocol buffers' encoding
/// (https://github.com/tensorflow/tensorflow, core/lib/io/record_writer and core/util/event.proto).
class TensorBoard {
  public:
    /// A new file in `folder`, which is made. Throws a Failure.
    explicit TensorBoard(const std::string& folder);

    /// The first call also notes that a session starts at this step: readers then forget later steps of other files,
    /// which a killed run wrote after its last state. An event that cannot be written is missing, with one warning.
    void scalars(std::uint64_t step, const std::vector<std::pair<std::string, double>>& values);

  private:
    void add(const std::string& event);
    /// Throws a Failure.
    void record(const std::string& event);

    std::string path_;
    bool started_ = false;
    bool warned_ = false;
};

}  // namespace vkrun
