#include "io/cad_format.hpp"
#include "io/scanner.hpp"

#include <algorithm>
#include <fmt/format.h>

namespace hexopt::io_detail {

namespace {

constexpr int kDeepest = 64; ///< of curves and surfaces defined by others
constexpr const char* kDamaged = "the file is damaged or cut short; write or copy it again";

/// Walks the sections of a BREP file that hold counts, in the layout that the BRep format's description of
/// OpenCASCADE gives.
class BrepWalk {
  public:
    explicit BrepWalk(Scanner& scanner) : scanner_(scanner) {}

    bool whole() {
        return heading() && section("Locations", [this] { return location(); }) &&
               section("Curve2ds", [this] { return curve(2, 0); }) &&
               section("Curves", [this] { return curve(3, 0); }) &&
               section("Polygon3D", [this] { return polygon(); }) &&
               section("PolygonOnTriangulations", [this] { return polygon_on_triangulation(); }) &&
               section("Surfaces", [this] { return surface(0); }) &&
               section("Triangulations", [this] { return triangulation(); }) && shapes();
    }

  private:
    bool fail(std::string reason) { return scanner_.fail(std::move(reason), kDamaged); }

    bool heading() {
        if (scanner_.peek() == "DBRep_DrawableShape") scanner_.token();
        if (scanner_.token() != "CASCADE" || scanner_.token() != "Topology")
            return scanner_.fail("no BREP file: no line \"CASCADE Topology\"",
                                 "give a BREP file (text), STEP or IGES");
        has_normals_ = scanner_.token().starts_with("V3");
        scanner_.line();
        return true;
    }

    template <class Entry>
    bool section(std::string_view name, const Entry& entry) {
        std::size_t count = 0;
        if (!count_of(name, count)) return false;
        for (std::size_t i = 0; i < count; ++i)
            if (!entry()) return false;
        return true;
    }

    bool count_of(std::string_view name, std::size_t& count) {
        if (const std::string_view word = scanner_.token(); word != name)
            return fail(fmt::format("\"{}\" instead of section {}", shown(word), name));
        return scanner_.read_count(count, "entries", 2);
    }

    bool numbers(std::size_t count) {
        if (!scanner_.check_count(count, "numbers", 2)) return false;
        double value = 0;
        for (std::size_t i = 0; i < count; ++i)
            if (!scanner_.read_double(value)) return false;
        return true;
    }

    bool small(std::size_t& value, std::size_t largest, const char* what) {
        std::int64_t given = 0;
        if (!scanner_.read_int(given)) return false;
        if (given < 0 || given > static_cast<std::int64_t>(largest))
            return fail(fmt::format("{} {}, of 0 to {}", what, given, largest));
        value = static_cast<std::size_t>(given);
        return true;
    }

    bool flag(std::size_t& value) { return small(value, 1, "flag"); }
    bool degree(std::size_t& value) { return small(value, 25, "degree"); }
    bool count(std::size_t& value, const char* things) { return scanner_.read_count(value, things, 2); }

    /// Numbers of points with dimension coordinates in a grid of u x v.
    bool poles(std::size_t u, std::size_t v, std::size_t dimension) {
        if (u != 0 && v > scanner_.remaining() / u) return fail(fmt::format("{} x {} poles", u, v));
        return numbers(u * v * dimension);
    }

    bool location() {
        std::size_t kind = 0;
        if (!small(kind, 2, "kind of location")) return false;
        if (kind != 2) return numbers(12);
        for (std::int64_t part = 1, power = 0; part != 0;) {
            if (!scanner_.read_int(part)) return false;
            if (part != 0 && !scanner_.read_int(power)) return false;
        }
        return true;
    }

    bool curve(std::size_t dimension, int depth) {
        std::size_t kind = 0, rational = 0, periodic = 0, order = 0, pole_count = 0, knot_count = 0;
        if (depth > kDeepest) return fail("curves nested too deeply");
        if (!small(kind, 9, "kind of curve")) return false;
        const std::size_t axes = dimension == 2 ? 6 : 12; // origin and directions of a conic
        switch (kind) {
        case 1:
            return numbers(2 * dimension);
        case 2:
        case 4:
            return numbers(axes + 1);
        case 3:
        case 5:
            return numbers(axes + 2);
        case 6:
            return flag(rational) && degree(order) && poles(order + 1, 1, dimension + rational);
        case 7:
            return flag(rational) && flag(periodic) && degree(order) && count(pole_count, "poles") &&
                   count(knot_count, "knots") && poles(pole_count, 1, dimension + rational) &&
                   numbers(2 * knot_count);
        case 8:
            return numbers(2) && curve(dimension, depth + 1);
        case 9:
            return numbers(dimension == 2 ? 1 : 4) && curve(dimension, depth + 1);
        default:
            return fail(fmt::format("kind of curve {}", kind));
        }
    }

