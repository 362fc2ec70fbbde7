#pragma once

#include "stages/optimize/chunk_schedule.hpp"
#include "stages/optimize/problem.hpp"

#include <glm/mat3x3.hpp>
#include <limits>

namespace hexopt {

/// Symmetric matrix of 3x3 blocks over the dofs of a Problem: the upper triangle, in float.
class BlockMatrix {
  public:
    /// widest: largest distance between row and column that is kept in 16 bits; less only in tests.
    explicit BlockMatrix(const Problem& problem, Index widest = std::numeric_limits<std::uint16_t>::max());

    std::size_t rows() const { return offset_.size() - 1; }
    void set_zero();

    /// Adds an upper-triangle hexahedron matrix (HexHessian layout: element k of block b at block[(9 b + k) *
    /// stride]) of cell `cell` of the problem. Concurrent calls for cells of one chunk colour are safe.
    void add_cell(std::size_t cell, const float* block, std::size_t stride);
    /// Adds value * I at (row, column) and its transpose place.
    void add_scaled_identity(Index row, Index column, float value);

    /// Adds a symmetric block to the diagonal of a row.
    void add_diagonal(Index row, const glm::dmat3& block);

    /// Three numbers of a row and one without meaning, which must be finite.
    using Float4 = float __attribute__((vector_size(16)));

    /// y = A x.
    void multiply(std::span<const Float4> x, std::span<Float4> y, const Parallel& parallel) const;

    /// The diagonal block of a row, row by row.
    const float* diagonal(std::size_t row) const { return &value_[9 * offset_[row]]; }

  private:
    void keep_columns(std::vector<Index> column, Index widest);
    std::size_t find(Index row, Index column) const;
    template <class Column>
    void multiply(const Column* column, std::span<const Float4> x, std::span<Float4> y,
                  const Parallel& parallel) const;
    std::uint8_t find_slot(Index a, Index b) const;
    template <class Visit>
    void visit_shares(std::size_t cell, const Visit& visit) const;
    std::size_t count_slots() const;
    void find_slots();
    void add_hanging_cell(std::size_t cell, const float* block, std::size_t stride);

    const Problem* problem_;
    std::vector<std::size_t> offset_; ///< per row; the diagonal comes first, columns rise
    /// Of each block, less its row: in 16 bits where all fit, else in 32.
    std::vector<std::uint16_t> near_column_;
    std::vector<Index> far_column_;
    std::vector<float> value_; ///< 9 a block, row by row, and one more at the end
    /// Place of a block within its row: 36 a cell, kNoSlot if a block has none; of a cell with hanging
    /// corners one for each of visit_shares().
    std::vector<std::uint8_t> slot_;
    std::vector<std::uint32_t> slot_begin_; ///< per cell; empty: 36 times the cell
    ChunkSchedule row_schedule_;
};

/// What a dof may do: move freely, within a plane, along a line, or not at all.
struct Freedom {
    enum Kind : std::uint8_t { free, plane, line, none } kind = free;
    Point direction{0}; ///< unit normal of the plane or unit tangent of the line
};

/// Dofs that need not be free, rising, and their freedoms; the others are.
struct HeldDofs {
    std::span<const Index> dof;
    std::span<const Freedom> freedom;
};

/// v restricted to the freedom.
Point restrict_to(const Freedom& freedom, const Point& v);

struct CgResult {
    int iterations = 0;
};

/// Solves A x = b on the space that `held` allows by conjugate gradients with a
/// block-Jacobi preconditioner, from x = 0, until the preconditioned |r|^2 has fallen by tolerance or
/// max_iterations are done.
CgResult solve_cg(const BlockMatrix& matrix, std::span<const Point> b, const HeldDofs& held,
                  std::span<Point> x, double tolerance, int max_iterations, const Parallel& parallel);

} // namespace hexopt
