// Procedural chairs: seat, back, legs and arms, of several kinds each.

#include <numbers>

#include "synthetic/object.h"

namespace splat::synthetic {
namespace {

/// Dimensions in units of about the height; x forward as the sitter looks, y left, z up, ground at z = 0.
struct ChairPlan {
    double width = 0, depth = 0, seat = 0, thick = 0, top = 0, lean = 0, leg = 0;
    Vec3 frame{}, cushion{};
    bool pedestal = false, round_seat = false;
};

Vec3 wood_or_paint(Random& random) {
    if (random.chance(0.5))
        return hsv(
            {random.between(0.05, 0.1), random.between(0.4, 0.75), random.between(0.25, 0.75)});
    if (random.chance(0.4)) {
        const double value = random.between(0.1, 0.85);
        return {value, value, value};
    }
    return hsv({random.uniform(), random.between(0.3, 0.9), random.between(0.3, 0.85)});
}

ChairPlan plan_chair(Random& random) {
    ChairPlan p;
    p.width = random.between(0.4, 0.58);
    p.depth = random.between(0.4, 0.54);
    p.seat = random.between(0.38, 0.5);
    p.thick = random.between(0.03, 0.09);
    p.top = p.seat + random.between(0.36, 0.62);
    p.lean = random.between(0.02, 0.24);
    p.leg = random.between(0.018, 0.034);
    p.frame = wood_or_paint(random);
    p.cushion = random.chance(0.35) ? p.frame : wood_or_paint(random);
    p.pedestal = random.chance(0.25);
    p.round_seat = random.chance(0.2);
    return p;
}

void add_seat(const ChairPlan& p, Random& random, Solids& chair) {
    const double x = p.depth / 2;
    const double y = p.width / 2;
    if (p.round_seat) {
        Solid seat =
            make_cylinder({0, 0, p.seat - p.thick}, {0, 0, p.seat}, std::max(x, y), p.cushion);
        for (const double side : {-1.0, 1.0}) {
            cut(seat, {side * x, 0, 0}, {side, 0, 0});
            cut(seat, {0, side * y, 0}, {0, side, 0});
        }
        chair.push_back(seat);
        return;
    }
    chair.box({-x, -y, p.seat - p.thick}, {x, y, p.seat}, p.frame,
              p.thick * random.between(0.15, 0.45));
    if (random.chance(0.5))
        chair.box({-x + 0.03, -y + 0.03, p.seat - 0.01},
                  {x - 0.02, y - 0.03, p.seat + random.between(0.015, 0.05)}, p.cushion, 0.012);
}

void add_back(const ChairPlan& p, Random& random, Solids& chair) {
    const double x = -p.depth / 2;
    const double y = p.width / 2;
    const double thick = random.between(0.022, 0.05);
    const Mat3 lean = turn_about(1, -p.lean);
    const Vec3 hinge = {x, 0, p.seat - p.thick};
    const auto add = [&](const Vec3& a, const Vec3& b, const Vec3& color, double bevel) {
        chair.box(a, b, color, bevel);
        chair.back() = turned(chair.back(), lean, hinge);
    };
    const std::uint32_t kind = random.choice(3);
    const double bottom = p.seat - p.thick;
    if (kind == 0) {  // one panel
        add({x, -y, bottom}, {x + thick, y, p.top}, p.frame, thick * 0.3);
        if (random.chance(0.5))
            add({x + 0.01, -y + 0.04, p.seat + 0.08}, {x + thick + 0.02, y - 0.04, p.top - 0.04},
                p.cushion, 0.01);
        return;
    }
    for (const double side : {-1.0, 1.0})
        add({x, side * (y - 2 * p.leg), bottom}, {x + thick, side * y, p.top}, p.frame, 0);
    const double rail = random.between(0.05, 0.12);
    add({x, -y, p.top - rail}, {x + thick, y, p.top}, p.frame, thick * 0.25);
    const std::uint32_t bars = 2 + random.choice(4);
    for (std::uint32_t i = 1; i <= bars; ++i) {
        const double part = static_cast<double>(i) / (bars + 1);
        if (kind == 1) {  // upright slats
            const double middle = -y + 2 * y * part;
            const double half = y / (bars + 1) * 0.45;
            add({x + 0.006, middle - half, bottom},
                {x + thick - 0.006, middle + half, p.top - 0.02}, p.frame, 0);
        } else {  // a ladder
            const double middle = p.seat + (p.top - rail - p.seat) * part;
            const double half = (p.top - p.seat) / (bars + 1) * 0.22;
            add({x + 0.006, -y + p.leg, middle - half},
                {x + thick - 0.006, y - p.leg, middle + half}, p.frame, 0);
        }
    }
}

void add_pedestal(const ChairPlan& p, Random& random, Solids& chair) {
    const double column = random.between(0.02, 0.045);
    chair.cylinder({0, 0, 0.02}, {0, 0, p.seat - p.thick / 2}, column, p.frame);
    const double radius = p.width * random.between(0.42, 0.52);
    if (random.chance(0.4)) {
        chair.cylinder({0, 0, 0}, {0, 0, random.between(0.015, 0.03)}, radius, p.frame);
        return;
    }
    const std::uint32_t feet = 4 + random.choice(2);
    for (std::uint32_t i = 0; i < feet; ++i) {
        const double angle = 2 * std::numbers::pi * (i + 0.5) / feet;
        const Vec3 tip = {radius * std::cos(angle), radius * std::sin(angle), 0.035};
        chair.cylinder({0, 0, 0.09}, tip, 0.02, p.frame);
        chair.ellipsoid({tip[0], tip[1], 0.028}, {0.028, 0.028, 0.028}, {0.08, 0.08, 0.08});
    }
}

void add_legs(const ChairPlan& p, Random& random, Solids& chair) {
    if (p.pedestal) {
        add_pedestal(p, random, chair);
        return;
    }
    const bool round = random.chance(0.4);
    const double splay = random.chance(0.5) ? random.between(0.01, 0.07) : 0;
    const double taper = random.between(0.6, 1.0);
    const double x = p.depth / 2 - p.leg;
    const double y = p.width / 2 - p.leg;
    const Vec3 up = {0, 0, p.seat - p.thick / 2}, thick = {p.leg, p.leg, 0}, thin = thick * taper;
    for (const double front : {-1.0, 1.0})
        for (const double side : {-1.0, 1.0}) {
            const Vec3 foot = {front * (x + splay), side * (y + splay), 0};
            const Vec3 head = Vec3(front * x, side * y, 0) + up;
            if (round)
                chair.cylinder(foot, head, p.leg * 0.85, p.frame);
            else
                chair.push_back(make_frustum(foot - thin, foot + thin + up, head - thick,
                                             head + thick, p.frame));
        }
    if (!random.chance(0.4)) return;
    const double z = p.seat * random.between(0.3, 0.55);
    for (const double side : {-1.0, 1.0})
        chair.cylinder({-x, side * y, z}, {x, side * y, z}, p.leg * 0.6, p.frame);
    chair.cylinder({0, -y, z}, {0, y, z}, p.leg * 0.6, p.frame);
}

void add_arms(const ChairPlan& p, Random& random, Solids& chair) {
    if (!random.chance(0.4)) return;
    const double z = p.seat + random.between(0.16, 0.24);
    const double half = random.between(0.02, 0.04);
    const double thick = random.between(0.02, 0.035);
    const double front = p.depth / 2 - random.between(0.02, 0.12);
    const bool closed = random.chance(0.3);
    // The back leans away: the arms reach it at their height.
    const double back = -p.depth / 2 - std::tan(p.lean) * (z - p.seat + p.thick);
    for (const double side : {-1.0, 1.0}) {
        const double y = side * (p.width / 2 - half);
        chair.box({back, y - half, z}, {front, y + half, z + thick}, p.frame, thick * 0.3);
        const double start = closed ? -p.depth / 2 : front - 2 * p.leg;
        chair.box({start, y - half * 0.6, p.seat - p.thick}, {front, y + half * 0.6, z + thick / 2},
                  closed ? p.cushion : p.frame);
    }
}

}  // namespace

Solids make_chair(Random& random) {
    const ChairPlan plan = plan_chair(random);
    Solids chair;
    add_seat(plan, random, chair);
    add_back(plan, random, chair);
    add_legs(plan, random, chair);
    add_arms(plan, random, chair);
    return chair;
}

}  // namespace splat::synthetic
