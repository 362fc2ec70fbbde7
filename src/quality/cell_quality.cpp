#include "quality/cell_quality.hpp"

#include "quality/exact_sign.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace hexopt {

namespace {

using Edges = std::array<hex::Vector<double>, 12>;

// Shewchuk's bound for the determinant of three differences is (7 + 56 u) u times the sum of the magnitudes
// of its products, u = 2^-53.
constexpr double kDeterminantError = 8 * 0x1p-53;

// Products of three edges neither overflow nor lose digits to underflow between these lengths.
constexpr double kSmallestPlainEdge = 0x1p-250, kLargestPlainCoordinate = 0x1p+250;

/// True for cells whose coordinates are finite and that normalise() leaves as they are: all but extreme ones.
bool is_plain(const HexPoints& points) {
    Point squares(0);
    for (const Point& p : points) squares += p * p;
    const Point diagonal = points[6] - points[0];
    return squares.x + squares.y + squares.z < kLargestPlainCoordinate * kLargestPlainCoordinate &&
           diagonal.x * diagonal.x + diagonal.y * diagonal.y + diagonal.z * diagonal.z >
               4 * kSmallestPlainEdge * kSmallestPlainEdge;
}

bool all_finite(const HexPoints& points) {
    double sum = 0;
    for (const Point& p : points) sum += p.x * 0 + p.y * 0 + p.z * 0;
    return sum == 0;
}

double largest_coordinate(const HexPoints& points) {
    double largest = 0;
    for (const Point& p : points) largest = std::max({largest, std::abs(p.x), std::abs(p.y), std::abs(p.z)});
    return largest;
}

/// Brings a cell of extreme size to plain numbers by a power of two, which is returned: points = result *
/// 2^exponent. Does nothing (0) to the usual cell.
int normalise(HexPoints& points) {
    if (is_plain(points)) return 0;
    double largest = largest_coordinate(points);
    const auto extent_of = [&] {
        double extent = 0;
        for (int k = 1; k < 8; ++k)
            for (int i = 0; i < 3; ++i) extent = std::max(extent, std::abs(points[k][i] - points[0][i]));
        return extent;
    };
    int exponent = 0;
    const auto scale_to_one = [&](double size) {
        const int shift = std::ilogb(size);
        for (Point& p : points)
            for (int i = 0; i < 3; ++i) p[i] = std::ldexp(p[i], -shift);
        exponent += shift;
    };
    if (largest > kLargestPlainCoordinate) scale_to_one(largest);
    const double extent = extent_of();
    if (extent > 0 && extent < kSmallestPlainEdge) scale_to_one(extent);
    return exponent;
}

int exact_sign_of_tet(const HexPoints& points, int tet) {
    std::array<Segment, 3> segment;
    for (int i = 0; i < 3; ++i) {
        const auto& ends = hex::kEdgeVertex[hex::kTetEdge[tet][i]];
        segment[i] = {points[ends[0]], points[ends[1]]};
    }
    return exact_sign_of_determinant(segment[0], segment[1], segment[2]);
}

/// Sum of the magnitudes of the determinant's six products.
double permanent_of_tet(const Edges& edge, int tet) {
    hex::Vector<double> v[3];
    for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j) v[i][j] = std::abs(edge[hex::kTetEdge[tet][i]][j]);
    double permanent = 0;
    for (int i = 0; i < 3; ++i) {
        const int j = (i + 1) % 3, k = (i + 2) % 3;
        permanent += v[0][i] * (v[1][j] * v[2][k] + v[1][k] * v[2][j]);
    }
    return permanent;
}

bool is_positive_tet(const HexPoints& points, const Edges& edge, int tet, double determinant, double scale) {
    if (determinant > kDeterminantError * scale) return true;
    const double bound = kDeterminantError * permanent_of_tet(edge, tet);
    if (std::abs(determinant) > bound) return determinant > 0;
    return exact_sign_of_tet(points, tet) > 0;
}

std::array<double, 12> lengths_of(const Edges& edge) {
    std::array<double, 12> length;
    for (int e = 0; e < 12; ++e) length[e] = std::sqrt(hex::dot(edge[e], edge[e]));
    return length;
}

CellValidity validity_of(const HexPoints& points, const Edges& edge, const std::array<double, 12>& length,
                         const hex::Determinants<double>& det, const hex::Bernstein<double>& bernstein) {
    const double scale = hex::determinant_scale(edge);
    CellValidity result;
    result.is_finite = true;
    result.scaled_jacobian = 1;
    result.concave8 = result.concave24 = 0;
    for (int tet = 0; tet < 32; ++tet) {
        const double determinant = det[hex::determinant_of_tet(tet)];
        const bool positive = is_positive_tet(points, edge, tet, determinant, scale);
        const bool at_corner = tet % 4 == 0;
        (at_corner ? result.concave8 : result.concave24) += !positive;
        if (!at_corner) continue;
        const auto& e = hex::kTetEdge[tet];
        const double product = length[e[0]] * length[e[1]] * length[e[2]];
        double jacobian = product > 0 ? determinant / product : 0;
        if (!positive) jacobian = std::min(jacobian, 0.0);
        result.scaled_jacobian = std::min(result.scaled_jacobian, jacobian);
    }
    result.scaled_jacobian = std::max(result.scaled_jacobian, -1.0);
    result.validity = certify(points, bernstein, scale);
    return result;
}

