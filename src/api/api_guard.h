#pragma once

#include <cstddef>
#include <cstring>
#include <new>
#include <span>
#include <string>
#include <string_view>

#include "api/copy_members.h"
#include "api/structs.h"
#include "core/float_mode.h"
#include "core/no_copy.h"
#include "core/status.h"
#include "splat.h"

namespace splat::api {

/// Make this the calling thread's last error and return its code.
splat_result fail(const Status& status) noexcept;

/// The same for a failed allocation. Allocates nothing.
splat_result fail_out_of_memory() noexcept;

/// One entry point, in the default floating-point mode. The log's messages wait until the outermost one ends, when no
/// lock is held, and come in the caller's mode; they leave the last error as it is.
class EntryPoint : NoCopy {
  public:
    EntryPoint() noexcept;
    ~EntryPoint();

  private:
    FloatMode mode_;
};

/// Run the body of an entry point and turn errors and exceptions into a splat_result.
template <class Body>
splat_result guarded(Body&& body) noexcept {
    const EntryPoint entry;
    try {
        const Status status = body();
        return status.ok() ? SPLAT_OK : fail(status);
    } catch (const std::bad_alloc&) {
        return fail_out_of_memory();
    } catch (const std::exception& e) {
        return fail(error(Code::kInternal, "unexpected exception: %s", e.what()));
    }
}

/// Errors: kInvalidArgument, naming `argument`.
Status require(const void* pointer, const char* argument);

/// The same of several pointers, each followed by its name.
template <class... More>
Status require(const void* pointer, const char* argument, const More&... more) {
    SPLAT_TRY(require(pointer, argument));
    return require(more...);
}

/// Errors: kInvalidArgument if a caller's struct ends before the members of its first version, or has a
/// size that no version will have.
Status check_struct_size(std::size_t given, const char* type, std::size_t first_version_size,
                         std::size_t known_size);

/// Errors: kUnsupported if a caller's struct of a later version sets members that this one does not
/// know.
Status check_tail(const void* given, std::size_t size, const char* type, std::size_t known_size);

/// Errors: kInvalidArgument for a member that a later version may give a meaning.
Status check_reserved(std::uint32_t reserved, const char* type);

/// Check the struct_size of a struct to fill. A later version's is accepted, see give().
template <class Struct>
Status check_filled(const Struct& to_fill) {
    return check_struct_size(to_fill.struct_size, kStructName<Struct>, kFirstVersionBytes<Struct>,
                             sizeof(Struct));
}

/// Check a struct that the library reads. Errors: those of check_struct_size(), check_reserved() of its
/// member of that name, and check_tail().
template <class Struct>
Status check_size(const Struct& given) {
    const char* const type = kStructName<Struct>;
    SPLAT_TRY(check_filled(given));
    if constexpr (requires { given.reserved; }) SPLAT_TRY(check_reserved(given.reserved, type));
    return check_tail(&given, given.struct_size, type, sizeof(Struct));
}

/// Check the members that every *_desc starts with. Flags outside `known_flags` are refused.
template <class Desc>
Status check_desc(const Desc* desc, std::uint32_t known_flags) {
    const char* const type = kStructName<Desc>;
    if (desc == nullptr) return invalid("desc is NULL, expected a %s", type);
    SPLAT_TRY(check_size(*desc));
    if ((desc->flags & ~known_flags) != 0)
        return invalid("%s.flags has unknown bits %#x", type, desc->flags & ~known_flags);
    if (desc->next != nullptr)
        return invalid("%s.next is not NULL: this version knows no extensions", type);
    return {};
}

/// Errors: kInvalidArgument for flags outside `known`, naming `argument`.
Status check_flags(std::uint32_t flags, std::uint32_t known, const char* argument = "flags");

/// Copy as much of a caller's input struct as its version has; the rest becomes zeros.
template <class Input>
Status take_input(const Input* given, const char* argument, Input& taken) {
    SPLAT_TRY(require(given, argument));
    SPLAT_TRY(check_size(*given));
    const std::size_t size = given->struct_size;
    std::memcpy(&taken, given, size < sizeof(Input) ? size : sizeof(Input));
    return {};
}

/// The same of a struct that may be NULL, which is an error that names `argument`.
template <class Info>
Status check_fill(const Info* to_fill, const char* argument) {
    if (to_fill == nullptr)
        return invalid("%s is NULL, expected a %s", argument, kStructName<Info>);
    return check_filled(*to_fill);
}

/// Copy as much of `filled` as the caller's version of the struct has; its struct_size stays, and so do
/// members that only the caller's version knows.
template <class Info>
void give(const Info& filled, Info* info) {
    const std::uint32_t size = info->struct_size;
    std::memcpy(info, &filled, size < sizeof(Info) ? size : sizeof(Info));
    info->struct_size = size;
}

/// Copy text and a NUL to the buffer. Returns SPLAT_INCOMPLETE if the text was cut.
splat_result give_text(std::string_view text, char* buffer, std::size_t capacity,
                       std::size_t* needed);

/// Run the body of an entry point that fills a caller's text buffer: `body()` returns the text, or a Result of it.
template <class Body>
splat_result guarded_text(char* buffer, std::size_t capacity, std::size_t* needed,
                          Body&& body) noexcept {
    splat_result given = SPLAT_OK;
    const splat_result result = guarded([&]() -> Status {
        SPLAT_ASSIGN(const std::string text, Result<std::string>(body()));
        given = give_text(text, buffer, capacity, needed);
        return {};
    });
    return result != SPLAT_OK ? result : given;
}

/// Copy a file, or its pieces, to the buffer; nothing if it does not fit. Returns SPLAT_INCOMPLETE if
/// it does not.
splat_result give_bytes(std::span<const std::byte> file, void* buffer, std::size_t capacity,
                        std::size_t* needed);
splat_result give_bytes(std::span<const std::span<const std::byte>> pieces, void* buffer,
                        std::size_t capacity, std::size_t* needed);

/// Run the body of an entry point that writes a file to memory: `body(give)` calls `give(file)`.
template <class Body>
splat_result guarded_bytes(void* buffer, std::size_t capacity, std::size_t* needed,
                           Body&& body) noexcept {
    splat_result given = SPLAT_OK;
    const splat_result result = guarded([&]() -> Status {
        return body([&](const auto& file) -> Status {
            given = give_bytes(file, buffer, capacity, needed);
            return {};
        });
    });
    return result != SPLAT_OK ? result : given;
}

}  // namespace splat::api
