// Callers and threads in another floating-point mode: the same bytes, and the caller's mode afterwards.
#include <cfenv>
#include <cmath>
#include <limits>

#include "api/raster_calls.h"
#if defined(__x86_64__)
#include <immintrin.h>
#endif

namespace splat::test {
namespace {

constexpr int kRoundings[] = {FE_DOWNWARD, FE_UPWARD, FE_TOWARDZERO};

#if defined(__aarch64__)
std::uint64_t control_now() {
    std::uint64_t control = 0;
    __asm__ volatile("mrs %0, fpcr" : "=r"(control));
    return control;
}

void set_control(std::uint64_t control) {
    __asm__ volatile("msr fpcr, %0" : : "r"(control));
}
#endif

/// Divisions by zero, invalid operations and overflows end the program from now on.
#if defined(_WIN32)
bool trap() {
    _mm_setcsr(_mm_getcsr() & ~0x0680U);
    return true;
}
int traps_now() {
    return 0;  // they are in the word of mode_now()
}
#else
bool trap() {
    return feenableexcept(FE_DIVBYZERO | FE_INVALID | FE_OVERFLOW) != -1;
}
int traps_now() {
    return fegetexcept();
}
#endif

/// What a caller may have set; false where the machine cannot.
struct Mode {
    const char* name;
    bool (*set)();
};
constexpr Mode kModes[] = {{"down", [] { return std::fesetround(FE_DOWNWARD) == 0; }},
                           {"flush",
                            [] {
#if defined(__x86_64__)
                                _mm_setcsr(_mm_getcsr() | 0x8040U);  // what -ffast-math sets
                                return true;
#elif defined(__aarch64__)
                                set_control(control_now() | std::uint64_t{1} << 24U);
                                return true;
#else
                                return false;
#endif
                            }},
                           {"traps", [] { return trap(); }}};

/// Sets a mode; the default comes back at the end.
class InMode {
  public:
    explicit InMode(const Mode& mode) : set_(mode.set()) {}
    InMode(const InMode&) = delete;
    InMode& operator=(const InMode&) = delete;
    ~InMode() { std::fesetenv(FE_DFL_ENV); }
    [[nodiscard]] bool set() const { return set_; }

  private:
    bool set_;
};

/// Rounding, traps, and the treatment of subnormal numbers.
std::array<unsigned, 3> mode_now() {
    std::array<unsigned, 3> now = {static_cast<unsigned>(std::fegetround()),
                                   static_cast<unsigned>(traps_now()), 0};
#if defined(__x86_64__)
    now[2] = _mm_getcsr() & ~0x3FU;
#elif defined(__aarch64__)
    now[2] = static_cast<unsigned>(control_now());
#endif
    return now;
}

std::string text(const Floats& values) {
    return {reinterpret_cast<const char*>(values.data()), values.size() * sizeof(float)};
}

/// Inputs, made in the default mode, and what calls make of them.
struct Calls {
    Calls() : pixels(16 * 16 * 3), others(pixels.size()), nan(pixels.size()) {
        for (std::size_t i = 0; i < pixels.size(); ++i) {
            pixels[i] = std::sin(static_cast<float>(i)) * 0.4F + 0.5F;
            others[i] = pixels[i] * 0.9F;
            nan[i] = i % 7 == 0 ? std::numeric_limits<float>::quiet_NaN() : pixels[i];
        }
    }

