#include "stages/trim/coverage.hpp"

#include "domain/clip_triangle.hpp"
#include "mesh/hex_reference.hpp"
#include "stages/trim/bare_parts.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace hexopt::trimming {

namespace {

constexpr std::size_t kChunk = 256;
constexpr std::size_t kMostPieces = 64; ///< triangles of one cell; of more, evenly many are left out
/// Of a cell's side: where the surface lies in cells' sides, rounding leaves slivers of it in the cells
/// beside those, with any normal.
constexpr double kSliver = 1e-9;
constexpr double kSameSide = 0.5;  ///< cosine between normals that count as one side of the surface
constexpr double kFacing = 0.3;    ///< cosine between a side and a face that covers it
constexpr double kReach_h = 1.0;   ///< along the face's normal
constexpr double kBeside_h = 0.45; ///< half a cell is the middle of a hole of one cell

/// The surface of about one direction in a cell.
struct Side {
    Point normal = Point(0); ///< sum of vector areas
    Point moment = Point(0); ///< sum of centroids by area
    double area = 0;
    Point at = Point(0); ///< centroid of the largest piece
    double largest = 0;
    Index patch = kNoIndex; ///< of that piece

    Point direction() const { return glm::normalize(normal); }
    Point centre() const { return moment / area; }
};

struct Piece {
    Point centroid, vector_area;
    Index patch;
};

Piece cut_out(const TriangleTree::Corners& x, Index patch, const Box& box) {
    const ClippedTriangle part = clip_triangle(x, box);
    std::array<Point, 9> p;
    Piece piece{Point(0), Point(0), patch};
    for (int k = 0; k < part.count; ++k) {
        p[k] = part.weight[k][0] * x[0] + part.weight[k][1] * x[1] + part.weight[k][2] * x[2];
        piece.centroid += p[k] / static_cast<double>(part.count);
    }
    for (int k = 2; k < part.count; ++k) piece.vector_area += 0.5 * glm::cross(p[k - 1] - p[0], p[k] - p[0]);
    return piece;
}

class CoverageSearch {
  public:
    CoverageSearch(const HexMesh& mesh, const CellGraph& graph, const KeptCells& kept,
                   const SurfaceQueries& queries)
        : mesh_(mesh), graph_(graph), kept_(kept), queries_(queries) {}

    void look_at(Index cell, Coverage& found) {
        gather_sides(cell);
        if (sides_.empty()) return;
        gather_faces_near(cell);
        const double h = cell_size(mesh_, cell);
        const std::size_t first = found.spots.size();
        double thinnest = std::numeric_limits<double>::infinity();
        for (const Side& side : sides_) {
            found.area += side.area;
            if (is_covered(side, h)) continue;
            const double thickness = thickness_behind(side, h);
            if (thickness == 0) continue;
            thinnest = std::min(thinnest, thickness);
            found.bare_area += side.area;
            found.spots.push_back({side.at, cell, side.patch, side.area, h, thickness, 0});
        }
        for (std::size_t i = first; i < found.spots.size(); ++i) found.spots[i].thickness = thinnest;
    }

  private:
    struct Face {
        Point centre, normal; ///< unit
        double half;          ///< of its longest side
    };

    void gather_sides(Index cell) {
        sides_.clear();
        Box box;
        for (Index v : mesh_.cells[cell]) box.add(mesh_.positions[v]);
        triangles_.clear();
        queries_.triangles().visit_box(box, [&](Index t, const TriangleTree::Corners&) {
            triangles_.push_back(t);
            return false;
        });
        const double least = kSliver * cell_size(mesh_, cell) * cell_size(mesh_, cell);
        const std::size_t step = (triangles_.size() + kMostPieces - 1) / kMostPieces;
        for (std::size_t i = 0; i < triangles_.size(); i += step) {
            const Index t = triangles_[i];
            Piece piece = cut_out(queries_.model().triangle(t), queries_.model().patch_of_triangle(t), box);
            piece.vector_area *= static_cast<double>(step);
            if (const double area = glm::length(piece.vector_area); area > least) add(piece, area);
        }
    }

    void add(const Piece& piece, double area) {
        Side* side = nullptr;
        for (Side& s : sides_)
            if (glm::dot(s.direction(), piece.vector_area) > kSameSide * area) side = &s;
        if (!side) side = &sides_.emplace_back();
        side->normal += piece.vector_area;
        side->moment += area * piece.centroid;
        side->area += area;
        if (area > side->largest) side->largest = area, side->at = piece.centroid, side->patch = piece.patch;
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

    bool is_covered(const Side& side, double h) const {
        const Point centre = side.centre(), direction = side.direction();
        return std::any_of(faces_.begin(), faces_.end(), [&](const Face& face) {
            if (glm::dot(face.normal, direction) < kFacing) return false;
            const Point d = centre - face.centre;
            const double along = glm::dot(d, face.normal);
            if (std::abs(along) > kReach_h * h) return false;
            const Point beside = glm::abs(d - along * face.normal);
            return std::max({beside.x, beside.y, beside.z}) < face.half + kBeside_h * h;
        });
    }

    /// How far the inside goes on behind a side; 0 where the surface has not the inside behind it and the
    /// outside before it, so that no cells are wanted there.
    double thickness_behind(const Side& side, double h) const {
        const Point n = side.direction();
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
    std::vector<Index> triangles_;
    std::vector<Side> sides_;
    std::vector<Index> near_, star_;
    std::vector<Face> faces_;
};

} // namespace

Coverage measure_coverage(const HexMesh& mesh, const CellGraph& graph, const CellSides& sides,
                          const KeptCells& kept, const SurfaceQueries& queries, const Parallel& parallel) {
    std::vector<Coverage> parts((mesh.cell_count() + kChunk - 1) / kChunk);
    parallel.for_chunks(mesh.cell_count(), kChunk, [&](std::size_t begin, std::size_t end) {
        CoverageSearch search(mesh, graph, kept, queries);
        for (auto c = static_cast<Index>(begin); c < end; ++c)
            if (sides.cut[c]) search.look_at(c, parts[begin / kChunk]);
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
