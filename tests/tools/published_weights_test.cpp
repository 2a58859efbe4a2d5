// The list of published weights, and hashes of files.
#include "vkrun/weights/published.h"

#include <gtest/gtest.h>
#include <splat.h>

#include <filesystem>

#include "vkrun/cli/failure.h"
#include "vkrun/cli/files.h"
#include "vkrun/cli/sha256.h"
#include "vkrun/cli/temporary_folder.h"

namespace vkrun {
namespace {

std::string hash_of(const std::string& text, std::size_t piece) {
    Sha256 hash;
    for (std::size_t at = 0; at < text.size(); at += piece)
        hash.add(text.data() + at, std::min(piece, text.size() - at));
    return hash.text();
}

/// The examples of FIPS 180-4, and of lengths around a block's padding by sha256sum.
TEST(Sha256, HasThePublishedValues) {
    const std::pair<std::string, const char*> known[] = {
        {"", "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855"},
        {"abc", "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad"},
        {"abcdbcdecdefdefgefghfghighijhijkijkljklmklmnlmnomnopnopq",
         "248d6a61d20638b8e5c026930c3e6039a33ce45964ff2167f6ecedd419db06c1"},
        {std::string(1000000, 'a'),
         "cdc76e5c9914fb9281a1c7e284d73e67f1809a48a497200e046d39ccc7112cd0"},
        {std::string(55, 'a'), "9f4390f8d30c2dd92ec9f095b65e2b9ae9b0a925a5258e241c9f1e910f734318"},
        {std::string(56, 'a'), "b35439a4ac6f0948b6d6f9e3c6af0f5f590ce20f1bde7090ef7970686ec6738a"},
        {std::string(63, 'a'), "7d3e74a05d7db15bce4ad9ec0658ea98e3f06eeecf16b4c6fff2da457ddc2f34"},
        {std::string(64, 'a'), "ffe054fe7ae0cb6dc65c3af9b61d5209f439851db43d0ba5997337df154668eb"},
        {std::string(119, 'a'), "31eba51c313a5c08226adf18d4a359cfdfd8d2e816b13f4af952f7ea6584dcfb"},
    };
    for (const auto& [text, hash] : known)
        for (const std::size_t piece :
             {std::size_t{1}, std::size_t{63}, std::size_t{64}, std::size_t{65}, std::size_t{4096}})
            EXPECT_EQ(hash_of(text, piece), hash) << text.size() << " bytes by " << piece;
}

TEST(Sha256, ReadsFilesToTheirEnd) {
    const TemporaryFolder folder;
    const std::filesystem::path path = folder.path();
    replace_file(path / "abc", "abc");
    replace_file(path / "empty", "");
    EXPECT_EQ(sha256_of_file((path / "abc").string()), hash_of("abc", 3));
    EXPECT_EQ(sha256_of_file((path / "empty").string()), hash_of("", 1));
    EXPECT_THROW(sha256_of_file((path / "none").string()), Failure);
    EXPECT_THROW(sha256_of_file(path.string()), Failure);
}

TEST(PublishedWeights, HaveConfigurationsAddressesAndHashes) {
    for (const PublishedWeights& one : published_weights()) {
        std::size_t needed = 0;
        EXPECT_EQ(splat_config_preset(one.name, nullptr, 0, &needed), SPLAT_INCOMPLETE) << one.name;
        EXPECT_EQ(
            published_address(one),
            std::string("https://huggingface.co/szymanowiczs/splatter-image-v1/resolve/main/") +
                one.file);
        const std::string hash = one.sha256;
        if (hash.empty()) continue;
        EXPECT_EQ(hash.size(), 64U);
        EXPECT_EQ(hash.find_first_not_of("0123456789abcdef"), std::string::npos);
        EXPECT_EQ(published_by_hash(hash), one.name);
    }
    EXPECT_EQ(published_by_hash(std::string(64, '0')), "");
    EXPECT_EQ(published_by_hash(""), "") << "those whose hash is not known";
}

}  // namespace
}  // namespace vkrun
