#include "stages/optimize/block_matrix.hpp"

#include "stages/optimize/hex_kernels.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/mat3x3.hpp>
#include <glm/matrix.hpp>

namespace hexopt {

namespace {

constexpr std::uint8_t kNoSlot = 0xFF;  ///< the block belongs to no dof
constexpr std::uint8_t kFarSlot = 0xFE; ///< too far along its row for a byte: searched for
constexpr std::size_t kRowChunk = 256;
constexpr std::size_t kVectorChunk = 4096;

Csr<Index> cells_of_dofs(const Problem& problem) {
    Csr<Index> result;
    result.offset.assign(problem.dof_count() + 1, 0);
    for (Index dof : problem.cell_dof().item) ++result.offset[dof + 1];
    for (std::size_t d = 0; d < problem.dof_count(); ++d) result.offset[d + 1] += result.offset[d];
    result.item.resize(result.offset.back());
    std::vector<std::size_t> next(result.offset.begin(), result.offset.end() - 1);
    for (Index c = 0; c < problem.cell_count(); ++c)
        for (Index dof : problem.cell_dof()[c]) result.item[next[dof]++] = c;
    return result;
}

} // namespace

BlockMatrix::BlockMatrix(const Problem& problem, Index widest) : problem_(&problem) {
    const Csr<Index> dof_cell = cells_of_dofs(problem);
    Csr<Index> pattern;
    std::vector<Index> last(problem.dof_count(), kNoIndex);
    for (Index row = 0; row < problem.dof_count(); ++row) {
        const std::size_t begin = pattern.item.size();
        for (Index c : dof_cell[row])
            for (Index column : problem.cell_dof()[c])
                if (column >= row && last[column] != row) {
                    last[column] = row;
                    pattern.item.push_back(column);
                }
        std::sort(pattern.item.begin() + static_cast<std::ptrdiff_t>(begin), pattern.item.end());
        pattern.offset.push_back(pattern.item.size());
    }
    row_schedule_ = ChunkSchedule(pattern, problem.dof_count(), kRowChunk);
    offset_ = std::move(pattern.offset);
    keep_columns(std::move(pattern.item), widest);
    value_.resize(9 * offset_.back() + 1);

    find_slots();
}

void BlockMatrix::keep_columns(std::vector<Index> column, Index widest) {
    Index farthest = 0;
    for (std::size_t row = 0; row < rows(); ++row)
        for (std::size_t k = offset_[row]; k < offset_[row + 1]; ++k)
            farthest = std::max(farthest, column[k] -= static_cast<Index>(row));
    if (farthest <= widest) {
        near_column_.assign(column.begin(), column.end());
    } else {
        far_column_ = std::move(column);
        far_column_.shrink_to_fit();
    }
}

/// Calls visit(i, j, a, b) for what corners i <= j of a cell give to dofs a and b.
template <class Visit>
void BlockMatrix::visit_shares(std::size_t cell, const Visit& visit) const {
    std::span<const DofShare> shares[8];
    for (int k = 0; k < 8; ++k) shares[k] = problem_->shares(problem_->cell(cell)[k]);
    for (int i = 0; i < 8; ++i)
        for (int j = i; j < 8; ++j)
            for (DofShare a : shares[i])
                for (DofShare b : shares[j])
                    if (i != j || a.dof <= b.dof) visit(i, j, a, b);
}

std::size_t BlockMatrix::count_slots() const {
    const Problem& problem = *problem_;
    if (!problem.has_hanging()) return 36 * problem.cell_count();
    std::size_t count = 0;
    for (std::size_t c = 0; c < problem.cell_count(); ++c)
        if (problem.cell_has_hanging(c))
            visit_shares(c, [&](int, int, DofShare, DofShare) { ++count; });
        else
            count += 36;
    return count;
}

void BlockMatrix::find_slots() {
    const Problem& problem = *problem_;
    if (problem.has_hanging()) slot_begin_.reserve(problem.cell_count());
    slot_.reserve(count_slots());
    for (std::size_t c = 0; c < problem.cell_count(); ++c) {
        if (problem.has_hanging()) slot_begin_.push_back(static_cast<std::uint32_t>(slot_.size()));
        if (problem.cell_has_hanging(c)) {
            visit_shares(c,
                         [&](int, int, DofShare a, DofShare b) { slot_.push_back(find_slot(a.dof, b.dof)); });
            continue;
        }
        const std::size_t begin = slot_.size();
        slot_.resize(begin + 36, kNoSlot);
        for (int i = 0; i < 8; ++i)
            for (int j = i; j < 8; ++j) {
                const Index a = problem.vertex_dof(problem.cell(c)[i]),
                            b = problem.vertex_dof(problem.cell(c)[j]);
                if (a != kNoIndex && b != kNoIndex)
                    slot_[begin + static_cast<std::size_t>(hessian_block(i, j))] = find_slot(a, b);
            }
    }
}

std::uint8_t BlockMatrix::find_slot(Index a, Index b) const {
    const Index row = std::min(a, b);
    const std::size_t slot = find(row, std::max(a, b)) - offset_[row];
    return slot < kFarSlot ? static_cast<std::uint8_t>(slot) : kFarSlot;
}

void BlockMatrix::set_zero() { std::fill(value_.begin(), value_.end(), 0.0f); }

std::size_t BlockMatrix::find(Index row, Index column) const {
    const auto find_in = [&](const auto& columns) {
        const auto begin = columns.begin() + static_cast<std::ptrdiff_t>(offset_[row]);
        const auto end = columns.begin() + static_cast<std::ptrdiff_t>(offset_[row + 1]);
        return static_cast<std::size_t>(std::lower_bound(begin, end, column - row) - columns.begin());
    };
    return far_column_.empty() ? find_in(near_column_) : find_in(far_column_);
}

void BlockMatrix::add_cell(std::size_t cell, const float* block, std::size_t stride) {
    if (problem_->cell_has_hanging(cell)) return add_hanging_cell(cell, block, stride);
    const Cell& vertices = problem_->cell(cell);
    Index dof[8];
    for (int k = 0; k < 8; ++k) dof[k] = problem_->vertex_dof(vertices[k]);
    const std::uint8_t* slot = &slot_[slot_begin_.empty() ? 36 * cell : slot_begin_[cell]];
    for (int i = 0; i < 8; ++i)
        for (int j = i; j < 8; ++j) {
            const int b = hessian_block(i, j);
            if (slot[b] == kNoSlot) continue;
            const Index row = std::min(dof[i], dof[j]);
            const std::size_t place =
                slot[b] == kFarSlot ? find(row, std::max(dof[i], dof[j])) : offset_[row] + slot[b];
            float* to = &value_[9 * place];
            const float* from = block + 9 * static_cast<std::size_t>(b) * stride;
            if (dof[i] <= dof[j])
                for (std::size_t k = 0; k < 9; ++k) to[k] += from[k * stride];
            else
                for (std::size_t k = 0; k < 9; ++k) to[k] += from[(3 * (k % 3) + k / 3) * stride];
        }
}

namespace {

using Float4 = BlockMatrix::Float4;

Float4 load4(const float* from) {
    Float4 r;
    __builtin_memcpy(&r, from, sizeof r);
    return r;
}

Float4 splat(float value) { return Float4{} + value; }

/// Adds factor times nine numbers.
void add9(float* to, const float* from, float factor) {
    for (int k = 0; k < 8; k += 4) {
        const Float4 sum = load4(to + k) + factor * load4(from + k);
        __builtin_memcpy(to + k, &sum, sizeof sum);
    }
    to[8] += factor * from[8];
}

float sum3(const Float4& v) { return v[0] + v[1] + v[2]; }

} // namespace

/// P^T H P: every corner's part goes to all masters of the corner.
void BlockMatrix::add_hanging_cell(std::size_t cell, const float* block, std::size_t stride) {
    // Each block is used for many pairs of masters: side by side and transposed.
    constexpr std::size_t kBlocks = 36;
    float straight[kBlocks][9], transposed[kBlocks][9];
    for (std::size_t b = 0; b < kBlocks; ++b)
        for (std::size_t k = 0; k < 9; ++k)
            straight[b][k] = transposed[b][3 * (k % 3) + k / 3] = block[(9 * b + k) * stride];
    const std::uint8_t* slot = &slot_[slot_begin_[cell]];
    visit_shares(cell, [&](int i, int j, DofShare a, DofShare b) {
        const auto number = static_cast<std::size_t>(hessian_block(i, j));
        const Index row = std::min(a.dof, b.dof);
        const std::size_t place =
            *slot == kFarSlot ? find(row, std::max(a.dof, b.dof)) : offset_[row] + *slot;
        ++slot;
        float* to = &value_[9 * place];
        const float factor = a.weight * b.weight;
        if (a.dof <= b.dof) add9(to, straight[number], factor);
        if (i != j && b.dof <= a.dof) add9(to, transposed[number], factor);
    });
}

void BlockMatrix::add_scaled_identity(Index row, Index column, float value) {
    float* to = &value_[9 * find(std::min(row, column), std::max(row, column))];
    for (int k = 0; k < 9; k += 4) to[k] += value;
}

void BlockMatrix::add_diagonal(Index row, const glm::dmat3& block) {
    float* to = &value_[9 * offset_[row]];
    for (int k = 0; k < 9; ++k) to[k] += static_cast<float>(block[k / 3][k % 3]);
}

/// Rows of blocks are loaded four numbers at a time; the fourth belongs to the next row and ends up in a lane
/// that nobody reads.
template <class Column>
void BlockMatrix::multiply(const Column* column, std::span<const Float4> x, std::span<Float4> y,
                           const Parallel& parallel) const {
    parallel.for_each(rows(), kVectorChunk, [&](std::size_t i) { y[i] = Float4{}; });
    row_schedule_.run(parallel, [&](std::size_t begin, std::size_t end) {
        for (std::size_t row = begin; row < end; ++row) {
            const Float4 x0 = splat(x[row][0]), x1 = splat(x[row][1]), x2 = splat(x[row][2]);
            const float* m = &value_[9 * offset_[row]];
            Float4 sum0 = load4(m) * x[row], sum1 = load4(m + 3) * x[row], sum2 = load4(m + 6) * x[row];
            for (std::size_t k = offset_[row] + 1; k < offset_[row + 1]; ++k) {
                m += 9;
                const std::size_t j = row + column[k];
                const Float4 m0 = load4(m), m1 = load4(m + 3), m2 = load4(m + 6), xj = x[j];
                sum0 += m0 * xj;
                sum1 += m1 * xj;
                sum2 += m2 * xj;
                y[j] += m0 * x0 + m1 * x1 + m2 * x2;
            }
            y[row] += Float4{sum3(sum0), sum3(sum1), sum3(sum2), 0};
        }
    });
}

void BlockMatrix::multiply(std::span<const Float4> x, std::span<Float4> y, const Parallel& parallel) const {
    if (far_column_.empty())
        multiply(near_column_.data(), x, y, parallel);
    else
        multiply(far_column_.data(), x, y, parallel);
}

Point restrict_to(const Freedom& freedom, const Point& v) {
    switch (freedom.kind) {
    case Freedom::plane:
        return v - glm::dot(v, freedom.direction) * freedom.direction;
    case Freedom::line:
        return glm::dot(v, freedom.direction) * freedom.direction;
    case Freedom::none:
        return Point(0);
    case Freedom::free:
        break;
    }
    return v;
}

namespace {

/// Upper triangle of a symmetric 3x3 block, row by row.
using Symmetric = std::array<float, 6>;

/// Inverse of the diagonal block on the allowed space; what is not allowed is kept at the block's own scale.
Symmetric inverse_diagonal(const float* m, const Freedom* freedom) {
    // Sums in single precision are symmetric but for rounding, which the inverse of a stiff block magnifies.
    const double xy = 0.5 * (double{m[1]} + m[3]), xz = 0.5 * (double{m[2]} + m[6]),
                 yz = 0.5 * (double{m[5]} + m[7]);
    glm::dmat3 block(m[0], xy, xz, xy, m[4], yz, xz, yz, m[8]);
    const double scale = (block[0][0] + block[1][1] + block[2][2]) / 3;
    if (!(scale > 0)) return {1, 0, 0, 1, 0, 1};
    if (freedom && (freedom->kind == Freedom::plane || freedom->kind == Freedom::line)) {
        const Point d = freedom->direction;
        glm::dmat3 q = glm::outerProduct(d, d);
        if (freedom->kind == Freedom::plane) q = glm::dmat3(1) - q;
        block = q * block * q + scale * (glm::dmat3(1) - q);
    }
    for (int i = 0; i < 3; ++i) block[i][i] += 1e-6 * scale;
    const glm::mat3 inverse(glm::inverse(block));
    return {inverse[0][0], inverse[1][0], inverse[2][0], inverse[1][1], inverse[2][1], inverse[2][2]};
}

Float4 times(const Symmetric& m, const Float4& v) {
    return Float4{m[0] * v[0] + m[1] * v[1] + m[2] * v[2], m[1] * v[0] + m[3] * v[1] + m[4] * v[2],
                  m[2] * v[0] + m[4] * v[1] + m[5] * v[2], 0};
}

double dot(std::span<const Float4> a, std::span<const Float4> b, const Parallel& parallel) {
    return parallel.reduce(
        a.size(), kVectorChunk, 0.0,
        [&](std::size_t begin, std::size_t end) {
            double sum = 0;
            for (std::size_t i = begin; i < end; ++i)
                for (int axis = 0; axis < 3; ++axis)
                    sum += static_cast<double>(a[i][axis]) * static_cast<double>(b[i][axis]);
            return sum;
        },
        std::plus<>());
}

Float4 to_float4(const Point& p) {
    return Float4{static_cast<float>(p.x), static_cast<float>(p.y), static_cast<float>(p.z), 0};
}

Float4 allowed(const Freedom* freedom, const Float4& v) {
    if (!freedom || freedom->kind == Freedom::free) return v;
    return to_float4(restrict_to(*freedom, Point(v[0], v[1], v[2])));
}

/// Calls body(dof, freedom), freedom null where the dof is not held.
template <class Body>
void for_each_dof(std::size_t dofs, std::size_t chunk, const HeldDofs& held, const Parallel& parallel,
                  const Body& body) {
    parallel.for_chunks(dofs, chunk, [&](std::size_t begin, std::size_t end) {
        const auto first = std::lower_bound(held.dof.begin(), held.dof.end(), begin);
        auto k = static_cast<std::size_t>(first - held.dof.begin());
        for (std::size_t i = begin; i < end; ++i)
            body(i, k < held.dof.size() && held.dof[k] == i ? &held.freedom[k++] : nullptr);
    });
}

} // namespace

CgResult solve_cg(const BlockMatrix& matrix, std::span<const Point> b, const HeldDofs& held,
                  std::span<Point> x, double tolerance, int max_iterations, const Parallel& parallel) {
    const std::size_t n = matrix.rows();
    CgResult result;
    // Gradients differ in size by the scale of the model: single precision works on the right-hand side over
    // its largest entry.
    double scale = 0;
    for (const Point& p : b) scale = std::max({scale, std::abs(p.x), std::abs(p.y), std::abs(p.z)});
    std::fill(x.begin(), x.end(), Point(0));
    if (!(scale > 0) || !std::isfinite(scale)) return result;
    std::vector<Float4> r(n), p(n), q(n);
    std::vector<Float4>& z = q; // the preconditioned residual is needed only while A p is not
    std::vector<Symmetric> inverse(n);
    for_each_dof(n, 512, held, parallel, [&](std::size_t i, const Freedom* freedom) {
        inverse[i] = inverse_diagonal(matrix.diagonal(i), freedom);
        r[i] = allowed(freedom, to_float4(b[i] / scale));
    });
    const auto precondition = [&] {
        for_each_dof(n, kVectorChunk, held, parallel, [&](std::size_t i, const Freedom* freedom) {
            z[i] = allowed(freedom, times(inverse[i], r[i]));
        });
    };
    precondition();
    std::copy(z.begin(), z.end(), p.begin());
    double rz = dot(r, z, parallel);
    const double start = rz;
    while (result.iterations < max_iterations && rz > tolerance * start && rz > 0) {
        matrix.multiply(p, q, parallel);
        parallel.for_each(held.dof.size(), kVectorChunk,
                          [&](std::size_t k) { q[held.dof[k]] = allowed(&held.freedom[k], q[held.dof[k]]); });
        const double curvature = dot(p, q, parallel);
        if (!(curvature > 0)) break;
        const double alpha = rz / curvature;
        parallel.for_each(n, kVectorChunk, [&](std::size_t i) {
            x[i] += (alpha * scale) * Point(p[i][0], p[i][1], p[i][2]);
            r[i] -= static_cast<float>(alpha) * q[i];
        });
        precondition();
        const double next = dot(r, z, parallel);
        const auto beta = static_cast<float>(next / rz);
        rz = next;
        parallel.for_each(n, kVectorChunk, [&](std::size_t i) { p[i] = z[i] + beta * p[i]; });
        ++result.iterations;
    }
    return result;
}

} // namespace hexopt
