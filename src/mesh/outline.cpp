#include "mesh/outline.hpp"

namespace hexopt {

double twice_area(std::span<const Point2> points) {
    double sum = 0;
    for (std::size_t i = 0; i < points.size(); ++i) {
        const Point2 a = points[i] - points[0], b = points[(i + 1) % points.size()] - points[0];
        sum += a.x * b.y - b.x * a.y;
    }
    return sum;
}

} // namespace hexopt
