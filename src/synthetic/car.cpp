// Procedural cars: body, cabin, windows, wheels, lights and trim, in five styles.

#include "synthetic/object.h"

namespace splat::synthetic {
namespace {

constexpr Vec3 kTyre = {0.06, 0.06, 0.065};
constexpr Vec3 kDark = {0.09, 0.09, 0.1};
constexpr Vec3 kGlass = {0.16, 0.2, 0.24};
constexpr double kProud = 0.004;  ///< how far trim stands out

enum class Style { kSedan, kHatchback, kEstate, kVan, kPickup };

/// Ranges of what a style decides: where the cabin ends, and how far the roof recedes there (0: as for any car).
struct StyleRange {
    double back_low, back_high, rake_low, rake_high;
};
constexpr StyleRange kStyles[] = {{-0.38, -0.28, 0, 0},
                                  {-0.47, -0.42, 0, 0},
                                  {-0.485, -0.47, 0.02, 0.05},
                                  {-0.488, -0.488, 0.005, 0.02},
                                  {-0.12, 0, 0.01, 0.04}};

/// Dimensions in units of the length; x forward, y left, z up, the ground at z = 0.
struct CarPlan {
    Style style = Style::kSedan;
    double width = 0, height = 0, wheel = 0, clearance = 0, belt = 0;
    double cabin_back = 0, cabin_front = 0;  ///< at the belt line
    double rake_back = 0, rake_front = 0;    ///< how far the roof recedes
    double tumble = 0;                       ///< how far the sides lean in
    double axle_back = 0, axle_front = 0;
    Vec3 paint{}, trim{}, rim{};
};

Vec3 paint_color(Random& random) {
    if (random.chance(0.35)) {  // white, silver, gray, black
        const double value = random.between(0.12, 0.92);
        return {value, value, value * random.between(0.97, 1.03)};
    }
    return hsv({random.uniform(), random.between(0.45, 0.95), random.between(0.35, 0.9)});
}

CarPlan plan_car(Random& random) {
    CarPlan p;
    const std::uint32_t style = random.choice(5);
    p.style = static_cast<Style>(style);
    const bool tall = p.style == Style::kVan || p.style == Style::kPickup;
    p.width = random.between(0.38, 0.46);
    p.height = tall ? random.between(0.36, 0.44) : random.between(0.27, 0.35);
    p.wheel = random.between(0.065, 0.08) * (tall ? 1.1 : 1);
    p.clearance = p.wheel * random.between(0.55, 0.85);
    p.belt = p.height * random.between(0.54, 0.64);
    p.rake_front = random.between(0.07, 0.16);
    p.rake_back = random.between(0.06, 0.14);
    p.cabin_front = random.between(0.16, 0.26);
    p.tumble = random.between(0.025, 0.05);
    const StyleRange& range = kStyles[style];
    p.cabin_back = range.back_low == range.back_high
                       ? range.back_low
                       : random.between(range.back_low, range.back_high);
    if (range.rake_high > 0) p.rake_back = random.between(range.rake_low, range.rake_high);
    if (p.style == Style::kVan) p.cabin_front = random.between(0.28, 0.4);
    p.axle_front = 0.5 - random.between(0.16, 0.21);
    p.axle_back = -0.5 + random.between(0.17, 0.22);
    p.paint = paint_color(random);
    p.trim = random.chance(0.5) ? kDark : p.paint * 0.55;
    const double rim = random.between(0.35, 0.8);
    p.rim = {rim, rim, rim};
    return p;
}

/// The cabin, with its sides, or its front and back, moved outwards and the other ones inwards: a
/// solid that shows through the cabin as windows.
Solid cabin(const CarPlan& p, double sides, double ends, double floor, double roof,
            const Vec3& color) {
    const double half = p.width / 2 - 0.012 + sides;
    const double top = half - p.tumble;
    return make_frustum({p.cabin_back - ends, -half, p.belt - 0.015 + floor},
                        {p.cabin_front + ends, half, p.height - roof},
                        {p.cabin_back + p.rake_back - ends, -top, 0},
                        {p.cabin_front - p.rake_front + ends, top, 0}, color);
}

void add_body(const CarPlan& p, Random& random, Solids& car) {
    const double half = p.width / 2;
    Solid body = make_box({-0.5, -half, p.clearance}, {0.5, half, p.belt}, p.paint,
                          random.between(0.015, 0.03));
    const double drop = random.between(0.02, 0.06);
    cut(body, {p.cabin_front, 0, p.belt}, {drop, 0, 0.5 - p.cabin_front});  // bonnet
    if (p.style == Style::kSedan)
        cut(body, {p.cabin_back, 0, p.belt},
            {-random.between(0.005, 0.025), 0, 0.5 + p.cabin_back});  // boot
    car.push_back(body);
    car.push_back(cabin(p, 0, 0, 0, 0, p.paint));
    if (p.style == Style::kPickup)
        car.box({-0.47, -half + 0.03, p.belt - 0.02},
                {p.cabin_back - 0.02, half - 0.03, p.belt + kProud}, p.trim);
    car.box({-0.49, -half - kProud, p.clearance - 0.006},
            {0.49, half + kProud, p.clearance + random.between(0.012, 0.03)}, p.trim);
}

void add_windows(const CarPlan& p, Random& random, Solids& car) {
    const double rim = random.between(0.02, 0.03);
    car.push_back(cabin(p, kProud, -0.035, 0.015 + rim, rim, kGlass));
    car.push_back(cabin(p, -rim, kProud, 0.015 + rim, rim, kGlass));
    const std::uint32_t pillars = p.style == Style::kPickup ? 0 : 1 + random.choice(2);
    const double top_back = p.cabin_back + p.rake_back;
    const double top_front = p.cabin_front - p.rake_front;
    for (std::uint32_t i = 1; i <= pillars; ++i) {
        const double x = top_back + (top_front - top_back) * i / (pillars + 1);
        Solid pillar = cabin(p, 2 * kProud, 0, 0, 0.001, p.paint);
        cut(pillar, {x + 0.011, 0, 0}, {1, 0, 0});
        cut(pillar, {x - 0.011, 0, 0}, {-1, 0, 0});
        car.push_back(pillar);
    }
}

void add_wheels(const CarPlan& p, Random& random, Solids& car) {
    const double half = p.width / 2;
    const double tread = random.between(0.03, 0.042);
    const double hub = random.between(0.5, 0.7) * p.wheel;
    for (const double x : {p.axle_back, p.axle_front})
        for (const double side : {-1.0, 1.0}) {
            const auto disc = [&](double inner, double outer, double radius, const Vec3& color) {
                return make_cylinder({x, side * inner, p.wheel}, {x, side * outer, p.wheel}, radius,
                                     color);
            };
            Solid arch = disc(half - 0.05, half + kProud / 2, p.wheel * 1.16, kDark);
            cut(arch, {0, 0, p.clearance - 0.007}, {0, 0, -1});
            car.push_back(arch);
            car.push_back(disc(half + 0.008 - 2 * tread, half + 0.008, p.wheel, kTyre));
            car.push_back(disc(half - tread, half + 0.012, hub, p.rim));
            car.push_back(disc(half - tread, half + 0.016, hub * 0.3, kDark));
        }
}

void add_trim(const CarPlan& p, Random& random, Solids& car) {
    const double half = p.width / 2;
    const double z = p.clearance + (p.belt - p.clearance) * random.between(0.45, 0.62);
    const double lamp = random.between(0.02, 0.032);
    const double rear = random.between(0.02, 0.035);
    const double wide = random.between(0.045, 0.075);
    for (const double side : {-1.0, 1.0}) {
        car.ellipsoid({0.485, side * (half - 0.065), z}, {0.025, wide * 0.75, lamp},
                      {0.95, 0.93, 0.8});
        car.box({-0.5 - kProud, side * (half - 0.025 - wide), z - rear},
                {-0.47, side * (half - 0.025), z + rear}, {0.75, 0.08, 0.07});
        car.ellipsoid({p.cabin_front - 0.045, side * (half + 0.018), p.belt + 0.018},
                      {0.014, 0.024, 0.016}, p.paint);
    }
    const double grille = random.between(0.06, 0.12);
    car.box({0.45, -grille, z - lamp}, {0.5 + kProud, grille, z + lamp * 0.6}, kDark);
    car.box({-0.5 - kProud, -0.05, z - 0.045}, {-0.47, 0.05, z - 0.02}, {0.9, 0.9, 0.86});
    if (random.chance(0.25))
        for (const double side : {-1.0, 1.0}) {
            const double y = side * (half - 0.05 - p.tumble);
            car.cylinder({p.cabin_back + p.rake_back + 0.03, y, p.height + 0.012},
                         {p.cabin_front - p.rake_front - 0.03, y, p.height + 0.012}, 0.009, p.trim);
        }
    if (p.style == Style::kSedan && random.chance(0.35))
        car.box({-0.49, -half + 0.05, p.belt + 0.02}, {-0.44, half - 0.05, p.belt + 0.032},
                p.paint);
}

}  // namespace

Solids make_car(Random& random) {
    const CarPlan plan = plan_car(random);
    Solids car;
    add_body(plan, random, car);
    add_windows(plan, random, car);
    add_wheels(plan, random, car);
    add_trim(plan, random, car);
    return car;
}

}  // namespace splat::synthetic