    [[nodiscard]] std::vector<std::string> results() const {
        std::vector<std::string> all;
        const auto image = packed_image(pixels, 16, 16, 3);
        for (const Floats* other : {&pixels, &others}) {
            const auto second = packed_image(*other, 16, 16, 3);
            const auto scores = got(splat_image_compare, &image, &second);
            all.emplace_back(reinterpret_cast<const char*>(&scores), sizeof scores);
        }
        const auto broken = packed_image(nan, 16, 16, 3);
        for (const splat_image_format format : {SPLAT_IMAGE_PNG, SPLAT_IMAGE_PNG16})
            all.push_back(bytes_of(splat_image_save_memory, &broken, format));
        const char* const keys[] = {"opt.base_lr=0.1", "opt.lambda_lpips=0.7"};
        all.push_back(text_of(splat_config_merge, kSmallModel, keys, std::size_t{2}));

        const Device device = open_device();  // which starts the driver's threads
        const Rasterizer rasterizer = make_rasterizer(device, rasterizer_desc(300, 48, 32));
        EXPECT_DONE(draw(rasterizer, scene.create(), camera));
        all.push_back(text(output(rasterizer, SPLAT_OUTPUT_RGB, 48 * 32 * 3)));

        const Trainer trainer = make_trainer(device);
        EXPECT_DONE(splat_model_init(got(splat_trainer_model, trainer), 3));
        const Batches batches = make_batches();  // read on a thread
        const auto read = got(splat_batches_next, batches, 0);
        got(splat_trainer_step, trainer, &read);
        all.push_back(bytes_of(splat_trainer_save_memory, trainer));
        return all;
    }

    Floats pixels, others, nan;
    SampleScene scene{300};
    splat_camera camera = sample_camera(48, 32);
};

TEST(ApiFloatMode, CallersChangeNoResult) {
    data_folder();  // made here
    const Calls calls;
    const std::vector<std::string> expected = calls.results();
    for (const Mode& mode : kModes) {
        const InMode now(mode);
        if (!now.set()) continue;
        const auto before = mode_now();
        const std::vector<std::string> got = calls.results();
        EXPECT_EQ(mode_now(), before) << mode.name;
        std::fesetenv(FE_DFL_ENV);
        ASSERT_EQ(got.size(), expected.size());
        for (std::size_t i = 0; i < got.size(); ++i)
            EXPECT_TRUE(got[i] == expected[i]) << mode.name << ", result " << i;
    }
}

TEST(ApiFloatMode, ExceptionsThatTheCallerFoundStay) {
    const Calls calls;
    const auto image = packed_image(calls.pixels, 16, 16, 3);
    const InMode now(kModes[0]);
    std::feclearexcept(FE_ALL_EXCEPT);
    std::feraiseexcept(FE_UNDERFLOW);
    got(splat_image_compare, &image, &image);  // divides by zero
    EXPECT_EQ(std::fetestexcept(FE_UNDERFLOW | FE_DIVBYZERO), FE_UNDERFLOW);
}

/// In every mode of rounding, the roundings that a callback found.
template <class Call>
void expect_callers(std::vector<int>& found, Call&& call) {
    for (const int rounding : kRoundings) {
        found.clear();
        std::fesetround(rounding);
        call();
        EXPECT_EQ(std::fegetround(), rounding);
        std::fesetround(FE_TONEAREST);
        EXPECT_FALSE(found.empty());
        for (const int one : found) EXPECT_EQ(one, rounding);
    }
}

TEST(ApiFloatMode, CallbacksRunInThatOfTheirCaller) {
    std::vector<int> found;
    const auto log = [](void* user, splat_log_level, const char*) {
        static_cast<std::vector<int>*>(user)->push_back(std::fegetround());
    };
    ASSERT_DONE(splat_log_set_callback(log, &found, SPLAT_LOG_DEBUG));
    expect_callers(found, [] { EXPECT_EQ(splat_tensor_unmap(nullptr), kHandle); });
    listen_to_log();

    const Dataset dataset = make_dataset();
    const auto progress = [](void* user, std::uint64_t, std::uint64_t) -> std::int32_t {
        static_cast<std::vector<int>*>(user)->push_back(std::fegetround());
        return 0;
    };
    expect_callers(found, [&] {
        const Temporary folder;
        auto desc = sized<splat_dataset_export_desc>();
        desc.path = folder.c_str();
        desc.layout = "images";
        EXPECT_DONE(splat_dataset_export(dataset, &desc, progress, &found));
    });
}

}  // namespace
}  // namespace splat::test
