#include "stages/refine/closeness.hpp"

#include "domain/closest_point.hpp"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>

namespace hexopt {

Closeness::Closeness(const Domain& domain) : domain_(domain) {
    const BoundaryModel& model = domain.model;
    std::vector<double> area(model.patch_count(), 0), perimeter(model.patch_count(), 0);
    for (Index t = 0; t < model.triangle_count(); ++t) {
        const auto& x = model.triangle(t);
        area[model.patch_of_triangle(t)] += glm::length(glm::cross(x[1] - x[0], x[2] - x[0])) / 2;
    }
    std::vector<Box> boxes(model.segment_count());
    Box frame;
    curve_length_.assign(model.curve_count(), 0);
    for (Index s = 0; s < model.segment_count(); ++s) {
        const auto& ends = model.segment(s);
        curve_length_[model.curve_of_segment(s)] += glm::distance(ends[0], ends[1]);
        for (const Point& p : ends) boxes[s].add(p);
        frame.add(boxes[s]);
    }
    for (Index c = 0; c < model.curve_count(); ++c) {
        const auto patches = domain.curve_patch[c];
        for (Index patch : patches) perimeter[patch] += curve_length_[c] * (patches.size() == 1 ? 2 : 1);
        if (model.curve_closed(c)) curve_length_[c] /= 3;
    }
    for (Index p = 0; p < model.patch_count(); ++p) {
        const double quarter = perimeter[p] / 4, square = quarter * quarter - area[p];
        patch_width_.push_back(square > 0 ? area[p] / (quarter + std::sqrt(square)) : std::sqrt(area[p]));
    }
    if (boxes.empty()) return;
    tree_ = BoxTree(frame);
    root_ = tree_.add_tree(boxes, 0, order_);
}

bool Closeness::are_neighbours(Index a, Index b) const {
    for (Index end : domain_.model.curve_ends(a))
        for (Index other : domain_.model.curve_ends(b))
            if (end != kNoIndex && end == other) return true;
    return false;
}

double Closeness::other_curve(Index curve, const Point& from, double reach) const {
    if (root_ == kNoIndex) return reach;
    const double nearest = 1e-9 * domain_.model.diagonal();
    double best2 = reach * reach;
    tree_.visit_near(root_, from, best2, [&](Index first, Index last) {
        for (Index item = first; item < last; ++item) {
            const Index other = domain_.model.curve_of_segment(order_[item]);
            if (other == curve || are_neighbours(curve, other)) continue;
            const auto& ends = domain_.model.segment(order_[item]);
            const Point d = closest_on_segment(from, ends[0], ends[1]).point - from;
            const double distance2 = glm::dot(d, d);
            if (distance2 > nearest * nearest) best2 = std::min(best2, distance2);
        }
    });
    return std::sqrt(best2);
}

} // namespace hexopt
