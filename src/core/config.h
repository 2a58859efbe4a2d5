#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <unordered_map>
#include <variant>
#include <vector>

#include "core/status.h"

namespace splat {

/// One value of a configuration; the first is null.
using ConfigScalar = std::variant<std::monostate, bool, std::int64_t, double, std::string>;

struct ConfigEntry {
    std::string key;  ///< names from the outermost map inwards, with dots: "opt.base_lr"
    std::vector<ConfigScalar> values;
    bool list = false;  ///< a list; else there is one value
    bool map = false;   ///< a map without a value; its members follow with longer keys
};

/// A configuration as a flat table in the order of its file. A map or list inside a list is named by its index:
/// "defaults.0.dataset".
class Config {
  public:
    /// `what` names the file in messages.
    explicit Config(std::string what) : what_(std::move(what)) {}

    /// Errors: kInvalidArgument for a duplicate key, and beyond kMaxConfigEntries and kMaxConfigKey.
    Status add(ConfigEntry entry);

    /// Append a value to the list of this key.
    Status append(const std::string& key, ConfigScalar value);

    /// Replace the entry of this key, or add it.
    void set(ConfigEntry entry);

    [[nodiscard]] const std::string& what() const { return what_; }
    [[nodiscard]] const std::vector<ConfigEntry>& entries() const { return entries_; }
    [[nodiscard]] const ConfigEntry* find(const std::string& key) const;

    /// The value of a key, or `otherwise` where the key is missing or null; a whole number is also a
    /// double. T: bool, std::int64_t, double, std::string. Errors: kInvalidArgument, naming file and
    /// key, for a value of another kind.
    template <class T>
    [[nodiscard]] Result<T> get(const std::string& key, T otherwise) const;

    /// The same for a list.
    template <class T>
    [[nodiscard]] Result<std::vector<T>> get_list(const std::string& key,
                                                  std::vector<T> otherwise) const;

    /// Errors: kInvalidArgument for a key of one of these sections ("opt" has "opt.base_lr") that is not in
    /// `known`, naming the nearest known one, and for a section that is a list or a value other than null.
    [[nodiscard]] Status refuse_unknown(const std::vector<std::string>& known,
                                        const std::vector<std::string>& sections) const;

    /// Errors: kInvalidArgument, with the nearest known name, for an outermost name that is not in `known`.
    [[nodiscard]] Status refuse_unknown_sections(const std::vector<std::string>& known) const;

  private:
    std::string what_;
    std::vector<ConfigEntry> entries_;
    std::unordered_map<std::string, std::size_t> places_;
};

inline constexpr std::size_t kMaxConfigBytes = 4U << 20U;
inline constexpr std::size_t kMaxConfigEntries = 100'000;
inline constexpr std::size_t kMaxConfigKey = 1000;  ///< letters, of all levels together
inline constexpr int kMaxConfigDepth = 32;

/// YAML as Hydra and OmegaConf write it: maps, lists and scalars of one document. Plain scalars are
/// null, booleans (true, yes, on and their opposites, as in YAML 1.1), decimal numbers, or texts;
/// quoted ones are texts. "${...}" stays a text.
///
/// Errors       kInvalidArgument with the line, for text that is not YAML, nests too deep, is too large,
///              holds a NUL, has a duplicate key, no map on the outside, or a second document; kUnsupported for
///              anchors, aliases, tags and merge keys
Result<Config> read_yaml_config(std::string_view text, const std::string& what);

/// A JSON object. Errors: as visit_json(), and for a duplicate key.
Result<Config> read_json_config(std::string_view text, const std::string& what);

/// Either format: JSON if the first letter is a brace.
Result<Config> read_config(std::string_view text, const std::string& what);

/// The value of one entry as JSON; numbers with the fewest digits, at least six, that read back equal.
std::string config_value_text(const ConfigEntry& entry);

/// The table as a JSON object with nested maps, which read_json_config() reads back. Lists of lists and
/// of maps that hold scalars besides become maps without these, with indices as names.
std::string config_json(const Config& config);

/// Edit distance: the fewest insertions, deletions and replacements of a letter that turn a
/// into b.
std::size_t edit_distance(std::string_view a, std::string_view b);

/// The nearest of the words; empty if none is within a third of its letters.
std::string nearest_name(const std::string& word, const std::vector<std::string>& known);

}  // namespace splat
