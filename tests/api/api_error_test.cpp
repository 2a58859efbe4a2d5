// Result codes, the last error of a thread, and the log.
#include <set>
#include <thread>

#include "api/api_calls.h"

namespace splat::test {
namespace {

struct NamedCode {
    splat_result code;
    splat_result number;  ///< frozen
    const char* name;
};

#define SPLAT_NAMED(code, number) \
    NamedCode {                   \
        code, number, #code       \
    }
constexpr NamedCode kCodes[] = {
    SPLAT_NAMED(SPLAT_OK, 0),
    SPLAT_NAMED(SPLAT_INCOMPLETE, 1),
    SPLAT_NAMED(SPLAT_ERROR_INVALID_ARGUMENT, -1),
    SPLAT_NAMED(SPLAT_ERROR_INVALID_HANDLE, -2),
    SPLAT_NAMED(SPLAT_ERROR_INVALID_STATE, -3),
    SPLAT_NAMED(SPLAT_ERROR_SHAPE_MISMATCH, -4),
    SPLAT_NAMED(SPLAT_ERROR_UNSUPPORTED, -5),
    SPLAT_NAMED(SPLAT_ERROR_NO_DEVICE, -6),
    SPLAT_NAMED(SPLAT_ERROR_OUT_OF_HOST_MEMORY, -7),
    SPLAT_NAMED(SPLAT_ERROR_OUT_OF_DEVICE_MEMORY, -8),
    SPLAT_NAMED(SPLAT_ERROR_TIMEOUT, -9),
    SPLAT_NAMED(SPLAT_ERROR_DEVICE_LOST, -10),
    SPLAT_NAMED(SPLAT_ERROR_INTERNAL, -11),
    SPLAT_NAMED(SPLAT_ERROR_NOT_FOUND, -12),
    SPLAT_NAMED(SPLAT_ERROR_IO, -13),
    SPLAT_NAMED(SPLAT_ERROR_FORMAT, -14),
    SPLAT_NAMED(SPLAT_CANCELLED, -15),
};
#undef SPLAT_NAMED

/// Fails with a text that holds `name`.
void fail_with(const std::string& name) {
    const splat_tensor_desc desc = tensor_desc({0}, name.c_str());
    splat_tensor tensor = nullptr;
    EXPECT_REFUSED(splat_tensor_create(shared_device(), &desc, &tensor), kArgument, name);
}

TEST(ApiResult, EveryCodeHasItsNumberNameAndSentence) {
    std::set<std::string> sentences;
    for (const NamedCode& row : kCodes) {
        EXPECT_EQ(row.code, row.number) << row.name;
        EXPECT_STREQ(splat_result_name(row.code), row.name);
        const std::string sentence = splat_result_sentence(row.code);
        EXPECT_TRUE(sentences.insert(sentence).second) << sentence;
        EXPECT_GT(sentence.size(), 15U);
        EXPECT_EQ(sentence.back(), '.') << sentence;
    }
}

TEST(ApiResult, UnknownCodesAreNamedSo) {
    for (const splat_result code : {2, 1000, -16, INT32_MAX, INT32_MIN}) {
        EXPECT_STREQ(splat_result_name(code), "SPLAT_UNKNOWN_RESULT") << code;
        EXPECT_GT(std::strlen(splat_result_sentence(code)), 15U) << code;
    }
}

TEST(ApiLastError, IsEmptyOnAFreshThread) {
    fail_with("main");
    std::thread([] {
        EXPECT_STREQ(splat_last_error_message(), "");
        char byte = 'x';
        std::size_t needed = 0;
        EXPECT_DONE(splat_last_error_copy(&byte, 1, &needed));
        EXPECT_EQ(byte, '\0');
        EXPECT_EQ(needed, 1U);
    }).join();
}

TEST(ApiLastError, BelongsToItsThread) {
    fail_with("mine");
    const std::string mine = splat_last_error_message();
    std::thread([] { fail_with("theirs"); }).join();
    EXPECT_EQ(splat_last_error_message(), mine);
}

TEST(ApiLastError, IsKeptOverSuccess) {
    fail_with("kept");
    const std::string kept = splat_last_error_message();
    const Tensor tensor = make_tensor(shared_device(), {2});
    EXPECT_EQ(splat_last_error_message(), kept);
}

TEST(ApiLastError, CopyTakesTwoCalls) {
    fail_with(std::string(500, 'n'));
    const std::string text = splat_last_error_message();
    EXPECT_GT(text.size(), 500U);
    EXPECT_EQ(text_of(splat_last_error_copy), text);
    EXPECT_EQ(splat_last_error_message(), text) << "copying changes nothing";
}

TEST(ApiLastError, CopyIsCutToTheBuffer) {
    fail_with("cut");
    const std::string text = splat_last_error_message();
    for (const std::size_t capacity : {std::size_t{1}, std::size_t{8}, text.size()}) {
        std::vector<char> buffer(text.size() + 8, '#');
        std::size_t needed = 0;
        EXPECT_EQ(splat_last_error_copy(buffer.data(), capacity, &needed), SPLAT_INCOMPLETE);
        EXPECT_EQ(needed, text.size() + 1);
        EXPECT_EQ(std::string(buffer.data()), text.substr(0, capacity - 1));
        EXPECT_EQ(buffer[capacity], '#') << "nothing beyond the capacity is written";
    }
    std::vector<char> exact(text.size() + 1);
    EXPECT_DONE(splat_last_error_copy(exact.data(), exact.size(), nullptr));
    EXPECT_EQ(std::string(exact.data()), text);
    EXPECT_EQ(splat_last_error_copy(nullptr, 100, nullptr), SPLAT_INCOMPLETE);
}

struct Heard {
    std::vector<std::pair<splat_log_level, std::string>> lines;
    static void hear(void* user, splat_log_level level, const char* message) {
        static_cast<Heard*>(user)->lines.emplace_back(level, message);
    }
};

class ApiLog : public testing::Test {
  protected:
    void TearDown() override { listen_to_log(); }
    Heard heard_;
};

TEST_F(ApiLog, HearsErrorsAtDebugLevel) {
    EXPECT_DONE(splat_log_set_callback(Heard::hear, &heard_, SPLAT_LOG_DEBUG));
    fail_with("heard");
    ASSERT_FALSE(heard_.lines.empty());
    EXPECT_EQ(heard_.lines.back().second, splat_last_error_message());
    for (const auto& [level, text] : heard_.lines) EXPECT_GE(level, SPLAT_LOG_DEBUG) << text;
}

TEST_F(ApiLog, ZeroMeansWarnings) {
    EXPECT_DONE(splat_log_set_callback(Heard::hear, &heard_, 0));
    fail_with("unheard");
    for (const auto& [level, text] : heard_.lines) EXPECT_GE(level, SPLAT_LOG_WARNING) << text;
}

TEST_F(ApiLog, AnnouncesTheDevice) {
    EXPECT_DONE(splat_log_set_callback(Heard::hear, &heard_, SPLAT_LOG_INFO));
    const Device device = open_device();
    const auto info = got(splat_device_get_info, device);
    bool found = false;
    for (const auto& [level, text] : heard_.lines)
        found = found || (level == SPLAT_LOG_INFO && text.find(info.name) != std::string::npos);
    EXPECT_TRUE(found);
}

TEST_F(ApiLog, NullIsSilence) {
    EXPECT_DONE(splat_log_set_callback(Heard::hear, &heard_, SPLAT_LOG_DEBUG));
    EXPECT_DONE(splat_log_set_callback(nullptr, nullptr, SPLAT_LOG_DEBUG));
    fail_with("silent");
    EXPECT_TRUE(heard_.lines.empty());
}

TEST_F(ApiLog, AWrongLevelChangesNothing) {
    EXPECT_DONE(splat_log_set_callback(Heard::hear, &heard_, SPLAT_LOG_DEBUG));
    for (const splat_log_level level : {-1, 5, INT32_MAX, INT32_MIN})
        EXPECT_REFUSED(splat_log_set_callback(nullptr, nullptr, level), kArgument, "min_level");
    heard_.lines.clear();
    fail_with("still heard");
    EXPECT_FALSE(heard_.lines.empty());
}

}  // namespace
}  // namespace splat::test
