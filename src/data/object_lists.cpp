#include "data/object_lists.h"

#include <sstream>

#include "core/json_tree.h"
#include "core/number_in.h"
#include "core/path_name.h"
#include "core/shown.h"
#include "data/folder.h"
#include "io/file.h"
#include "io/reader.h"

namespace splat::data {
namespace {

constexpr std::uint64_t kMaxListFileBytes = 1U << 26;

/// Three numbers with '_' between them.
bool is_sequence_name(std::string_view word) {
    std::size_t parts = 1;
    for (std::size_t i = 0; i < word.size(); ++i) {
        if (word[i] != '_') continue;
        if (i == 0 || i + 1 == word.size() || word[i + 1] == '_') return false;
        ++parts;
    }
    return parts == 3;
}

bool is_sequence_character(char c) {
    return (c >= '0' && c <= '9') || c == '_';
}

bool is_word_character(char c) {
    return is_sequence_character(c) || (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z');
}

}  // namespace

bool is_folder_name(const std::string& name) {
    return is_name_in_folder(name) && name.front() != '.';
}

Result<std::vector<std::string>> load_object_list(const std::string& path) {
    SPLAT_ASSIGN(const io::Buffer file, io::read_file(path, kMaxListFileBytes));
    SPLAT_ASSIGN(const auto tree,
                 in_file(io::from_file(parse_json_tree(io::as_text(file), "objects")), path));
    const JsonTree::List* list = tree.list();
    if (list == nullptr || list->empty())
        return damaged("'%s': expected a JSON array of the names of objects", path.c_str());
    std::vector<std::string> names;
    std::set<std::string> seen;
    for (std::size_t i = 0; i < list->size(); ++i) {
        const std::string* name = (*list)[i].text();
        if (name == nullptr || !is_folder_name(*name))
            return damaged("'%s': element %zu is not the name of a folder", path.c_str(), i);
        if (!seen.insert(*name).second)
            return damaged("'%s': element %zu, '%s', occurs twice", path.c_str(), i,
                           shown(*name).c_str());
        names.push_back(*name);
    }
    return names;
}

Result<std::set<std::string>> load_excluded_sequences(const std::string& path) {
    SPLAT_ASSIGN(const io::Buffer file, io::read_file(path, kMaxListFileBytes));
    const std::string_view text = io::as_text(file);
    std::set<std::string> names;
    for (std::size_t at = 0; at < text.size();) {
        std::size_t end = at;
        bool digits = true;
        while (end < text.size() && is_word_character(text[end]))
            digits = is_sequence_character(text[end++]) && digits;
        const std::string_view word = text.substr(at, end - at);
        if (digits && is_sequence_name(word)) names.emplace(word);
        at = end + 1;
    }
    if (!names.empty()) return names;
    return damaged("'%s' holds no names of sequences, such as 106_12648_23157", path.c_str());
}

Result<std::vector<SourceView>> load_source_views(const std::string& path) {
    SPLAT_ASSIGN(const io::Buffer file, io::read_file(path, kMaxListFileBytes));
    const std::string_view text = io::as_text(file);
    std::vector<SourceView> views;
    std::set<std::string> seen;
    std::size_t line = 1;
    for (std::size_t at = 0; at < text.size(); ++line) {
        const std::size_t end = std::min(text.find('\n', at), text.size());
        std::istringstream words(std::string(text.substr(at, end - at)));
        at = end + 1;
        SourceView view;
        std::string number, more;
        if (!(words >> view.category)) continue;
        const bool three = words >> view.object >> number && !(words >> more);
        const auto index = number_in<std::uint32_t>(number);
        if (!three || !index || !is_folder_name(view.category) || !is_folder_name(view.object))
            return damaged("'%s': line %zu is not 'category object view'", path.c_str(), line);
        if (!seen.insert(view.category + "/" + view.object).second)
            return damaged("'%s': line %zu names an object for the second time", path.c_str(),
                           line);
        view.view = *index;
        views.push_back(std::move(view));
    }
    if (!views.empty()) return views;
    return damaged("'%s' holds no lines 'category object view'", path.c_str());
}

}  // namespace splat::data
