#pragma once

#include "core/types.hpp"

#include <array>
#include <boost/multiprecision/cpp_int.hpp>
#include <span>
#include <vector>

namespace hexopt {

using Exact = boost::multiprecision::cpp_rational;

/// dot(normal, d) + offset > 0: a tetrahedron's determinant as a function of one vertex's displacement d.
struct ExactHalfSpace {
    std::array<Exact, 3> normal;
    Exact offset;
};

/// The determinant of edges from[i] -> to[i] that move by slope[i] * d.
ExactHalfSpace exact_half_space(const std::array<Point, 3>& from, const std::array<Point, 3>& to,
                                const std::array<double, 3>& slope);

/// True if the multipliers prove that no d lies strictly inside all half-spaces: non-negative, not all zero,
/// the weighted sum of the normals zero, that of the offsets not positive (Gordan, Motzkin).
bool proves_empty(std::span<const ExactHalfSpace> half_spaces, std::span<const Exact> multipliers);

/// Multipliers that prove that no d lies strictly inside all half-spaces; empty if some d does. At most 4 of
/// them are positive.
std::vector<Exact> find_emptiness_proof(std::span<const ExactHalfSpace> half_spaces);

} // namespace hexopt
