#include "stages/trim/coverage.hpp"

#include "mesh/hex_reference.hpp"
#include "stages/trim/bare_parts.hpp"
#include "stages/trim/find_surface_sides.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace hexopt::trimming {

namespace {

constexpr std::size_t kChunk = 256;
constexpr double kFacing = 0.3;    ///< cosine between a side and a face that covers it
constexpr double kReach_h = 1.0;   ///< along the face's normal
constexpr double kBeside_h = 0.45; ///< half a cell is the middle of a hole of one cell

class CoverageSearch {
  public:
    CoverageSearch(const HexMesh& mesh, const CellGraph& graph, const KeptCells& kept,
                   const SurfaceQueries& queries)
        : mesh_(mesh), graph_(graph), kept_(kept), queries_(queries) {}

    void look_at(Index cell, std::span<SurfaceSide> sides, Coverage& found) {
        if (sides.empty()) return;
        const double h = cell_size(mesh_, cell);
        for (const SurfaceSide& side : sides) found.area += side.area;
        // Most sides are covered by faces of the cell itself or of those behind its own.
        gather_faces_behind(cell);
        bare_.clear();
        add_bare(sides, h);
        if (bare_.empty()) return;
        gather_faces_near(cell);
        bare_.clear();
        add_bare(sides, h);
        const std::size_t first = found.spots.size();
        double thinnest = std::numeric_limits<double>::infinity();
        for (SurfaceSide* side : bare_) {
            if (side->thickness == kUnknownThickness) side->thickness = thickness_behind(*side, h);
            if (side->thickness == 0) continue;
            thinnest = std::min(thinnest, side->thickness);
            found.bare_area += side->area;
            found.spots.push_back({side->at, cell, side->patch, side->area, h, side->thickness, 0});
        }
        for (std::size_t i = first; i < found.spots.size(); ++i) found.spots[i].thickness = thinnest;
    }

  private:
    struct Face {
        Point centre, normal; ///< unit
        double half;          ///< of its longest side
    };

    void add_bare(std::span<SurfaceSide> sides, double h) {
        for (SurfaceSide& side : sides)
            if (!is_covered(side, h)) bare_.push_back(&side);
    }

    /// Faces of the kept cells' boundary at this cell and those with which it shares a face.
    void gather_faces_behind(Index cell) {
        near_.assign(1, cell);
        for (int f = 0; f < 6; ++f) graph_.visit_behind(cell, f, [&](Index c) { near_.push_back(c); });
        gather_faces();
    }

    /// Faces of the kept cells' boundary at the cells that touch this one.
    void gather_faces_near(Index cell) {
        near_.assign(1, cell);
        const auto add_star = [&](Index v) {
            graph_.gather_star(v, star_);
            near_.insert(near_.end(), star_.begin(), star_.end());
        };
        for (Index v : mesh_.cells[cell]) add_star(v);
        for (Index v : graph_.cell_hanging[cell]) add_star(v);
        std::sort(near_.begin(), near_.end());
        near_.erase(std::unique(near_.begin(), near_.end()), near_.end());
        gather_faces();
    }

    void gather_faces() {
        faces_.clear();
        for (Index c : near_)
            if (kept_.is_kept(c))
                for (std::uint32_t f = 0; f < 6; ++f) add_face({c, f});
    }

    void add_face(CellFace face) {
        const Index behind = graph_.neighbour[face.cell][face.face];
        if (behind != kNoIndex && (behind & CellGraph::kFine)) {
            for (CellFace fine : graph_.fine_faces[behind & ~CellGraph::kFine])
                if (!kept_.is_kept(fine.cell)) append(fine, -1);
        } else if (behind == kNoIndex || !kept_.is_kept(behind)) {
            append(face, 1);
        }
    }

    void append(CellFace face, double sign) {
        const Quad q = face_vertices(mesh_, face);
        const auto& x = mesh_.positions;
        const Point a = x[q[2]] - x[q[0]], b = x[q[3]] - x[q[1]], normal = glm::cross(a, b);
        const double length = glm::length(normal);
        if (!(length > 0)) return;
        const double half = 0.5 * std::max(glm::distance(x[q[0]], x[q[1]]), glm::distance(x[q[1]], x[q[2]]));
        faces_.push_back({0.25 * (x[q[0]] + x[q[1]] + x[q[2]] + x[q[3]]), sign / length * normal, half});
    }

    bool is_covered(const SurfaceSide& side, double h) const {
        return std::any_of(faces_.begin(), faces_.end(), [&](const Face& face) {
            if (glm::dot(face.normal, side.direction) < kFacing) return false;
            const Point d = side.centre - face.centre;
            const double along = glm::dot(d, face.normal);
            if (std::abs(along) > kReach_h * h) return false;
            const Point beside = glm::abs(d - along * face.normal);
            return std::max({beside.x, beside.y, beside.z}) < face.half + kBeside_h * h;
        });
    }

    /// How far the inside goes on behind a side; 0 where the surface has not the inside behind it and the
    /// outside before it, so that no cells are wanted there.
    double thickness_behind(const SurfaceSide& side, double h) const {
        const Point n = side.direction;
        const double step = kContact_h * h;
        if (queries_.is_inside(side.at + step * n) || !queries_.is_inside(side.at - step * n)) return 0;
        const double far = 4 * h;
        double thickness = far;
        queries_.triangles().visit_line(side.at, -n, step, far, [&](Index, double t, bool leaving) {
            if (leaving) thickness = std::min(thickness, t);
        });
        return thickness;
    }

    const HexMesh& mesh_;
    const CellGraph& graph_;
    const KeptCells& kept_;
    const SurfaceQueries& queries_;
    std::vector<SurfaceSide*> bare_;
    std::vector<Index> near_, star_;
    std::vector<Face> faces_;
};

} // namespace

Coverage measure_coverage(const HexMesh& mesh, const CellGraph& graph, const CellSides& sides,
                          const KeptCells& kept, const SurfaceQueries& queries, std::span<const Index> key,
                          const Parallel& parallel, SurfaceSides& known) {
    find_surface_sides(mesh, sides, key, queries, parallel, known);
    std::vector<Coverage> parts((mesh.cell_count() + kChunk - 1) / kChunk);
    parallel.for_chunks(mesh.cell_count(), kChunk, [&](std::size_t begin, std::size_t end) {
        CoverageSearch search(mesh, graph, kept, queries);
        for (auto c = static_cast<Index>(begin); c < end; ++c)
            if (sides.cut[c]) search.look_at(c, known.in_cell(key[c]), parts[begin / kChunk]);
    });
    Coverage all;
    for (const Coverage& part : parts) {
        all.area += part.area;
        all.bare_area += part.bare_area;
        all.spots.insert(all.spots.end(), part.spots.begin(), part.spots.end());
    }
    all.parts = join_bare_spots(mesh, graph, kept, all.spots);
    return all;
}

} // namespace hexopt::trimming
