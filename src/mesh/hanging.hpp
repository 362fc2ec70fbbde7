#pragma once

#include "core/parallel.hpp"
#include "core/result.hpp"
#include "mesh/hex_mesh.hpp"

#include <span>

namespace hexopt {

/// Appends the row x[vertex] = sum of weights[k] * x[masters[k]] to `rows`, which need not be sorted or
/// closed until close_hanging().
void append_row(Hanging& rows, Index vertex, std::span<const Index> masters, std::span<const double> weights);

/// Replaces masters that are hanging themselves by theirs, until none is left; sorts rows and masters, merges
/// repeated masters and drops zero weights. Weights that are multiples of 1/2^k stay exact. `rows` may come
/// in any order. Error (bad_input): a vertex with two rows, an id >= vertex_count, a row without masters, a
/// weight that is not finite, or vertices that depend on each other in a circle. Source: thesis 4.2.1.
Result<Hanging> close_hanging(const Hanging& rows, std::size_t vertex_count);

/// Where its masters put the vertex of a row.
Point hanging_position(const Hanging& hanging, const std::vector<Point>& positions, std::size_t row);

/// Moves every hanging vertex to where its masters put it.
void apply_hanging(const Hanging& hanging, std::vector<Point>& positions, const Parallel& parallel);
inline void apply_hanging(HexMesh& mesh, const Parallel& parallel) {
    apply_hanging(mesh.hanging, mesh.positions, parallel);
}

/// Largest distance of a hanging vertex from where its masters put it, model units; 0 if none hangs.
double max_hanging_deviation(const Hanging& hanging, const std::vector<Point>& positions);

/// Row in `hanging` of every vertex, kNoIndex where it does not hang; empty if none hangs.
std::vector<Index> compute_hanging_row(const Hanging& hanging, std::size_t vertex_count);

} // namespace hexopt
