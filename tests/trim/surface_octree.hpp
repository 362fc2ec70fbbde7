#pragma once

#include "core/random.hpp"
#include "domain/domain.hpp"
#include "samples/box_mesh.hpp"

#include <algorithm>
#include <cmath>
#include <set>

namespace hexopt {

/// An octree round a surface, finer near it, made from the samples' boxes: what refinement gives to trimming.
struct SurfaceOctree {
    Point low;   ///< corner of the lattice
    double size; ///< edge of a level-0 cell
    OctreeOptions options;
    std::set<std::array<std::int64_t, 4>> asked; ///< level and place of boxes that are to be cut

    /// Cells of the octree that are to be cut the next time.
    void ask(const HexMesh& mesh, const std::vector<Index>& cells) {
        for (Index c : cells) {
            const Point at = (mesh.positions[mesh.cells[c][0]] - low) / size;
            const double scale = 1 << mesh.level[c];
            asked.insert({mesh.level[c], std::llround(at.x * scale), std::llround(at.y * scale),
                          std::llround(at.z * scale)});
        }
    }

    /// near(centre, edge, level): whether a box is to be cut. Asked boxes, and those that contain them, are.
    template <class Near>
    HexMesh make(int levels, const Near& near) {
        options.levels = levels;
        std::set<std::array<std::int64_t, 4>> above = asked;
        for (auto box : asked)
            while (box[0]-- > 0) {
                for (int k = 1; k < 4; ++k) box[k] /= 2;
                above.insert(box);
            }
        options.refine = [&](Point a, Point b) {
            const int level = static_cast<int>(std::lround(-std::log2(b.x - a.x)));
            const double scale = 1 << level;
            if (above.contains(
                    {level, std::llround(a.x * scale), std::llround(a.y * scale), std::llround(a.z * scale)}))
                return true;
            return near(low + size * 0.5 * (a + b), size * (b.x - a.x), level);
        };
        HexMesh mesh = *make_box_mesh(make_octree_boxes(options), lattice_units(levels));
        for (Point& p : mesh.positions) p = low + size * p;
        return mesh;
    }
};

inline Box surface_box(const BoundaryModel& model) {
    Box box;
    for (Index t = 0; t < model.triangle_count(); ++t)
        for (const Point& p : model.triangle(t)) box.add(p);
    return box;
}

/// `roots` cells along the longest side, a cell more on every side, off the surface's own box by a part of a
/// cell, so that nothing is aligned by chance.
inline SurfaceOctree octree_round(const Box& box, std::uint32_t roots, double offset = 0.37) {
    const Point extent = box.high - box.low;
    SurfaceOctree octree;
    octree.size = std::max({extent.x, extent.y, extent.z}) / roots;
    octree.low = box.low - Point(octree.size * (1 + offset));
    for (int k = 0; k < 3; ++k)
        octree.options.roots[k] = static_cast<std::uint32_t>(std::ceil(extent[k] / octree.size)) + 3;
    return octree;
}

} // namespace hexopt
