#include "io/read_outline.hpp"

#include "io/file_bytes.hpp"
#include "io/scanner.hpp"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>

namespace hexopt {

namespace {

using io_detail::Scanner;
using Points = std::vector<glm::dvec2>;

constexpr std::size_t kMostPoints = 20000; // the search for crossings is quadratic

Error bad(const std::string& where, std::string reason, std::string advice) {
    return Error{ErrorCode::bad_input, "read", where, {std::move(reason), std::move(advice)}};
}

bool parse_pair(std::string_view line, glm::dvec2& pair) {
    line = line.substr(0, line.find('#'));
    std::string spaced(line);
    std::replace(spaced.begin(), spaced.end(), ',', ' ');
    Scanner scanner("", spaced);
    return scanner.read_double(pair.x) && scanner.read_double(pair.y) && scanner.at_end();
}

bool is_blank(std::string_view line) {
    return line.substr(0, line.find('#')).find_first_not_of(" \t\r") == std::string_view::npos;
}

Result<Points> parse_lines(const std::string& file, std::string_view bytes) {
    Scanner scanner(file, bytes);
    Points points;
    bool may_be_title = true;
    while (scanner.remaining() > 0) {
        const std::size_t start = scanner.position();
        const std::string_view line = scanner.line();
        if (is_blank(line)) continue;
        glm::dvec2 pair;
        if (parse_pair(line, pair) && std::isfinite(pair.x) && std::isfinite(pair.y))
            points.push_back(pair);
        else if (!may_be_title)
            return bad(scanner.place(start),
                       fmt::format("'{}' is not two coordinates", io_detail::shown(line)),
                       "give x and y on each line");
        may_be_title = false;
        if (points.size() > kMostPoints)
            return bad(scanner.place(start), fmt::format("more than {} points", kMostPoints), "thin it out");
    }
    return points;
}

/// Lednicer's form starts with the two counts, which no outline has for a point.
bool is_two_sided(const Points& points) {
    if (points.empty()) return false;
    const auto [upper, lower] = std::pair(points[0].x, points[0].y);
    return upper == std::floor(upper) && lower == std::floor(lower) && upper >= 2 && lower >= 2 &&
           upper + lower + 1 == static_cast<double>(points.size());
}

void join_sides(Points& points) {
    const auto upper = static_cast<std::ptrdiff_t>(points[0].x);
    points.erase(points.begin());
    std::reverse(points.begin(), points.begin() + upper); // now from the tail over the nose to the tail
}

double twice_area(const Points& points) {
    double sum = 0;
    for (std::size_t i = 0; i < points.size(); ++i) {
        const glm::dvec2 a = points[i] - points[0], b = points[(i + 1) % points.size()] - points[0];
        sum += a.x * b.y - b.x * a.y;
    }
    return sum;
}

double side_of(const glm::dvec2& a, const glm::dvec2& b, const glm::dvec2& p) {
    return (b.x - a.x) * (p.y - a.y) - (b.y - a.y) * (p.x - a.x);
}

/// Number of the first edge that crosses a later one which is not its neighbour, or the number of points.
std::size_t find_crossing(const Points& points) {
    const std::size_t n = points.size();
    const auto next = [n](std::size_t i) { return i + 1 == n ? 0 : i + 1; };
    for (std::size_t i = 0; i < n; ++i)
        for (std::size_t k = i + 2; k < n; ++k) {
            if (next(k) == i) continue;
            const glm::dvec2 &a = points[i], &b = points[next(i)], &c = points[k], &d = points[next(k)];
            if (std::max(a.x, b.x) < std::min(c.x, d.x) || std::max(c.x, d.x) < std::min(a.x, b.x) ||
                std::max(a.y, b.y) < std::min(c.y, d.y) || std::max(c.y, d.y) < std::min(a.y, b.y))
                continue;
            if (side_of(a, b, c) * side_of(a, b, d) <= 0 && side_of(c, d, a) * side_of(c, d, b) <= 0)
                return i;
        }
    return n;
}

} // namespace

Result<Points> read_outline(const std::filesystem::path& path, Context& context) {
    const std::string file = path.string();
    const Result<FileBytes> bytes = read_file(path, context);
    if (!bytes) return bytes.error();
    Result<Points> points = parse_lines(file, bytes->view());
    if (!points) return points;
    if (is_two_sided(*points)) join_sides(*points);
    points->erase(std::unique(points->begin(), points->end()), points->end());
    while (points->size() > 1 && points->front() == points->back()) points->pop_back();
    const double area = points->size() < 3 ? 0 : twice_area(*points);
    if (area == 0) return bad(file, "the outline encloses nothing", "give at least three points of a loop");
    if (area < 0) std::reverse(points->begin(), points->end());
    if (const std::size_t edge = find_crossing(*points); edge < points->size())
        return bad(file,
                   fmt::format("the outline crosses itself near ({:.6g}, {:.6g})", (*points)[edge].x,
                               (*points)[edge].y),
                   "give the points in order round the outline");
    return points;
}

} // namespace hexopt
