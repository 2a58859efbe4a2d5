#pragma once

#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "core/os/path.h"

namespace vkrun {

/// Make a folder and those above it, where they are missing. Throws a Failure.
void make_folder(const std::filesystem::path& path);
void make_folder(const std::string& path);

/// Throws a usage Failure if the file is one of those that are read, or exists and may not be replaced.
void check_target(const std::string& path, bool overwrite,
                  const std::vector<std::string>& inputs = {});

/// The file that --out means where a command makes one: `out` itself if it has an extension or is a file, else the
/// file `name` in that folder.
std::string one_file(const std::string& out, const std::string& name);

/// ".png", in lower case.
std::string extension_of(const std::filesystem::path& path);
std::string extension_of(const std::string& path);

/// Makes the folder that the file is to lie in.
void make_folder_of(const std::string& file);

/// Throws a usage Failure if the folder is that of a training, whose report.html would be replaced.
void check_no_run(const std::string& folder, const std::string& other);

/// Throws a Failure if there is no folder for a file that will be written at the end of long work. An empty path is no
/// file.
void check_folder_of(const std::string& path);

/// A file to read; not open where there is none, or what is there is no regular file: opening a FIFO would
/// wait for its writer.
std::ifstream open_to_read(const std::filesystem::path& path);
std::ifstream open_to_read(const std::string& path);

/// The text of a configuration. Throws a usage Failure if it cannot be read.
std::string read_text(const std::string& path);

/// Write a file that was asked for, such as a plot, as replace_file(), or to a device such as /dev/stdout;
/// nothing if the path is empty. Throws a Failure.
void write_text(const std::string& path, const std::string& text);

/// Create or replace a file as a whole or not at all. It keeps its permissions, and a symbolic link its
/// target's place. Throws a Failure.
void replace_file(const std::filesystem::path& path, const std::string& text);
void replace_file(const std::string& path, const std::string& text);

/// Append to a file, which is created unless it is there: all of the text or nothing. Throws a Failure.
void append_text(const std::string& path, const std::string& text);

}  // namespace vkrun
