#include "stages/optimize/block_matrix.hpp"

#include "stages/optimize/hex_kernels.hpp"

#include <algorithm>
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

BlockMatrix::BlockMatrix(const Problem& problem) : problem_(&problem) {
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
    column_ = std::move(pattern.item);
    value_.resize(9 * column_.size());

    slot_.assign(36 * problem.cell_count(), kNoSlot);
    for (std::size_t c = 0; c < problem.cell_count(); ++c) {
        if (problem.cell_has_hanging(c)) continue;
        for (int i = 0; i < 8; ++i)
            for (int j = i; j < 8; ++j) {
                const Index a = problem.vertex_dof(problem.cells()[c][i]),
                            b = problem.vertex_dof(problem.cells()[c][j]);
                if (a == kNoIndex || b == kNoIndex) continue;
                const Index row = std::min(a, b);
                const std::size_t slot = find(row, std::max(a, b)) - offset_[row];
                slot_[36 * c + hessian_block(i, j)] =
                    slot < kFarSlot ? static_cast<std::uint8_t>(slot) : kFarSlot;
            }
    }
}

void BlockMatrix::set_zero() { std::fill(value_.begin(), value_.end(), 0.0f); }

std::size_t BlockMatrix::find(Index row, Index column) const {
    const auto begin = column_.begin() + static_cast<std::ptrdiff_t>(offset_[row]);
    const auto end = column_.begin() + static_cast<std::ptrdiff_t>(offset_[row + 1]);
    return static_cast<std::size_t>(std::lower_bound(begin, end, column) - column_.begin());
}

