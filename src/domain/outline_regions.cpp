#include "domain/outline_regions.hpp"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <glm/geometric.hpp>

namespace hexopt {

namespace {

bool is_inside(const OutlineLoop& loop, const Point2& p) {
    bool inside = false;
    const auto& points = loop.points;
    for (std::size_t i = 0, k = points.size() - 1; i < points.size(); k = i++) {
        const Point2 &a = points[i], &b = points[k];
        if ((a.y > p.y) != (b.y > p.y) && p.x < (b.x - a.x) * (p.y - a.y) / (b.y - a.y) + a.x)
            inside = !inside;
    }
    return inside;
}

/// Loops that enclose each loop.
class Nesting {
  public:
    explicit Nesting(const Outline& outline) : around_(outline.loops.size()) {
        const auto& loops = outline.loops;
        std::vector<Box2> box(loops.size());
        for (std::size_t l = 0; l < loops.size(); ++l)
            for (const Point2& p : loops[l].points) box[l].add(p);
        for (std::size_t l = 0; l < loops.size(); ++l)
            for (std::size_t k = 0; k < loops.size(); ++k)
                if (k != l && box[k].distance2(loops[l].points[0]) == 0 &&
                    is_inside(loops[k], loops[l].points[0]))
                    around_[l].push_back(k);
    }
    std::size_t depth(std::size_t loop) const { return around_[loop].size(); }
    /// The innermost loop round this one; itself where there is none.
    std::size_t parent(std::size_t loop) const {
        std::size_t best = loop;
        for (std::size_t k : around_[loop])
            if (best == loop || depth(k) > depth(best)) best = k;
        return best;
    }

  private:
    std::vector<std::vector<std::size_t>> around_;
};

/// Outer loops of the regions that hold the seeds.
Result<std::vector<std::uint8_t>> regions_of_seeds(const Outline& outline, const Nesting& nesting,
                                                   const std::vector<Point2>& seeds) {
    std::vector<std::uint8_t> chosen(outline.loops.size(), 0);
    for (const Point2& seed : seeds) {
        std::size_t innermost = outline.loops.size(), around = 0;
        for (std::size_t l = 0; l < outline.loops.size(); ++l)
            if (is_inside(outline.loops[l], seed)) {
                ++around;
                if (innermost == outline.loops.size() || nesting.depth(l) > nesting.depth(innermost))
                    innermost = l;
            }
        if (around % 2 == 0)
            return make_error(ErrorCode::usage, "seeds", "",
                              outline.describe(seed) + " is not inside the outline");
        chosen[innermost] = 1;
    }
    return chosen;
}

} // namespace

Result<Outline> choose_regions(Outline outline, const RegionChoice& choice, RegionReport& report) {
    const Nesting nesting(outline);
    const std::size_t count = outline.loops.size();
    std::vector<double> area(count, 0); // of the region inside each outer loop
    for (std::size_t l = 0; l < count; ++l) {
        const double own = std::abs(twice_area(outline.loops[l].points)) / 2;
        if (nesting.depth(l) % 2 == 0)
            area[l] += own;
        else
            area[nesting.parent(l)] -= own;
    }
    std::vector<std::uint8_t> chosen(count, 0);
    if (!choice.seeds.empty()) {
        auto of_seeds = regions_of_seeds(outline, nesting, choice.seeds);
        if (!of_seeds) return of_seeds.error();
        chosen = std::move(*of_seeds);
    } else {
        const double largest = *std::max_element(area.begin(), area.end());
        for (std::size_t l = 0; l < count; ++l)
            chosen[l] = nesting.depth(l) % 2 == 0 &&
                        (choice.outer_first ? l == 0 : area[l] >= choice.part_fraction * largest);
    }
    Outline kept;
    kept.patch_names = std::move(outline.patch_names);
    kept.frame = outline.frame;
    kept.height = outline.height;
    for (std::size_t l = 0; l < count; ++l) {
        const bool is_outer = nesting.depth(l) % 2 == 0;
        if (is_outer) ++(chosen[l] ? report.regions : report.dropped_regions);
        if (!chosen[is_outer ? l : nesting.parent(l)]) {
            ++report.dropped_loops;
            continue;
        }
        OutlineLoop& loop = outline.loops[l];
        if ((twice_area(loop.points) > 0) != is_outer) {
            std::reverse(loop.points.begin(), loop.points.end());
            std::reverse(loop.line.begin(), loop.line.end());
            std::reverse(loop.patch.begin(), loop.patch.end() - 1); // segment i now ends where it began
        }
        kept.loops.push_back(std::move(loop));
    }
    if (kept.loops.empty())
        return make_error(ErrorCode::bad_input, "outline", "", "there is no region to mesh");
    return kept;
}

Result<Outline> add_farfield(Outline outline, const Box2& box) {
    if (!(box.low.x < box.high.x && box.low.y < box.high.y))
        return make_error(ErrorCode::usage, "farfield", "",
                          "the box is empty: give the lower bounds, then the upper ones");
    for (const OutlineLoop& loop : outline.loops)
        for (const Point2& p : loop.points)
            if (!(p.x > box.low.x && p.x < box.high.x && p.y > box.low.y && p.y < box.high.y))
                return make_error(
                    ErrorCode::usage, "farfield", "",
                    fmt::format("the point {} of the outline is not inside the box", outline.describe(p)));
    const auto first = static_cast<Index>(outline.patch_names.size());
    const int across = outline.frame.axis().value_or(2);
    for (int d = 0; d < 2; ++d)
        for (const char* end : {"min", "max"})
            outline.patch_names.push_back(fmt::format("farfield_{}_{}", "xyz"[(across + 1 + d) % 3], end));
    OutlineLoop loop;
    loop.points = {box.low, {box.high.x, box.low.y}, box.high, {box.low.x, box.high.y}};
    loop.patch = {first + 2, first + 1, first + 3, first};
    outline.loops.insert(outline.loops.begin(), std::move(loop));
    return outline;
}

Box2 body_box(const Outline& outline) {
    std::vector<Box2> box(outline.loops.size());
    Box2 all;
    for (std::size_t l = 0; l < outline.loops.size(); ++l) {
        for (const Point2& p : outline.loops[l].points) box[l].add(p);
        all.add(box[l]);
    }
    constexpr double kFull = 0.999; // of its bounding box
    Box2 bodies;
    bool has_farfield = false;
    for (std::size_t l = 0; l < outline.loops.size(); ++l) {
        const Point2 size = box[l].high - box[l].low;
        const bool is_around = box[l].low == all.low && box[l].high == all.high;
        if (is_around && std::abs(twice_area(outline.loops[l].points)) / 2 >= kFull * size.x * size.y)
            has_farfield = true;
        else
            bodies.add(box[l]);
    }
    return has_farfield && bodies.low.x <= bodies.high.x ? bodies : all;
}

} // namespace hexopt
