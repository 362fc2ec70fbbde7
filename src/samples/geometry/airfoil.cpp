#include "samples/geometry/airfoil.hpp"

#include "io/read_outline.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <numbers>

namespace hexopt::geometry {

namespace {

struct Camber {
    double height, slope;
};
using CamberLine = std::function<Camber(double x)>;

/// Half thickness; the last coefficient closes the trailing edge (Abbott & von Doenhoff, 6.4, with 0.1036).
double half_thickness(double thickness, double x) {
    const double series = 0.2969 * std::sqrt(x) + x * (-0.126 + x * (-0.3516 + x * (0.2843 - x * 0.1036)));
    return 5 * thickness * series;
}

std::vector<Point2> make_section(double thickness, const CamberLine& camber, int points_per_side) {
    const auto at = [&](int i, double side) {
        const double x = 0.5 * (1 - std::cos(std::numbers::pi * i / points_per_side));
        const Camber line = camber(x);
        const double turn = std::atan(line.slope), half = half_thickness(thickness, x);
        return Point2(x - side * half * std::sin(turn), line.height + side * half * std::cos(turn));
    };
    std::vector<Point2> points = {{1, 0}};
    for (int i = points_per_side - 1; i > 0; --i) points.push_back(at(i, 1));
    points.emplace_back(0, 0);
    for (int i = 1; i < points_per_side; ++i) points.push_back(at(i, -1));
    return points;
}

/// NACA report 610: coefficients of the five-digit camber lines 210..250 and, reflexed, 221..251.
struct FiveDigit {
    int code;
    double r, k1, ratio;
};
constexpr std::array<FiveDigit, 9> kFiveDigit = {{{210, 0.0580, 361.4, 0},
                                                  {220, 0.1260, 51.64, 0},
                                                  {230, 0.2025, 15.957, 0},
                                                  {240, 0.2900, 6.643, 0},
                                                  {250, 0.3910, 3.230, 0},
                                                  {221, 0.1300, 51.990, 0.000764},
                                                  {231, 0.2170, 15.793, 0.00677},
                                                  {241, 0.3180, 6.520, 0.0303},
                                                  {251, 0.4410, 3.191, 0.1355}}};

Camber five_digit_camber(const FiveDigit& line, double x) {
    const double r = line.r, k = line.k1 / 6, q = line.ratio, d = x - r;
    if (q == 0 && x < r)
        return {k * x * (x * (x - 3 * r) + r * r * (3 - r)), k * (3 * x * x - 6 * r * x + r * r * (3 - r))};
    if (q == 0) return {k * r * r * r * (1 - x), -k * r * r * r};
    const double rest = q * std::pow(1 - r, 3) + r * r * r, factor = x < r ? 1 : q;
    return {k * (factor * d * d * d - rest * x + r * r * r), k * (3 * factor * d * d - rest)};
}

} // namespace

std::vector<Point2> make_naca_four(const NacaSection& section, int points_per_side) {
    const double m = section.camber, p = section.camber_place;
    const CamberLine line = [m, p](double x) {
        if (m == 0) return Camber{0, 0};
        const double scale = m / (x < p ? p * p : (1 - p) * (1 - p));
        const double start = x < p ? 0 : 1 - 2 * p;
        return Camber{scale * (start + 2 * p * x - x * x), scale * 2 * (p - x)};
    };
    return make_section(section.thickness, line, points_per_side);
}

Result<std::vector<Point2>> make_naca(const std::string& code, int points_per_side) {
    const auto unknown = [&] {
        return make_error(ErrorCode::usage, "sample", "",
                          "no NACA section '" + code +
                              "': give 4 digits, or 5 of the series 210, 220, 230, "
                              "240, 250, 221, 231, 241 or 251");
    };
    const bool is_number =
        !code.empty() && std::all_of(code.begin(), code.end(), [](char c) { return c >= '0' && c <= '9'; });
    if (!is_number || code.size() < 4 || code.size() > 5) return unknown();
    const int number = std::stoi(code);
    const double thickness = number % 100 / 100.0;
    if (number % 100 == 0) return unknown();
    if (code.size() == 4) {
        const int camber = number / 1000, place = number / 100 % 10;
        if ((camber == 0) != (place == 0)) return unknown();
        return make_naca_four({camber / 100.0, place / 10.0, thickness}, points_per_side);
    }
    const auto line = std::find_if(kFiveDigit.begin(), kFiveDigit.end(),
                                   [&](const FiveDigit& l) { return l.code == number / 100; });
    if (line == kFiveDigit.end()) return unknown();
    return make_section(
        thickness, [&](double x) { return five_digit_camber(*line, x); }, points_per_side);
}

Result<std::vector<Point2>> make_airfoil(const std::string& code_or_file, int points_per_side,
                                         Context& context) {
    const bool is_code =
        std::all_of(code_or_file.begin(), code_or_file.end(), [](char c) { return c >= '0' && c <= '9'; });
    if (is_code) return make_naca(code_or_file, points_per_side);
    return read_outline(code_or_file, context);
}

} // namespace hexopt::geometry