double degrees(double cosine) {
    return std::acos(std::clamp(cosine, -1.0, 1.0)) * (180 / 3.14159265358979323846);
}

std::array<double, 24> angles_of(const Edges& edge) {
    std::array<double, 24> angle;
    for (int k = 0; k < 8; ++k) {
        const int x = hex::kVertexX[k], y = hex::kVertexY[k], z = hex::kVertexZ[k];
        const auto &u = edge[y + 2 * z], &v = edge[4 + x + 2 * z], &w = edge[8 + x + 2 * y];
        const hex::Vector<double> normal[3] = {hex::cross(v, w), hex::cross(w, u), hex::cross(u, v)};
        double length[3];
        for (int d = 0; d < 3; ++d) length[d] = std::sqrt(hex::dot(normal[d], normal[d]));
        // Edges count from the low to the high end: at the high end they point the other way.
        const bool flipped[3] = {x == 1, y == 1, z == 1};
        for (int d = 0; d < 3; ++d) {
            const int i = (d + 1) % 3, j = (d + 2) % 3;
            const double product = length[i] * length[j];
            const double dot = hex::dot(normal[i], normal[j]);
            angle[3 * k + d] = product > 0 ? degrees((flipped[i] == flipped[j] ? -dot : dot) / product) : 0;
        }
    }
    return angle;
}

} // namespace

double CellQuality::aspect_ratio() const {
    return min_edge > 0 ? max_edge / min_edge : std::numeric_limits<double>::infinity();
}

std::array<double, 24> dihedral_angles(const HexPoints& points) {
    HexPoints plain = points;
    normalise(plain);
    return angles_of(hex::edge_vectors<double>(plain));
}

std::array<double, 12> edge_lengths(const HexPoints& points) {
    HexPoints plain = points;
    const int exponent = normalise(plain);
    std::array<double, 12> length = lengths_of(hex::edge_vectors<double>(plain));
    for (double& l : length) l = std::ldexp(l, exponent);
    return length;
}

double scaled_jacobian(const HexPoints& points) {
    if (!is_plain(points) && !all_finite(points)) return -1;
    HexPoints plain = points;
    normalise(plain);
    const Edges edge = hex::edge_vectors<double>(plain);
    const std::array<double, 12> length = lengths_of(edge);
    double least = 1;
    for (int k = 0; k < 8; ++k) {
        const int x = hex::kVertexX[k], y = hex::kVertexY[k], z = hex::kVertexZ[k];
        const int e[3] = {y + 2 * z, 4 + x + 2 * z, 8 + x + 2 * y};
        const double determinant = hex::dot(edge[e[0]], hex::cross(edge[e[1]], edge[e[2]]));
        const double product = length[e[0]] * length[e[1]] * length[e[2]];
        least = std::min(least, product > 0 ? determinant / product : 0);
    }
    return std::max(least, -1.0);
}

CellValidity compute_cell_validity(const HexPoints& points) {
    if (!is_plain(points) && !all_finite(points)) return {};
    HexPoints plain = points;
    normalise(plain);
    const Edges edge = hex::edge_vectors<double>(plain);
    const hex::Determinants<double> det = hex::determinants(edge);
    return validity_of(plain, edge, lengths_of(edge), det, hex::bernstein_coefficients(det));
}

CellQuality compute_cell_quality(const HexPoints& points, CellDetails* details) {
    CellQuality quality;
    if (!is_plain(points) && !all_finite(points)) {
        if (details) *details = {};
        return quality;
    }
    HexPoints plain = points;
    const int exponent = normalise(plain);
    const Edges edge = hex::edge_vectors<double>(plain);
    std::array<double, 12> length = lengths_of(edge);
    const hex::Determinants<double> det = hex::determinants(edge);
    const hex::Bernstein<double> bernstein = hex::bernstein_coefficients(det);
    quality.validity = validity_of(plain, edge, length, det, bernstein);

    double sum = 0;
    for (double coefficient : bernstein) sum += coefficient;
    quality.volume = std::ldexp(sum / 27, 3 * exponent);
    if (exponent != 0)
        for (double& l : length) l = std::ldexp(l, exponent);
    const auto [shortest, longest] = std::minmax_element(length.begin(), length.end());
    quality.min_edge = *shortest;
    quality.max_edge = *longest;
    const std::array<double, 24> angle = angles_of(edge);
    const auto [least, most] = std::minmax_element(angle.begin(), angle.end());
    quality.min_dihedral = *least;
    quality.max_dihedral = *most;
    if (details) *details = {angle, length};
    return quality;
}

} // namespace hexopt
