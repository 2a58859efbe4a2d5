#pragma once

#include "config/key_field.h"

/// What rows of the table of keys are made from.
namespace splat::config::rows {

using P = ModelConfig;
using T = TrainConfig;

inline constexpr Origin kPublished = Origin::kPublished;
inline constexpr Origin kOurs = Origin::kOurs;

template <auto... Members>
constexpr Field kNetwork = field<Members...>(Part::kNetwork);
template <auto Member>
constexpr Field kAdapters = field<&P::lora, Member>(Part::kAdapters);
template <auto... Members>
constexpr Field kTraining = field<Members...>(Part::kTraining);

inline constexpr Values kAll;
inline constexpr Values kCount{0, 1e6};
inline constexpr Values kSteps{0, 1e15};
inline constexpr Values kFraction{0, 1};

/// From `least` to below `most`.
constexpr Values below(double least, double most) {
    return {least, most, false, true};
}

constexpr Values above(double least) {
    return {.least = least, .above = true};
}

constexpr Values words(const char* list) {
    return {.words = list};
}

/// A value without effect: its type is checked, it is not stored.
template <class T>
constexpr Field kUnread{type_of<T>(), Part::kTraining,
                        [](const Config& config, const Key& key, Settings&) {
                            T value{};
                            return read_field(config, key, value);
                        }};

/// A key of published files that has no effect here.
template <class T>
constexpr Key unused(const char* name, const char* about) {
    return {name, kUnread<T>, kAll, kPublished, about, nullptr, false};
}

/// A key that a run may change when it goes on. The steps so far are the same with any value, except that
/// opt.iterations sets the rates of a cosine; a resumed run warns of that, and refuses other data.
constexpr Key resumable(Key key) {
    key.resumable = true;
    return key;
}

constexpr Key harmless(Key key) {
    key.harmless = true;
    return key;
}

constexpr Key where(const Condition& condition, Key key) {
    key.where = &condition;
    return key;
}

}  // namespace splat::config::rows
