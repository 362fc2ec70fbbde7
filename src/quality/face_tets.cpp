#include "quality/face_tets.hpp"

#include <algorithm>
#include <glm/geometric.hpp>

namespace hexopt {

namespace {

struct FaceCentre {
    Point point;
    Point area; ///< normal times area
};

/// By the triangles from the mean of the corners, weighted by their areas.
FaceCentre face_centre(std::span<const Index> corners, std::span<const Point> positions) {
    const std::size_t count = corners.size();
    if (count == 3) {
        const Point &a = positions[corners[0]], &b = positions[corners[1]], &c = positions[corners[2]];
        return {(a + b + c) / 3.0, 0.5 * glm::cross(b - a, c - a)};
    }
    Point mean(0);
    for (Index v : corners) mean += positions[v];
    mean /= static_cast<double>(count);
    Point area(0), moment(0);
    double sum = 0;
    for (std::size_t k = 0; k < count; ++k) {
        const Point &a = positions[corners[k]], &b = positions[corners[(k + 1) % count]];
        const Point normal = glm::cross(b - a, mean - a);
        const double size = glm::length(normal);
        area += normal;
        sum += size;
        moment += size * (a + b + mean);
    }
    return {sum > 0 ? moment / (3 * sum) : mean, 0.5 * area};
}

double tet_volume(const Point& apex, const Point& a, const Point& b, const Point& c) {
    return glm::dot(glm::cross(a - apex, b - apex), c - apex) / 6;
}

} // namespace

CellCentre FaceTets::centre(std::size_t cell, std::span<const Point> positions) const {
    const std::span<const std::size_t> own = of_cell_[cell];
    std::vector<FaceCentre> centres(own.size());
    Point mean(0);
    for (std::size_t k = 0; k < own.size(); ++k) {
        centres[k] = face_centre(faces_.vertices[own[k] >> 1], positions);
        if (own[k] & 1) centres[k].area = -centres[k].area;
        mean += centres[k].point;
    }
    mean /= static_cast<double>(own.size());
    Point moment(0);
    double volume = 0;
    for (std::size_t k = 0; k < own.size(); ++k) {
        const double part = glm::dot(centres[k].area, centres[k].point - mean) / 3;
        moment += part * (0.75 * centres[k].point + 0.25 * mean);
        volume += part;
    }
    return {volume > 0 ? moment / volume : mean, volume};
}

double FaceTets::margin(std::size_t face, std::span<const Point> positions, const CellCentre& owner,
                        const CellCentre& neighbour) const {
    const std::span<const Index> corners = faces_.vertices[face];
    const std::size_t count = corners.size();
    const bool internal = is_internal(face);
    if (!(owner.volume > 0) || (internal && !(neighbour.volume > 0))) return -1;
    double best = -1;
    for (std::size_t from = 0; from < (count == 4 ? 2 : count); ++from) { // opposite corners cut a quad alike
        double least = 1;
        for (std::size_t k = 1; k + 1 < count; ++k) {
            const Point &a = positions[corners[from]], &b = positions[corners[(from + k) % count]],
                        &c = positions[corners[(from + k + 1) % count]];
            least = std::min(least, tet_volume(owner.point, a, b, c) / owner.volume);
            if (internal) least = std::min(least, -tet_volume(neighbour.point, a, b, c) / neighbour.volume);
        }
        best = std::max(best, least);
    }
    if (count == 3) return best;
    const Point middle = face_centre(corners, positions).point;
    // These tetrahedra are more than those from a corner, and so much smaller.
    const double more = static_cast<double>(count) / static_cast<double>(count - 2);
    for (std::size_t k = 0; k < count; ++k) {
        const Point &a = positions[corners[k]], &b = positions[corners[(k + 1) % count]];
        best = std::min(best, more * tet_volume(owner.point, middle, a, b) / owner.volume);
        if (internal)
            best = std::min(best, -more * tet_volume(neighbour.point, middle, a, b) / neighbour.volume);
    }
    return best;
}

double FaceTets::margin(std::size_t face, std::span<const Point> positions) const {
    const CellCentre own = centre(owner(face), positions);
    return margin(face, positions, own, is_internal(face) ? centre(neighbour(face), positions) : own);
}

std::vector<std::size_t> FaceTets::find_warped(std::span<const Point> positions, double least,
                                               const Parallel& parallel) const {
    std::vector<CellCentre> centres(of_cell_.rows());
    parallel.for_each(centres.size(), 256, [&](std::size_t c) { centres[c] = centre(c, positions); });
    std::vector<std::uint8_t> is_warped(faces_.count());
    parallel.for_each(faces_.count(), 256, [&](std::size_t f) {
        const CellCentre& own = centres[owner(f)];
        is_warped[f] = !(margin(f, positions, own, is_internal(f) ? centres[neighbour(f)] : own) > least);
    });
    std::vector<std::size_t> warped;
    for (std::size_t f = 0; f < is_warped.size(); ++f)
        if (is_warped[f]) warped.push_back(f);
    return warped;
}

} // namespace hexopt