    bool surface(int depth) {
        std::size_t kind = 0, u_degree = 0, v_degree = 0, u_rational = 0, v_rational = 0;
        if (depth > kDeepest) return fail("surfaces nested too deeply");
        if (!small(kind, 11, "kind of surface")) return false;
        switch (kind) {
        case 1:
            return numbers(12);
        case 2:
        case 4:
            return numbers(13);
        case 3:
        case 5:
            return numbers(14);
        case 6:
            return numbers(3) && curve(3, 0);
        case 7:
            return numbers(6) && curve(3, 0);
        case 8:
            return flag(u_rational) && flag(v_rational) && degree(u_degree) && degree(v_degree) &&
                   poles(u_degree + 1, v_degree + 1, 3 + std::max(u_rational, v_rational));
        case 9:
            return spline_surface();
        case 10:
            return numbers(4) && surface(depth + 1);
        case 11:
            return numbers(1) && surface(depth + 1);
        default:
            return fail(fmt::format("kind of surface {}", kind));
        }
    }

    bool spline_surface() {
        std::size_t rational[2]{}, periodic[2]{}, order[2]{}, pole_count[2]{}, knot_count[2]{};
        return flag(rational[0]) && flag(rational[1]) && flag(periodic[0]) && flag(periodic[1]) &&
               degree(order[0]) && degree(order[1]) && count(pole_count[0], "poles") &&
               count(pole_count[1], "poles") && count(knot_count[0], "knots") &&
               count(knot_count[1], "knots") &&
               poles(pole_count[0], pole_count[1], 3 + std::max(rational[0], rational[1])) &&
               numbers(2 * knot_count[0]) && numbers(2 * knot_count[1]);
    }

    bool polygon() {
        std::size_t nodes = 0, parameters = 0;
        return count(nodes, "nodes") && flag(parameters) && numbers(1) && numbers(nodes * (3 + parameters));
    }

    bool polygon_on_triangulation() {
        std::size_t nodes = 0, parameters = 0;
        if (!count(nodes, "nodes") || !numbers(nodes)) return false;
        if (scanner_.token() != "p") return fail("no \"p\" after the nodes of a polygon");
        return numbers(1) && flag(parameters) && numbers(nodes * parameters);
    }

    bool triangulation() {
        std::size_t nodes = 0, triangles = 0, parameters = 0, normals = 0;
        if (!count(nodes, "nodes") || !count(triangles, "triangles") || !flag(parameters)) return false;
        if (has_normals_ && !flag(normals)) return false;
        if (!numbers(1) || !numbers(nodes * (3 + 2 * parameters))) return false;
        for (std::size_t i = 0; i < 3 * triangles; ++i) {
            std::int64_t node = 0;
            if (!scanner_.read_int(node)) return false;
            if (node < 1 || node > static_cast<std::int64_t>(nodes))
                return fail(fmt::format("node {} of {}", node, nodes));
        }
        return numbers(3 * nodes * normals);
    }

    /// The list of each shape's parts ends with "*"; the last line names the shape that the file is.
    bool shapes() {
        std::size_t count = 0, ends = 0;
        if (!count_of("TShapes", count)) return false;
        std::string_view last[2];
        while (!scanner_.at_end()) {
            last[0] = last[1];
            last[1] = scanner_.token();
            ends += last[1] == "*";
        }
        if (ends != count) return fail(fmt::format("{} of {} shapes", ends, count));
        if (last[0].size() < 2 || std::string_view("+-ie").find(last[0][0]) == std::string_view::npos)
            return fail("no shape named on the last line");
        return true;
    }

    Scanner& scanner_;
    bool has_normals_ = false;
};

} // namespace

Status check_brep(const std::string& file, std::string_view bytes) {
    Scanner scanner(file, bytes);
    if (!BrepWalk(scanner).whole()) return scanner.error();
    return Done{};
}

} // namespace hexopt::io_detail
