#include "stages/fit/curve_sides.hpp"

#include <algorithm>
#include <glm/geometric.hpp>

namespace hexopt::fit {

namespace {

/// Segments of a leg that are looked at, spread over it.
constexpr std::size_t kSamples = 9;
/// Part of the votes by which one side must win.
constexpr double kClear = 0.2;

/// How much of `patch` lies left of the directed segment, -1..1: where the triangle at its middle extends to.
double lies_left(const BoundaryModel& model, Index patch, const Point& from, const Point& to) {
    const Point middle = 0.5 * (from + to);
    const Projection at = model.project_patch(patch, middle);
    const auto& corner = model.triangle(at.element);
    const Point inwards = (corner[0] + corner[1] + corner[2]) / 3.0 - middle;
    const Point left = glm::cross(at.direction, to - from);
    const double size = glm::length(inwards) * glm::length(left);
    return size > 0 ? glm::dot(inwards, left) / size : 0;
}

Index left_patch(const Domain& domain, const Leg& leg) {
    const std::span<const Index> own = domain.curve_patch[leg.curve];
    if (own.size() != 2) return kNoIndex;
    const std::size_t segments = leg.points.size() - 1, samples = std::min(segments, kSamples);
    double vote = 0, total = 0;
    for (std::size_t k = 0; k < samples; ++k) {
        const std::size_t i = (2 * k + 1) * segments / (2 * samples);
        const Point &from = leg.points[i], &to = leg.points[i + 1];
        const double length = glm::distance(from, to);
        vote += 0.5 * length *
                (lies_left(domain.model, own[0], from, to) - lies_left(domain.model, own[1], from, to));
        total += length;
    }
    if (std::abs(vote) <= kClear * total) return kNoIndex;
    return own[vote > 0 ? 0 : 1];
}

} // namespace

std::vector<Index> find_left_patches(const Domain& domain, const CurveNet& net) {
    std::vector<Index> left;
    left.reserve(net.legs.size());
    for (const Leg& leg : net.legs) left.push_back(left_patch(domain, leg));
    return left;
}

} // namespace hexopt::fit
