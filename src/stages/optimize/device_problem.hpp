#pragma once

#include "compute/backend.hpp"
#include "stages/optimize/problem.hpp"

namespace hexopt {

/// Ball of every dof of a problem and classes of dofs that may move together, in the kernels' layout (struct
/// Ball in shaders/dialect/kernel_hex.glsl).
struct DofBalls {
    std::vector<std::uint32_t> offset; ///< dof -> first entry
    std::vector<std::uint32_t> item;   ///< 2 an entry: cell of the problem, row of pattern
    std::vector<double> pattern;       ///< 8 a row: share of the dof's displacement that each corner makes
    Csr<std::uint32_t> colours;        ///< dofs of each colour, rising
    std::vector<std::uint32_t> neighbour_offset; ///< dof -> first neighbour
    std::vector<std::uint32_t> neighbour;        ///< vertices joined to the dof's by an edge, rising
};

DofBalls compute_dof_balls(const Problem& problem);

/// A problem's data on a backend. Positions are kept in a unit of about the mean edge, a power of two, so
/// that f64 loses nothing; with f32 also relative to the middle of the mesh.
struct DeviceProblem {
    static Result<DeviceProblem> create(compute::Backend& backend, compute::Precision precision,
                                        const Problem& problem, std::span<const Point> positions);

    Status upload_positions(std::span<const Point> positions);
    /// Overwrites the positions of dofs and of the vertices that hang on them.
    Status download_positions(std::span<Point> positions);

    std::size_t real_bytes() const { return precision == compute::Precision::f64 ? 8 : 4; }
    std::size_t point_bytes() const { return precision == compute::Precision::f32 ? 12 : 24; }
    Result<compute::Buffer> create_reals(std::size_t count, std::string_view label);
    Result<compute::Buffer> upload_reals(std::span<const double> values, std::string_view label);
    Result<std::vector<double>> read_reals(const compute::Buffer& buffer, std::size_t count);

    compute::Backend* backend = nullptr;
    compute::Precision precision = compute::Precision::f64;
    const Problem* problem = nullptr;
    Point origin{0};
    double unit = 1;
    std::uint32_t vertex_count = 0, cell_count = 0, dof_count = 0, hanging_count = 0;
    Csr<std::uint32_t> colours;

    compute::Buffer points, cells, cell_weight, edge_weight, tet_mask, length, inverse_length;
    compute::Buffer ball_offset, ball_item, pattern, dof_vertex, dof_list;
    compute::Buffer neighbour_offset, neighbour, neighbour_weight;
    compute::Buffer hanging_vertex, hanging_offset, hanging_master, hanging_weight;
};

} // namespace hexopt
