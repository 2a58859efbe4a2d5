#pragma once

#include <string>
#include <vector>

#include "core/config.h"

namespace splat {

/// Reads values of a configuration into fields. A field keeps its value if the key is missing or null.
/// The first error sticks: check status() once, at the end.
class ConfigReader {
  public:
    explicit ConfigReader(const Config& config) : config_(config) {}

    void count(const char* key, std::uint32_t& field);  ///< 0 to 1000000
    void count(const char* key, std::uint64_t& field);  ///< 0 to 10^15
    void whole(const char* key, std::int64_t& field);   ///< of either sign
    void number(const char* key, float& field);         ///< finite
    void number(const char* key, double& field);        ///< finite
    void number(const char* key, double& field, double least, double most);
    void flag(const char* key, bool& field);
    void counts(const char* key, std::vector<std::uint32_t>& field);  ///< each 1 to 1000000
    void numbers(const char* key, std::vector<double>& field);
    void texts(const char* key, std::vector<std::string>& field);
    void text(const char* key, std::string& field);

    /// One of `allowed`, or `otherwise`.
    std::string choice(const char* key, const char* otherwise,
                       const std::vector<std::string>& allowed);

    [[nodiscard]] const Status& status() const { return status_; }

  private:
    template <class T>
    bool get(const char* key, T& value);
    bool take(Status status);
    void fail(const char* key, double value, const char* expected);

    const Config& config_;
    Status status_;
};

}  // namespace splat
