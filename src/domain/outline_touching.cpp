#include "domain/outline_touching.hpp"

#include <algorithm>
#include <fmt/format.h>
#include <numeric>

namespace hexopt {

namespace {

struct Segment {
    Point2 a, b;
    Index loop, point;
};

double side_of(const Point2& a, const Point2& b, const Point2& p) {
    return (b.x - a.x) * (p.y - a.y) - (b.y - a.y) * (p.x - a.x);
}

bool boxes_meet(const Segment& s, const Segment& t) {
    const auto apart = [](double a, double b, double c, double d) {
        return std::max(a, b) < std::min(c, d) || std::max(c, d) < std::min(a, b);
    };
    return !apart(s.a.x, s.b.x, t.a.x, t.b.x) && !apart(s.a.y, s.b.y, t.a.y, t.b.y);
}

bool meet(const Segment& s, const Segment& t) {
    return boxes_meet(s, t) && side_of(s.a, s.b, t.a) * side_of(s.a, s.b, t.b) <= 0 &&
           side_of(t.a, t.b, s.a) * side_of(t.a, t.b, s.b) <= 0;
}

/// Segments that share a point may only fold back onto each other.
bool folds_back(const Segment& first, const Segment& next) {
    const Point2 d = first.b - first.a, e = next.b - next.a;
    return d.x * e.y - d.y * e.x == 0 && d.x * e.x + d.y * e.y < 0;
}

bool are_equal_loops(const OutlineLoop& one, const OutlineLoop& other) {
    if (one.points.size() != other.points.size()) return false;
    const auto sorted = [](std::vector<Point2> points) {
        std::sort(points.begin(), points.end(),
                  [](const Point2& a, const Point2& b) { return a.x != b.x ? a.x < b.x : a.y < b.y; });
        return points;
    };
    return sorted(one.points) == sorted(other.points);
}

class Search {
  public:
    explicit Search(const Outline& outline) : outline_(outline) {
        for (Index l = 0; l < outline.loops.size(); ++l) {
            const auto& points = outline.loops[l].points;
            for (Index i = 0; i < points.size(); ++i)
                segments_.push_back({points[i], points[(i + 1) % points.size()], l, i});
        }
    }

    /// The first pair in the order of the segments, or {0, 0}.
    std::array<std::size_t, 2> find() const {
        std::vector<std::size_t> order(segments_.size());
        std::iota(order.begin(), order.end(), std::size_t{0});
        const auto left = [&](std::size_t s) { return std::min(segments_[s].a.x, segments_[s].b.x); };
        std::sort(order.begin(), order.end(), [&](std::size_t s, std::size_t t) {
            return left(s) != left(t) ? left(s) < left(t) : s < t;
        });
        std::array<std::size_t, 2> first = {0, 0};
        for (std::size_t i = 0; i < order.size(); ++i) {
            const double right = std::max(segments_[order[i]].a.x, segments_[order[i]].b.x);
            for (std::size_t k = i + 1; k < order.size() && left(order[k]) <= right; ++k) {
                const std::array<std::size_t, 2> pair = {std::min(order[i], order[k]),
                                                         std::max(order[i], order[k])};
                if (first[1] > 0 && pair >= first) continue;
                if (touch(segments_[pair[0]], segments_[pair[1]])) first = pair;
            }
        }
        return first;
    }
    const Segment& segment(std::size_t s) const { return segments_[s]; }

  private:
    bool touch(const Segment& s, const Segment& t) const {
        if (s.loop == t.loop) {
            const Index count = static_cast<Index>(outline_.loops[s.loop].points.size());
            if (s.point + 1 == t.point) return folds_back(s, t);
            if ((t.point + 1) % count == s.point) return folds_back(t, s);
        }
        return meet(s, t);
    }

    const Outline& outline_;
    std::vector<Segment> segments_;
};

} // namespace

std::string outline_place(const Outline& outline, std::size_t loop, std::size_t point) {
    const OutlineLoop& of = outline.loops[loop];
    if (of.source.empty() || of.line.empty()) return fmt::format("loop {}, point {}", loop + 1, point + 1);
    return fmt::format("{}:{}", of.source, of.line[point]);
}

Status check_touching(const Outline& outline) {
    const auto bad = [](std::string where, std::string reason, std::string advice) {
        return Error{
            ErrorCode::bad_input, "outline", std::move(where), {std::move(reason), std::move(advice)}};
    };
    for (std::size_t l = 0; l < outline.loops.size(); ++l)
        for (std::size_t k = 0; k < l; ++k)
            if (are_equal_loops(outline.loops[k], outline.loops[l]))
                return bad(outline_place(outline, l, 0),
                           "the loop is the same as that at " + outline_place(outline, k, 0),
                           "give each loop once");
    const Search search(outline);
    const auto [one, other] = search.find();
    if (other == 0) return Done{};
    const Segment &s = search.segment(one), &t = search.segment(other);
    return bad(outline_place(outline, s.loop, s.point),
               fmt::format("the outline crosses or touches {} near {}, where the edge that "
                           "begins here meets the one that begins at {}",
                           s.loop == t.loop ? "itself" : "another loop", outline.describe(t.a),
                           outline_place(outline, t.loop, t.point)),
               "give the points of each loop in order; separate loops by a blank line, each with its first "
               "point repeated at its end");
}

} // namespace hexopt
