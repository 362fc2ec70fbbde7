#include "domain/clip_triangle.hpp"

namespace hexopt {

ClippedTriangle clip_triangle(const std::array<Point, 3>& triangle, const Box& box) {
    ClippedTriangle polygon;
    polygon.weight[0] = {1, 0, 0}, polygon.weight[1] = {0, 1, 0}, polygon.weight[2] = {0, 0, 1};
    polygon.count = 3;
    for (int plane = 0; plane < 6 && polygon.count > 0; ++plane) {
        const int d = plane / 2;
        const double sign = plane % 2 ? -1 : 1, limit = sign * (plane % 2 ? box.high[d] : box.low[d]);
        const auto height = [&](const std::array<double, 3>& w) {
            return sign * (w[0] * triangle[0][d] + w[1] * triangle[1][d] + w[2] * triangle[2][d]) - limit;
        };
        ClippedTriangle next;
        for (int i = 0; i < polygon.count; ++i) {
            const auto &from = polygon.weight[i], &to = polygon.weight[(i + 1) % polygon.count];
            const double a = height(from), b = height(to);
            if (a >= 0 && next.count < 9) next.weight[next.count++] = from;
            if ((a >= 0) == (b >= 0) || next.count >= 9) continue;
            const double t = a / (a - b);
            for (int k = 0; k < 3; ++k) next.weight[next.count][k] = from[k] + t * (to[k] - from[k]);
            ++next.count;
        }
        polygon = next;
    }
    return polygon;
}

} // namespace hexopt
