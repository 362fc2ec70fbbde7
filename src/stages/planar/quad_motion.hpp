#pragma once

#include "core/csr.hpp"
#include "core/parallel.hpp"
#include "stages/planar/quad_mesh.hpp"

#include <array>

namespace hexopt {

/// How quads are judged while they are moved: shape energy to the power p over their corners, the barrier
/// regularised by epsilon (Garanzha et al. 2021).
struct QuadEnergy {
    double epsilon = 1e-6; ///< in units of the cell's area
    int power = 1;         ///< at least 1
};

/// Moves single vertices of a planar mesh: free ones anywhere, those on outlines along them, corners not.
/// Hanging vertices follow. Vertices of one colour may be moved concurrently.
class QuadMotion {
  public:
    QuadMotion(QuadMesh& mesh, const OutlineCurves& curves);

    const Csr<Index>& colours() const { return colours_; }
    /// Quads that depend on a vertex, also through vertices that hang on it.
    std::span<const Index> quads(Index v) const { return vertex_quad_[v]; }
    bool is_movable(Index v) const { return movable_[v] != 0; }
    /// Smallest determinant of a corner, in units of the cell's area.
    double smallest_determinant(const Parallel& parallel) const;

    /// One damped Newton step; returns how far the vertex went, in cell sizes.
    double improve(Index v, const QuadEnergy& energy);
    /// Tries places around the vertex and takes the one that raises the least scaled Jacobian of its quads
    /// most; returns how far the vertex went, in cell sizes.
    double raise_worst(Index v);

  private:
    struct Derivatives {
        double value = 0;
        Point2 gradient = Point2(0);
        double xx = 0, xy = 0, yy = 0;
    };
    void find_quads();
    void find_colours();
    std::array<double, 4> weights(Index v, const Quad& quad) const;
    double weight(Index v, Index of) const;
    double cell_size(Index v) const { return mesh_.size[quads(v).front()]; }
    void add_quad(Index v, Index quad, const QuadEnergy& energy, Derivatives& sum) const;
    double value(Index v, const QuadEnergy& energy) const;
    double least_scaled_jacobian(Index v) const;
    void place(Index v, const Point2& p);
    void slide(Index v, double s);
    /// s brought to where it keeps its distance from the neighbours on the outline.
    double clamp(Index v, double s) const;
    double improve_free(Index v, const QuadEnergy& energy);
    double improve_sliding(Index v, const QuadEnergy& energy);

    QuadMesh& mesh_;
    const OutlineCurves& curves_;
    Csr<Index> vertex_quad_;
    Csr<Index> hanging_on_;                    ///< per vertex: rows of mesh.hanging with it as a master
    std::vector<Index> row_;                   ///< per vertex: its row in mesh.hanging
    std::vector<std::array<Index, 2>> beside_; ///< per vertex on an outline: those before and after it
    std::vector<std::uint8_t> movable_;
    Csr<Index> colours_;
};

} // namespace hexopt
