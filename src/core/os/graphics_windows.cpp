#include "core/os/graphics.h"

#include <optional>

#include "core/os/windows.h"

namespace splat::os {
namespace {

/// The class of display adapters; keys "0000", "0001" and so on of it have a value for each.
constexpr const wchar_t* kAdapters =
    LR"(SYSTEM\CurrentControlSet\Control\Class\{4d36e968-e325-11ce-bfc1-08002be10318})";
constexpr const wchar_t* kDrivers = LR"(SOFTWARE\Khronos\Vulkan\Drivers)";
constexpr DWORD kLongest = 16383;  ///< units of the name of a value

class Key {
  public:
    Key(HKEY above, const wchar_t* name) {
        if (::RegOpenKeyExW(above, name, 0, KEY_READ, &key_) != ERROR_SUCCESS) key_ = nullptr;
    }
    ~Key() {
        if (key_ != nullptr) ::RegCloseKey(key_);
    }
    Key(const Key&) = delete;
    Key& operator=(const Key&) = delete;

    [[nodiscard]] HKEY get() const { return key_; }

    /// The texts of a value, of which there may be several.
    [[nodiscard]] std::vector<std::string> texts(const wchar_t* name) const {
        DWORD bytes = 0;
        constexpr DWORD kTexts = RRF_RT_REG_SZ | RRF_RT_REG_MULTI_SZ;
        if (::RegGetValueW(key_, nullptr, name, kTexts, nullptr, nullptr, &bytes) != ERROR_SUCCESS)
            return {};
        std::wstring all(bytes / sizeof(wchar_t) + 1, L'\0');
        if (::RegGetValueW(key_, nullptr, name, kTexts, nullptr, all.data(), &bytes) !=
            ERROR_SUCCESS)
            return {};
        std::vector<std::string> found;
        for (const wchar_t* at = all.c_str(); *at != L'\0'; at += std::wstring_view(at).size() + 1)
            found.push_back(utf8(at));
        return found;
    }

  private:
    HKEY key_ = nullptr;
};

/// Calls `use` with the key of each display adapter.
template <class Use>
void for_each_adapter(const Use& use) {
    const Key all(HKEY_LOCAL_MACHINE, kAdapters);
    if (all.get() == nullptr) return;
    wchar_t name[256];
    for (DWORD i = 0, units = 256; ::RegEnumKeyExW(all.get(), i, name, &units, nullptr, nullptr,
                                                   nullptr, nullptr) == ERROR_SUCCESS;
         ++i, units = 256)
        if (const Key one(all.get(), name); one.get() != nullptr) use(one);
}

}  // namespace

std::string vulkan_loader() {
    return "vulkan-1.dll";
}

std::vector<std::string> vulkan_drivers() {
    std::vector<std::string> files;
    for_each_adapter([&](const Key& adapter) {
        for (std::string& file : adapter.texts(L"VulkanDriverName"))
            files.push_back(std::move(file));
    });
    const Key drivers(HKEY_LOCAL_MACHINE, kDrivers);
    std::wstring name(kLongest + 1, L'\0');
    for (DWORD i = 0; drivers.get() != nullptr; ++i) {
        DWORD units = kLongest + 1, type = REG_NONE, off = 0, bytes = sizeof off;
        const LSTATUS found = ::RegEnumValueW(drivers.get(), i, name.data(), &units, nullptr, &type,
                                              reinterpret_cast<BYTE*>(&off), &bytes);
        if (found == ERROR_MORE_DATA) continue;  // larger than a number
        if (found != ERROR_SUCCESS) break;       // ERROR_NO_MORE_ITEMS
        if (type == REG_DWORD && off == 0) files.push_back(utf8({name.data(), units}));
    }
    return files;
}

std::vector<Gpu> gpus() {
    std::vector<Gpu> all;
    for_each_adapter([&](const Key& adapter) {
        for (const std::string& name : adapter.texts(L"DriverDesc"))
            if (name != "Microsoft Basic Display Adapter") all.push_back({name, true});
    });
    return all;
}

}  // namespace splat::os
