#pragma once

#include <limits>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "config/model_config.h"
#include "config/train_config.h"
#include "core/config.h"

namespace splat::config {

/// Everything that a configuration describes.
struct Settings {
    ModelConfig network;
    TrainConfig training;
};

enum class KeyType : int {
    kInteger,
    kNumber,
    kBoolean,
    kText,
    kChoice,  ///< a word of Values::words
    kIntegers,
    kNumbers,
    kTexts,
    kMaps,  ///< read and written by config/stages.h
    kAny,   ///< several types, or not read
};

/// How a key is read and written.
enum class Part : int {
    kNetwork,
    kAdapters,  ///< adapters of the network, only where opt.lora_finetune is true
    kTraining,
    kNone,
};

enum class Origin : int {
    kPublished,  ///< a key of Splatter Image, or of its fork with priors
    kOurs,
};

/// The values that a key takes; for a list, those of each element.
struct Values {
    double least = -std::numeric_limits<double>::infinity();
    double most = std::numeric_limits<double>::infinity();
    bool above = false;      ///< more than `least`
    bool below = false;      ///< less than `most`
    const char* words = "";  ///< words of a choice, "l2, l1", in the order of its enumerators
};

struct Key;

/// Where the value of a key is kept. Without `read`, config_file.cpp reads it by a rule that takes several
/// keys; without `write`, it is not written.
struct Field {
    KeyType type = KeyType::kAny;
    Part part = Part::kNone;
    Status (*read)(const Config& config, const Key& key, Settings& settings) = nullptr;
    ConfigEntry (*write)(const Key& key, const Settings& settings) = nullptr;
};

/// Where a key has an effect; a file that asks for it elsewhere is warned of.
struct Condition {
    bool (*holds)(const Settings& settings);
    const char* otherwise;  ///< why it has no effect, behind "has no effect "
};

/// One key of a configuration.
struct Key {
    const char* name;  ///< "opt.base_lr"
    Field field;
    Values values;
    Origin origin;
    const char* about;                ///< one sentence
    const char* otherwise = nullptr;  ///< the default as JSON, where it is not that of the field
    bool acts = true;                 ///< false: accepted, but without effect
    bool resumable = false;           ///< a run may go on with another value
    bool harmless = false;  ///< says the same on any machine: without effect, and nobody is warned
    const Condition* where = nullptr;  ///< nullptr: everywhere
};

/// Every key, in the order in which a configuration is written.
std::span<const Key> all_keys();

/// NULL for an unknown name.
const Key* find_key(std::string_view name);

/// A key of the table; any other name is a defect of the library.
const Key& key_of(std::string_view name);

/// "1 to 4096", "0 to below 1", "l2, l1"; empty where every value of the type is taken.
std::string range_text(const Key& key);

/// The default as JSON; "null" for a key without effect that has none.
std::string default_text(const Key& key);

/// "integer", "list of numbers"
const char* type_name(KeyType type);

/// The table as a JSON array of {"key", "type", "range", "default", "origin" ("published", "ours"),
/// "effect" (true, false), "resumable" (true, false), "about"}.
std::string keys_json();

}  // namespace splat::config
