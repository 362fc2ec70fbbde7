#include "stages/trim/find_surface_sides.hpp"

#include "domain/clip_triangle.hpp"

#include <algorithm>
#include <array>

namespace hexopt::trimming {

namespace {

constexpr std::size_t kChunk = 256;
constexpr std::size_t kMostPieces = 64; ///< triangles of one cell; of more, evenly many are left out
/// Of a cell's side: where the surface lies in cells' sides, rounding leaves slivers of it in the cells
/// beside those, with any normal.
constexpr double kSliver = 1e-9;
constexpr double kSameSide = 0.5; ///< cosine between normals that count as one side of the surface

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

/// A side while pieces are added to it.
struct Sum {
    Point normal = Point(0); ///< sum of vector areas
    Point moment = Point(0); ///< sum of centroids by area
    double area = 0;
    Point at = Point(0); ///< centroid of the largest piece
    double largest = 0;
    Index patch = kNoIndex; ///< of that piece

    Point direction() const { return glm::normalize(normal); }
};

class SideSearch {
  public:
    SideSearch(const HexMesh& mesh, const SurfaceQueries& queries) : mesh_(mesh), queries_(queries) {}

    void append_sides(Index cell, std::vector<SurfaceSide>& found) {
        sums_.clear();
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
        for (const Sum& sum : sums_)
            found.push_back(
                {sum.direction(), sum.moment / sum.area, sum.at, sum.area, sum.patch, kUnknownThickness});
    }

  private:
    void add(const Piece& piece, double area) {
        Sum* sum = nullptr;
        for (Sum& s : sums_)
            if (glm::dot(s.direction(), piece.vector_area) > kSameSide * area) sum = &s;
        if (!sum) sum = &sums_.emplace_back();
        sum->normal += piece.vector_area;
        sum->moment += area * piece.centroid;
        sum->area += area;
        if (area > sum->largest) sum->largest = area, sum->at = piece.centroid, sum->patch = piece.patch;
    }

    const HexMesh& mesh_;
    const SurfaceQueries& queries_;
    std::vector<Index> triangles_;
    std::vector<Sum> sums_;
};

} // namespace

void find_surface_sides(const HexMesh& mesh, const CellSides& sides, std::span<const Index> key,
                        const SurfaceQueries& queries, const Parallel& parallel, SurfaceSides& known) {
    std::vector<Index> cells;
    for (Index c = 0; c < mesh.cell_count(); ++c)
        if (sides.cut[c] && !known.knows(key[c])) cells.push_back(c);
    std::vector<Csr<SurfaceSide>> parts((cells.size() + kChunk - 1) / kChunk);
    parallel.for_chunks(cells.size(), kChunk, [&](std::size_t begin, std::size_t end) {
        SideSearch search(mesh, queries);
        Csr<SurfaceSide>& part = parts[begin / kChunk];
        for (std::size_t i = begin; i < end; ++i) {
            search.append_sides(cells[i], part.item);
            part.offset.push_back(part.item.size());
        }
    });
    std::size_t count = 0;
    for (const auto& part : parts) count += part.item.size();
    known.reserve(cells.size(), count);
    for (std::size_t p = 0; p < parts.size(); ++p) {
        for (std::size_t i = 0; i < parts[p].rows(); ++i) known.add(key[cells[p * kChunk + i]], parts[p][i]);
        parts[p] = {};
    }
}

} // namespace hexopt::trimming
