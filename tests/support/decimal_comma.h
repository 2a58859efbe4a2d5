#pragma once

#include <clocale>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <string>

#include "support/system.h"

namespace splat::test {

/// Numbers of this process have decimal commas while it lives: the German locale of the system, whose name on Windows
/// is another, or one that `localedef` makes in a temporary folder. False where neither is to be had.
class DecimalComma {
  public:
    DecimalComma() {
        const std::string name = "de_DE.UTF-8";
        if (set(name.c_str()) || set("German_Germany.1252")) return;
        std::filesystem::create_directories(folder_);
        const std::string made = (folder_ / name).string();
        const std::string command =
            "localedef --no-archive -i de_DE -f UTF-8 '" + made + "' >/dev/null 2>&1";
        if (std::system(command.c_str()) != 0) return;
        test::set_variable("LOCPATH", folder_.string());
        set(name.c_str());
        test::unset_variable("LOCPATH");
    }
    DecimalComma(const DecimalComma&) = delete;
    DecimalComma& operator=(const DecimalComma&) = delete;
    ~DecimalComma() {
        std::setlocale(LC_NUMERIC, "C");
        std::error_code none;
        std::filesystem::remove_all(folder_, none);
    }
    explicit operator bool() const { return is_set_; }

  private:
    bool set(const char* name) {
        char text[8] = {};
        is_set_ = std::setlocale(LC_NUMERIC, name) != nullptr &&
                  std::snprintf(text, sizeof text, "%.1f", 0.5) == 3 && text[1] == ',';
        return is_set_;
    }

    const std::filesystem::path folder_ =
        std::filesystem::temp_directory_path() / ("splat-locale-" + test::process_text());
    bool is_set_ = false;
};

}  // namespace splat::test