void BlockMatrix::add_cell(std::size_t cell, const float* block, std::size_t stride) {
    if (problem_->cell_has_hanging(cell)) return add_hanging_cell(cell, block, stride);
    const Cell& vertices = problem_->cells()[cell];
    Index dof[8];
    for (int k = 0; k < 8; ++k) dof[k] = problem_->vertex_dof(vertices[k]);
    const std::uint8_t* slot = &slot_[36 * cell];
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

void BlockMatrix::add_block(Index row, Index column, const float* block, std::size_t stride, float factor,
                            bool transposed) {
    float* to = &value_[9 * find(row, column)];
    for (std::size_t k = 0; k < 9; ++k)
        to[k] += factor * block[(transposed ? 3 * (k % 3) + k / 3 : k) * stride];
}

/// P^T H P: every corner's part goes to all masters of the corner.
void BlockMatrix::add_hanging_cell(std::size_t cell, const float* block, std::size_t stride) {
    const Cell& vertices = problem_->cells()[cell];
    for (int i = 0; i < 8; ++i)
        for (int j = i; j < 8; ++j) {
            const float* from = block + 9 * static_cast<std::size_t>(hessian_block(i, j)) * stride;
            for (DofShare a : problem_->shares(vertices[i]))
                for (DofShare b : problem_->shares(vertices[j])) {
                    const float factor = a.weight * b.weight;
                    if (a.dof <= b.dof) add_block(a.dof, b.dof, from, stride, factor, false);
                    if (i != j && b.dof <= a.dof) add_block(b.dof, a.dof, from, stride, factor, true);
                }
        }
}

void BlockMatrix::add_scaled_identity(Index row, Index column, float value) {
    float* to = &value_[9 * find(std::min(row, column), std::max(row, column))];
    for (int k = 0; k < 9; k += 4) to[k] += value;
}

void BlockMatrix::add_diagonal(Index row, const glm::dmat3& block) {
    float* to = &value_[9 * offset_[row]];
    for (int k = 0; k < 9; ++k) to[k] += static_cast<float>(block[k / 3][k % 3]);
}

void BlockMatrix::multiply(std::span<const glm::vec3> x, std::span<glm::vec3> y,
                           const Parallel& parallel) const {
    parallel.for_each(rows(), kVectorChunk, [&](std::size_t i) { y[i] = glm::vec3(0); });
    row_schedule_.run(parallel, [&](std::size_t begin, std::size_t end) {
        for (std::size_t row = begin; row < end; ++row) {
            const glm::vec3 xi = x[row];
            glm::vec3 sum(0);
            for (std::size_t k = offset_[row]; k < offset_[row + 1]; ++k) {
                const float* m = &value_[9 * k];
                const glm::vec3& xj = x[column_[k]];
                sum += glm::vec3(m[0] * xj.x + m[1] * xj.y + m[2] * xj.z,
                                 m[3] * xj.x + m[4] * xj.y + m[5] * xj.z,
                                 m[6] * xj.x + m[7] * xj.y + m[8] * xj.z);
                if (column_[k] == row) continue;
                y[column_[k]] += glm::vec3(m[0] * xi.x + m[3] * xi.y + m[6] * xi.z,
                                           m[1] * xi.x + m[4] * xi.y + m[7] * xi.z,
                                           m[2] * xi.x + m[5] * xi.y + m[8] * xi.z);
            }
            y[row] += sum;
        }
    });
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

/// Inverse of the diagonal block on the allowed space; what is not allowed is kept at the block's own scale.
glm::dmat3 inverse_diagonal(const float* m, const Freedom* freedom) {
    glm::dmat3 block(m[0], m[3], m[6], m[1], m[4], m[7], m[2], m[5], m[8]);
    const double scale = (block[0][0] + block[1][1] + block[2][2]) / 3;
    if (!(scale > 0)) return glm::dmat3(1);
    if (freedom && (freedom->kind == Freedom::plane || freedom->kind == Freedom::line)) {
        const Point d = freedom->direction;
        glm::dmat3 q = glm::outerProduct(d, d);
        if (freedom->kind == Freedom::plane) q = glm::dmat3(1) - q;
        block = q * block * q + scale * (glm::dmat3(1) - q);
    }
    for (int i = 0; i < 3; ++i) block[i][i] += 1e-6 * scale;
    return glm::inverse(block);
}

double dot(std::span<const glm::vec3> a, std::span<const glm::vec3> b, const Parallel& parallel) {
    return parallel.reduce(
        a.size(), kVectorChunk, 0.0,
        [&](std::size_t begin, std::size_t end) {
            double sum = 0;
            for (std::size_t i = begin; i < end; ++i) sum += glm::dot(glm::dvec3(a[i]), glm::dvec3(b[i]));
            return sum;
        },
        std::plus<>());
}

} // namespace

CgResult solve_cg(const BlockMatrix& matrix, std::span<const Point> b, std::span<const Freedom> freedom,
                  std::span<Point> x, double tolerance, int max_iterations, const Parallel& parallel) {
    const std::size_t n = matrix.rows();
    CgResult result;
    // Gradients differ in size by the scale of the model: single precision works on the right-hand side over
    // its largest entry.
    double scale = 0;
    for (const Point& p : b) scale = std::max({scale, std::abs(p.x), std::abs(p.y), std::abs(p.z)});
    std::fill(x.begin(), x.end(), Point(0));
    if (!(scale > 0) || !std::isfinite(scale)) return result;
    std::vector<glm::vec3> r(n), p(n), q(n);
    std::vector<glm::vec3>& z = q; // the preconditioned residual is needed only while A p is not
    std::vector<glm::mat3> inverse(n);
    const auto allowed = [&](std::size_t i, const glm::vec3& v) {
        return freedom.empty() ? v : glm::vec3(restrict_to(freedom[i], Point(v)));
    };
    parallel.for_each(n, 512, [&](std::size_t i) {
        inverse[i] = inverse_diagonal(matrix.diagonal(i), freedom.empty() ? nullptr : &freedom[i]);
        r[i] = allowed(i, glm::vec3(b[i] / scale));
    });
    const auto precondition = [&] {
        parallel.for_each(n, kVectorChunk, [&](std::size_t i) { z[i] = allowed(i, inverse[i] * r[i]); });
    };
    precondition();
    std::copy(z.begin(), z.end(), p.begin());
    double rz = dot(r, z, parallel);
    const double start = rz;
    while (result.iterations < max_iterations && rz > tolerance * start && rz > 0) {
        matrix.multiply(p, q, parallel);
        if (!freedom.empty())
            parallel.for_each(n, kVectorChunk, [&](std::size_t i) { q[i] = allowed(i, q[i]); });
        const double curvature = dot(p, q, parallel);
        if (!(curvature > 0)) break;
        const double alpha = rz / curvature;
        parallel.for_each(n, kVectorChunk, [&](std::size_t i) {
            x[i] += (alpha * scale) * Point(p[i]);
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
