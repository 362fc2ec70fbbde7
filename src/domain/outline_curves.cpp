#include "domain/outline_curves.hpp"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <numbers>

namespace hexopt {

namespace {

double cross(const Point2& a, const Point2& b) { return a.x * b.y - a.y * b.x; }

/// Angle through the region on the left, degrees, 0..360.
double angle_at(const Point2& before, const Point2& p, const Point2& after) {
    const Point2 in = p - before, out = after - p;
    const double turn = std::atan2(cross(in, out), glm::dot(in, out));
    return 180 - turn * 180 / std::numbers::pi;
}

} // namespace

OutlineCurves::OutlineCurves(const Outline& outline, double feature_angle_deg) : outline_(&outline) {
    std::vector<SegmentTree::Segment> segments;
    for (Index l = 0; l < outline.loops.size(); ++l) {
        const OutlineLoop& given = outline.loops[l];
        const std::size_t n = given.points.size();
        Loop loop;
        loop.first_segment = static_cast<Index>(segments.size());
        loop.s = {0};
        for (std::size_t i = 0; i < n; ++i) {
            const Point2 &a = given.points[i], &b = given.points[(i + 1) % n];
            segments.push_back({a, b});
            loop_of_.push_back(l);
            box_.add(a);
            loop.s.push_back(loop.s.back() + glm::distance(a, b));
            const Point2& before = given.points[(i + n - 1) % n];
            const double angle = angle_at(before, a, b);
            const bool is_sharp = std::abs(angle - 180) > feature_angle_deg;
            if (is_sharp || given.patch[i] != given.patch[(i + n - 1) % n])
                loop.corners.push_back({loop.s[i], a, angle, is_sharp});
        }
        loop.length = loop.s.back();
        loop.area = twice_area(given.points) / 2;
        measure_curves(loop);
        loops_.push_back(std::move(loop));
    }
    tree_ = SegmentTree(std::move(segments));
}

void OutlineCurves::measure_curves(const Loop& loop) {
    const auto& corners = loop.corners;
    std::size_t next = 0; // the first corner beyond the segment
    for (std::size_t i = 0; i + 1 < loop.s.size(); ++i) {
        while (next < corners.size() && corners[next].s <= loop.s[i]) ++next;
        if (corners.size() < 2)
            curve_length_.push_back(loop.length);
        else if (next == 0 || next == corners.size())
            curve_length_.push_back(loop.length - corners.back().s + corners.front().s);
        else
            curve_length_.push_back(corners[next].s - corners[next - 1].s);
    }
}

std::size_t OutlineCurves::corner_count() const {
    std::size_t count = 0;
    for (const Loop& loop : loops_) count += loop.corners.size();
    return count;
}

std::size_t OutlineCurves::curve_count() const {
    std::size_t count = 0;
    for (const Loop& loop : loops_) count += std::max<std::size_t>(1, loop.corners.size());
    return count;
}

Index OutlineCurves::locate(const Loop& loop, double& s) const {
    s -= std::floor(s / loop.length) * loop.length;
    const auto after = std::upper_bound(loop.s.begin(), loop.s.end(), s);
    const auto i = std::clamp<std::ptrdiff_t>(after - loop.s.begin() - 1, 0, std::ssize(loop.s) - 2);
    return static_cast<Index>(i);
}

Point2 OutlineCurves::point(Index loop, double s) const {
    const Loop& of = loops_[loop];
    const Index i = locate(of, s);
    const auto& [a, b] = tree_.segment(of.first_segment + i);
    const double t = std::clamp((s - of.s[i]) / (of.s[i + 1] - of.s[i]), 0.0, 1.0);
    return t == 0 ? a : t == 1 ? b : a + t * (b - a);
}

Point2 OutlineCurves::tangent(Index loop, double s) const {
    const Loop& of = loops_[loop];
    const Index i = locate(of, s);
    const auto& [a, b] = tree_.segment(of.first_segment + i);
    return (b - a) / (of.s[i + 1] - of.s[i]);
}

Index OutlineCurves::patch(Index loop, double s) const {
    return outline_->loops[loop].patch[locate(loops_[loop], s)];
}

double OutlineCurves::s_of(Index segment, double t) const {
    const Loop& of = loops_[loop_of_[segment]];
    const Index i = segment - of.first_segment;
    return of.s[i] + t * (of.s[i + 1] - of.s[i]);
}

template <class Visit>
void OutlineCurves::visit_ray(const Point2& p, const Visit& visit) const {
    Box2 ray;
    ray.add(p);
    ray.add(Point2(std::max(box_.high.x, p.x), p.y));
    tree_.visit_box(ray, [&](Index s) {
        const auto& [a, b] = tree_.segment(s);
        if ((a.y > p.y) != (b.y > p.y) && p.x < (b.x - a.x) * (p.y - a.y) / (b.y - a.y) + a.x) visit(s);
        return true;
    });
}

Index OutlineCurves::innermost_loop(const Point2& p) const {
    std::vector<std::uint8_t> inside(loops_.size(), 0);
    visit_ray(p, [&](Index s) { inside[loop_of_[s]] ^= 1; });
    Index best = kNoIndex;
    for (Index l = 0; l < loops_.size(); ++l)
        if (inside[l] && (best == kNoIndex || std::abs(loops_[l].area) < std::abs(loops_[best].area)))
            best = l;
    return best;
}

bool OutlineCurves::is_inside(const Point2& p) const {
    bool inside = false;
    visit_ray(p, [&](Index) { inside = !inside; });
    return inside;
}

double OutlineCurves::chord_deviation(Index loop, double from, double to) const {
    const Point2 a = point(loop, from), d = point(loop, to) - a;
    const double length2 = glm::dot(d, d);
    const auto distance = [&](const Point2& p) {
        const double t = length2 > 0 ? std::clamp(glm::dot(p - a, d) / length2, 0.0, 1.0) : 0;
        return glm::distance(p, a + t * d);
    };
    // Between its points the outline is straight, so the largest distance is at one of them.
    const Loop& of = loops_[loop];
    const double turns = std::floor(from / of.length) * of.length;
    double s = from;
    const Index first = locate(of, s);
    const auto n = static_cast<Index>(of.s.size() - 1);
    double largest = 0;
    for (Index k = 1; k <= n; ++k) {
        const Index i = (first + k) % n;
        const double at = of.s[i] + turns + (first + k >= n ? of.length : 0);
        if (at >= to) break;
        largest = std::max(largest, distance(tree_.segment(of.first_segment + i)[0]));
    }
    return largest;
}

} // namespace hexopt
