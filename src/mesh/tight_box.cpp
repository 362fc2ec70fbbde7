#include "mesh/tight_box.hpp"

#include "core/random.hpp"

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>
#include <tuple>

namespace hexopt {

namespace {

constexpr int kDirections = 400; ///< in which extreme points are looked for
constexpr int kStarts = 300, kRefined = 6;
constexpr double kFirstStep = 0.2, kLastStep = 1e-4; ///< radians

/// Unit vectors spread evenly over the sphere.
Point direction(int i) {
    const double z = 1 - (2 * i + 1.0) / kDirections, r = std::sqrt(1 - z * z), angle = 2.39996323 * i;
    return {r * std::cos(angle), r * std::sin(angle), z};
}

/// The points that lie farthest in the directions: all that a box touches, nearly.
std::vector<Point> find_extremes(const std::vector<Point>& points) {
    std::vector<Point> extremes;
    for (int i = 0; i < kDirections; ++i) {
        const Point along = direction(i);
        Point farthest = points.front();
        double most = glm::dot(along, farthest);
        for (const Point& p : points) {
            const double length = glm::dot(along, p);
            if (length > most ||
                (length == most && std::tie(p.x, p.y, p.z) < std::tie(farthest.x, farthest.y, farthest.z)))
                most = length, farthest = p;
        }
        extremes.push_back(farthest);
    }
    return extremes;
}

struct Candidate {
    double squared_diagonal;
    glm::dquat rotation;
};

Candidate measure(const std::vector<Point>& points, const glm::dquat& rotation) {
    const glm::dmat3 turn = glm::mat3_cast(rotation);
    Point low = turn * points.front(), high = low;
    for (const Point& p : points) {
        const Point q = turn * p;
        low = glm::min(low, q), high = glm::max(high, q);
    }
    return {glm::dot(high - low, high - low), rotation};
}

Candidate refine(const std::vector<Point>& points, Candidate best) {
    for (double step = kFirstStep; step > kLastStep;) {
        const double before = best.squared_diagonal;
        for (int axis = 0; axis < 3; ++axis)
            for (double angle : {-step, step}) {
                Point about(0);
                about[axis] = 1;
                const glm::dquat turned = glm::normalize(glm::angleAxis(angle, about) * best.rotation);
                const Candidate next = measure(points, turned);
                if (next.squared_diagonal < best.squared_diagonal) best = next;
            }
        if (!(best.squared_diagonal < before)) step *= 0.5;
    }
    return best;
}

} // namespace

glm::dmat3 find_tight_box(const std::vector<Point>& points) {
    if (points.empty()) return glm::dmat3(1);
    const std::vector<Point> extremes = find_extremes(points);
    std::vector<Candidate> candidates = {measure(extremes, glm::dquat(1, 0, 0, 0))};
    Random random(1);
    for (int i = 0; i < kStarts; ++i) {
        const double u = random.uniform(), a = 2 * M_PI * random.uniform(), b = 2 * M_PI * random.uniform();
        candidates.push_back(
            measure(extremes, glm::dquat(std::sqrt(u) * std::cos(b), std::sqrt(1 - u) * std::sin(a),
                                         std::sqrt(1 - u) * std::cos(a), std::sqrt(u) * std::sin(b))));
    }
    const auto is_tighter = [](const Candidate& a, const Candidate& b) {
        return a.squared_diagonal < b.squared_diagonal;
    };
    std::stable_sort(candidates.begin(), candidates.end(), is_tighter);
    candidates.resize(kRefined);
    for (Candidate& candidate : candidates) candidate = refine(extremes, candidate);
    return glm::mat3_cast(std::min_element(candidates.begin(), candidates.end(), is_tighter)->rotation);
}

} // namespace hexopt
