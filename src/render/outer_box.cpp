#include "render/outer_box.hpp"

#include <algorithm>
#include <array>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <limits>

namespace hexopt {

namespace {

constexpr double kOnPlane_rel = 1e-6;
constexpr double kFilled = 0.9;
constexpr int kFilledSides = 5, kNoSide = -1;

/// Side of the box (axis, 3 + axis for the upper one) that holds a face; kNoSide: none.
int side_of(const HexMesh& mesh, CellFace face, const Bounds& box) {
    const double tolerance = kOnPlane_rel * glm::distance(box.low, box.high);
    const Quad quad = face_vertices(mesh, face);
    for (int side = 0; side < 6; ++side) {
        const int axis = side % 3;
        const double plane = side < 3 ? box.low[axis] : box.high[axis];
        if (std::all_of(quad.begin(), quad.end(),
                        [&](Index v) { return std::abs(mesh.positions[v][axis] - plane) <= tolerance; }))
            return side;
    }
    return kNoSide;
}

double area_of(const HexMesh& mesh, CellFace face) {
    const Quad q = face_vertices(mesh, face);
    return 0.5 * glm::length(glm::cross(mesh.positions[q[2]] - mesh.positions[q[0]],
                                        mesh.positions[q[3]] - mesh.positions[q[1]]));
}

} // namespace

Bounds bounds_of(const HexMesh& mesh) {
    Bounds box{Point(std::numeric_limits<double>::max()), Point(std::numeric_limits<double>::lowest())};
    for (const Point& p : mesh.positions) {
        box.low = glm::min(box.low, p);
        box.high = glm::max(box.high, p);
    }
    return box;
}

std::vector<std::uint8_t> find_faces_on_box(const HexMesh& mesh, const Topology& topology) {
    const Bounds box = bounds_of(mesh);
    std::vector<std::uint8_t> on_box;
    for (CellFace face : topology.boundary_faces) on_box.push_back(side_of(mesh, face, box) != kNoSide);
    return on_box;
}

bool has_outer_box(const HexMesh& mesh, const Topology& topology) {
    const Bounds box = bounds_of(mesh);
    const Point extent = box.high - box.low;
    std::array<double, 6> area{};
    bool has_others = false;
    for (CellFace face : topology.boundary_faces) {
        const int side = side_of(mesh, face, box);
        has_others = has_others || side == kNoSide;
        if (side != kNoSide) area[side] += area_of(mesh, face);
    }
    int filled = 0;
    for (int side = 0; side < 6; ++side)
        filled += area[side] >= kFilled * extent[(side + 1) % 3] * extent[(side + 2) % 3];
    return has_others && filled >= kFilledSides;
}

} // namespace hexopt
