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
    Csr<std::uint32_t> colours;        ///< dofs of each colour, rising; two conflict where a cell has both
};

DofBalls compute_dof_balls(const Problem& problem, const Parallel& parallel = Parallel(1));

/// How positions are kept on a device: (position - origin) / unit.
struct DeviceFrame {
    Point origin{0};
    double unit = 1;

    /// A unit of about the mesh's mean edge, a power of two, so that f64 loses nothing; with f32 relative to
    /// the middle of the positions.
    static DeviceFrame of(const HexMesh& mesh, std::span<const Point> positions,
                          compute::Precision precision);
    Point to_local(const Point& p) const { return (p - origin) / unit; }
    Point to_model(const Point& p) const { return origin + unit * p; }
};

/// Points, or vectors without a frame, in a backend's layout.
Result<compute::Buffer> upload_points(compute::Backend& backend, compute::Precision precision,
                                      std::span<const Point> local, std::string_view label);

/// A problem's data on a backend.
struct DeviceProblem {
    /// slides: per dof, what is left to DeviceSliders; empty: none.
    static Result<DeviceProblem> create(compute::Backend& backend, compute::Precision precision,
                                        const Problem& problem, const DeviceFrame& frame,
                                        std::span<const std::uint8_t> slides = {},
                                        const Parallel& parallel = Parallel(1));
    /// In the frame of the problem, with the positions uploaded.
    static Result<DeviceProblem> create(compute::Backend& backend, compute::Precision precision,
                                        const Problem& problem, std::span<const Point> positions) {
        auto made =
            create(backend, precision, problem, DeviceFrame::of(problem.mesh(), positions, precision));
        if (!made) return made;
        if (auto status = made->upload_positions(positions); !status) return status.error();
        return made;
    }

    Status upload_positions(std::span<const Point> positions);
    /// Overwrites the positions of dofs and of the vertices that hang on them.
    Status download_positions(std::span<Point> positions);

    /// Makes `stencil` and puts the dofs that have one first in their colour, where not done yet: only sweeps
    /// of Newton steps need that, and on a mesh of a million cells it takes a third of a second.
    Status find_regular_blocks();
    /// Makes `neighbour*`, where not done yet: only Laplacian passes need them.
    Status find_neighbours();

    /// Local points into a buffer.
    Status write_points(const compute::Buffer& target, std::span<const Point> local);

    std::size_t real_bytes() const { return precision == compute::Precision::f64 ? 8 : 4; }
    std::size_t point_bytes() const { return precision == compute::Precision::f32 ? 12 : 24; }
    Result<compute::Buffer> create_reals(std::size_t count, std::string_view label);
    Result<compute::Buffer> upload_reals(std::span<const double> values, std::string_view label);
    Result<std::vector<double>> read_reals(const compute::Buffer& buffer, std::size_t count);

    compute::Backend* backend = nullptr;
    compute::Precision precision = compute::Precision::f64;
    const Problem* problem = nullptr;
    DeviceFrame frame;
    std::uint32_t vertex_count = 0, cell_count = 0, dof_count = 0, hanging_count = 0;
    Csr<std::uint32_t> colours; ///< dofs of each colour: those that move freely, then those that slide
    std::vector<std::uint32_t> free_count; ///< of each colour
    /// Of each colour: its first row of `stencil`, and how many of the free dofs, those at the front, have
    /// one. Empty before find_regular_blocks().
    std::vector<std::uint32_t> regular_first, regular_count;

    compute::Buffer points, cells, cell_weight, edge_weight, tet_mask, length, inverse_length;
    compute::Buffer ball_offset, ball_item, pattern, dof_vertex, dof_list, stencil;
    compute::Buffer neighbour_offset, neighbour, neighbour_weight;
    compute::Buffer hanging_vertex, hanging_offset, hanging_master, hanging_weight;

  private:
    void put_sliders_last(std::span<const std::uint8_t> slides);
};

} // namespace hexopt
