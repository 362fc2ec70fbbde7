#include "domain/domain.hpp"
#include "domain/orient_surface.hpp"
#include "domain/weld_surface.hpp"
#include "io/domain_file.hpp"
#include "io/read_surface.hpp"
#include "io/scratch.hpp"
#include "samples/geometry/geometries.hpp"
#include "samples/geometry/solid.hpp"
#include "support/skip.hpp"

#include <catch2/catch.hpp>
#include <random>
#include <regex>

using namespace hexopt;
using test::Scratch;
using test::slurp;
using test::spill;

namespace {

Domain domain_of(const TriangleSoup& soup, bool patch_borders = true) {
    Context context(1);
    const auto oriented = orient_surface(soup, context);
    REQUIRE(oriented);
    BoundaryOptions options;
    options.feature_angle_deg = 30;
    options.patch_borders = patch_borders;
    auto domain = build_domain(oriented->soup, options, context);
    REQUIRE(domain);
    return std::move(*domain);
}

TriangleSoup cube() {
    return geometry::make_box(Point(0), Point(2), {"west", "east", "south", "north", "down", "up"});
}

std::string text_of(const Domain& domain) {
    Scratch scratch;
    Context context(1);
    REQUIRE(write_domain_file(scratch / "d.hxd", describe_domain(domain), context));
    return slurp(scratch / "d.hxd");
}

Result<Domain> read_text(const std::string& text, std::vector<std::string>* warnings = nullptr) {
    Scratch scratch;
    Context context(1);
    if (warnings)
        context.set_log_sink([=](LogLevel, std::string_view line) { warnings->emplace_back(line); });
    spill(scratch / "d.hxd", text);
    const auto description = read_domain_file(scratch / "d.hxd", context);
    if (!description) return description.error();
    return build_domain(*description, context);
}

/// The reading of a text that is to be refused: "d.hxd:LINE: ...".
std::string refusal_of(const std::string& text) {
    const auto domain = read_text(text);
    REQUIRE(!domain);
    CHECK(domain.error().code == ErrorCode::bad_input);
    return domain.error().one_line();
}

std::string replaced(std::string text, const std::string& pattern, const std::string& by) {
    const std::string changed = std::regex_replace(text, std::regex(pattern), by);
    REQUIRE(changed != text);
    return changed;
}

/// Number of the first line that matches, 1-based.
std::size_t line_with(const std::string& text, const std::string& pattern) {
    std::smatch match;
    REQUIRE(std::regex_search(text, match, std::regex(pattern)));
    return 1 + static_cast<std::size_t>(std::count(text.begin(), text.begin() + match.position(), '\n'));
}

void check_same(const Domain& a, const Domain& b) {
    const BoundaryModel &m = a.model, &n = b.model;
    REQUIRE(m.triangle_count() == n.triangle_count());
    REQUIRE(m.segment_count() == n.segment_count());
    REQUIRE(m.corner_count() == n.corner_count());
    for (Index t = 0; t < m.triangle_count(); ++t) {
        REQUIRE(m.triangle(t) == n.triangle(t));
        REQUIRE(m.vertex_normals(t) == n.vertex_normals(t));
        REQUIRE(m.patch_of_triangle(t) == n.patch_of_triangle(t));
    }
    for (Index s = 0; s < m.segment_count(); ++s) REQUIRE(m.segment(s) == n.segment(s));
    for (Index c = 0; c < m.corner_count(); ++c) REQUIRE(m.corner_point(c) == n.corner_point(c));
    for (Index c = 0; c < m.curve_count(); ++c) {
        REQUIRE(m.curve_ends(c) == n.curve_ends(c));
        REQUIRE(m.curve_closed(c) == n.curve_closed(c));
        REQUIRE(a.angle[c].smallest == b.angle[c].smallest);
        REQUIRE(a.angle[c].largest == b.angle[c].largest);
    }
    CHECK(a.curve_patch.item == b.curve_patch.item);
    CHECK(a.curve_patch.offset == b.curve_patch.offset);
    CHECK(a.curve_open == b.curve_open);
    CHECK(a.corner_curve.item == b.corner_curve.item);
    CHECK(a.patch_name == b.patch_name);
    CHECK(a.names == b.names);
    CHECK(m.diagonal() == n.diagonal());
}

} // namespace

TEST_CASE("a domain that is written and read is the same, bit by bit") {
    const auto name = GENERATE(as<std::string>{}, "three-pipe-joint", "wing", "cylinder", "cooled-blade");
    Context context(1);
    const auto soup = make_geometry(name, {24, ""}, context);
    REQUIRE(soup);
    const Domain domain = domain_of(*soup);
    const std::string text = text_of(domain);
    const auto again = read_text(text);
    INFO((again ? "" : again.error().one_line()));
    REQUIRE(again);
    check_same(domain, *again);
    CHECK(text_of(*again) == text);
}

TEST_CASE("real surfaces come back from a domain file as they were") {
    const std::filesystem::path folder = std::filesystem::path(HEXOPT_SHARED_DATA) / "geometry";
    if (!std::filesystem::exists(folder)) HEXOPT_SKIP("no shared data");
    int count = 0;
    for (const auto& entry : std::filesystem::recursive_directory_iterator(folder)) {
        const auto extension = entry.path().extension();
        if ((extension != ".stl" && extension != ".obj") || entry.file_size() > 400'000) continue;
        INFO(entry.path().string());
        Context context(1);
        const auto soup = read_surface(entry.path(), context);
        REQUIRE(soup);
        const auto oriented = orient_surface(*soup, context);
        if (!oriented) continue;
        const auto domain = build_domain(oriented->soup, {}, context);
        REQUIRE(domain);
        const auto again = read_text(text_of(*domain));
        INFO((again ? "" : again.error().one_line()));
        REQUIRE(again);
        check_same(*domain, *again);
        ++count;
    }
    CHECK(count > 3);
}

TEST_CASE("patches are renamed and joined in a domain file") {
    const std::string text = text_of(domain_of(cube()));
    const auto renamed = read_text(replaced(text, "patch 2 \"east\"", "patch 2 \"out \\\"let\\\"\""));
    REQUIRE(renamed);
    CHECK(renamed->names[renamed->patch_name[1]] == "out \"let\"");
    CHECK(renamed->model.curve_count() == 12);

    std::smatch curve;
    REQUIRE(std::regex_search(text, curve, std::regex("curve (\\d+) [^\n]*between 1 5 [^\n]*\n")));
    SECTION("by their surfaces") {
        std::string joined = replaced(text, "patch 1 \"west\" on 1", "patch 1 \"west\" on 1 5");
        joined = replaced(joined, "patch 5 [^\n]*\n", "");
        joined = replaced(joined, curve[0].str(), "");
        joined = replaced(joined, "between ([1-4]) 5", "between $1 1");
        const auto domain = read_text(joined);
        INFO((domain ? "" : domain.error().one_line()));
        REQUIRE(domain);
        CHECK(domain->model.patch_count() == 5);
        CHECK(domain->model.curve_count() == 11);
        CHECK(domain->triangle_name.empty());
        CHECK(domain->model.patch_triangles(0)[1] == 4);
    }
    SECTION("by deleting the curve between them: both names stay") {
        const auto domain = read_text(replaced(text, curve[0].str(), ""));
        REQUIRE(domain);
        CHECK(domain->model.patch_count() == 5);
        CHECK(domain->model.curve_count() == 11);
        CHECK(domain->model.corner_count() == 8);
        REQUIRE(domain->triangle_name.size() == 12);
        const Index west = domain->triangle_name[domain->model.project_patch(0, Point(0, 1, 1)).element];
        const Index down = domain->triangle_name[domain->model.project_patch(0, Point(1, 1, 0)).element];
        CHECK(domain->names[west] == "west");
        CHECK(domain->names[down] == "down");
        const auto again = read_text(text_of(*domain));
        REQUIRE(again);
        CHECK(again->model.patch_count() == 5);
        CHECK(again->triangle_name.size() == 12);
    }
}

TEST_CASE("the same happens where borders of patches are no features") {
    TriangleSoup soup = cube();
    for (Index& patch : soup.patch) patch = patch == 5 ? 5 : 0;
    for (std::size_t t = 0; t < soup.triangles.size(); t += 2) // half of each side
        if (soup.patch[t] == 0) soup.patch[t] = 1;
    const Domain domain = domain_of(soup, false);
    CHECK(domain.model.patch_count() == 6);
    REQUIRE(domain.triangle_name.size() == 12);
    const auto again = read_text(text_of(domain));
    REQUIRE(again);
    CHECK(again->model.patch_count() == 6);
    CHECK(again->model.curve_count() == 12);
    CHECK(std::count(again->triangle_name.begin(), again->triangle_name.end(), Index{1}) == 5);
}

TEST_CASE("corners are added in a domain file") {
    const std::string text = text_of(domain_of(cube()));
    std::vector<std::string> warnings;
    SECTION("on a curve, which is cut") {
        const auto domain = read_text(replaced(text, "\npatch 1", "\ncorner 99 0.00001 0.7 0\npatch 1"));
        REQUIRE(domain);
        CHECK(domain->model.corner_count() == 9);
        CHECK(domain->model.curve_count() == 13);
        CHECK(domain->model.corner_point(8) == Point(0, 0.7, 0));
        REQUIRE(domain->corner_curve[8].size() == 2);
        for (Index curve : domain->corner_curve[8]) {
            CHECK(domain->curve_patch[curve].size() == 2);
            CHECK(domain->angle[curve].smallest == Approx(90));
        }
    }
    SECTION("inside a patch, only if told so") {
        auto domain = read_text(replaced(text, "\npatch 1", "\ncorner 99 0 0.7 0.5\npatch 1"), &warnings);
        REQUIRE(domain);
        CHECK(domain->model.corner_count() == 8);
        REQUIRE(warnings.size() == 1);
        CHECK(warnings[0].find("corner 99") != std::string::npos);
        CHECK(warnings[0].find("d.hxd:") != std::string::npos);
        domain = read_text(replaced(text, "\npatch 1", "\ncorner 99 0 0.7 0.5 alone\npatch 1"));
        REQUIRE(domain);
        CHECK(domain->model.corner_count() == 9);
    }
    SECTION("on a loop, which begins there") {
        Context context(1);
        const auto cylinder = make_geometry("cylinder", {24, ""}, context);
        REQUIRE(cylinder);
        const Domain before = domain_of(*cylinder);
        const Point p = before.model.curve_points(0)[7];
        const std::string line = "\ncorner 1 " + std::to_string(p.x) + " " + std::to_string(p.y) + " " +
                                 std::to_string(p.z) + "\n";
        const auto domain = read_text(replaced(text_of(before), "\ncurve 1", line + "curve 1"));
        INFO((domain ? "" : domain.error().one_line()));
        REQUIRE(domain);
        CHECK(domain->model.curve_count() == before.model.curve_count());
        CHECK(domain->model.curve_ends(0) == std::array<Index, 2>{0, 0});
        CHECK(domain->model.corner_point(0) == domain->model.curve_points(0).front());
        CHECK(domain->model.curve_points(0).size() ==
              before.model.curve_points(0).size() + 1 - (domain->model.corner_point(0) == p ? 1 : 0));
    }
}

TEST_CASE("a curve leans on several polylines, which need not be edges of triangles") {
    std::string text = text_of(domain_of(cube()));
    std::smatch match;
    const std::regex whole("polyline 1 2 points\n([^\n]*)\n([^\n]*)\n");
    REQUIRE(std::regex_search(text, match, whole));
    const auto point = [](const std::string& line) {
        std::istringstream stream(line);
        Point p;
        stream >> p.x >> p.y >> p.z;
        return p;
    };
    const Point a = point(match[1]), b = point(match[2]);
    const auto at = [&](double t) {
        const Point p = (1 - t) * a + t * b + Point(1e-5);
        return std::to_string(p.x) + " " + std::to_string(p.y) + " " + std::to_string(p.z) + "\n";
    };
    const std::string parts = "polyline 1 2 points\n" + at(0.5) + match[2].str() +
                              "\npolyline 88 3 points\n" + at(0.5) + at(0.25) + match[1].str() + "\n";
    text.replace(static_cast<std::size_t>(match.position()), static_cast<std::size_t>(match.length()), parts);
    text = replaced(text, "along 1\n", "along 88 1\n");
    const auto domain = read_text(text);
    INFO((domain ? "" : domain.error().one_line()));
    REQUIRE(domain);
    CHECK(domain->model.patch_count() == 6);
    CHECK(domain->model.curve_count() == 12);
    CHECK(domain->model.segment_count() == 14);
    CHECK(domain->model.curve_points(0).front() == a);
    CHECK(domain->model.curve_points(0).back() == b);
    CHECK(domain->curve_open[0] == 0);
    CHECK(domain->angle[0].smallest == Approx(90));
    CHECK(refusal_of(replaced(text, "along 88 1\n", "along 1 2 88\n")).find("does not begin where") !=
          std::string::npos);
}

TEST_CASE("what does not fit in a domain file is refused with its line") {
    const std::string text = text_of(domain_of(cube()));
    const auto refused = [&](const std::string& pattern, const std::string& by, const std::string& at,
                             const std::string& words) {
        const std::string changed = replaced(text, pattern, by);
        const std::string message = refusal_of(changed);
        INFO(message);
        const std::size_t line =
            at.empty() ? 1 + static_cast<std::size_t>(std::count(changed.begin(), changed.end(), '\n'))
                       : line_with(changed, at);
        CHECK(message.find("d.hxd:" + std::to_string(line) + ":") != std::string::npos);
        CHECK(message.find(words) != std::string::npos);
    };
    refused("patch 3 ([^\n]*)", "patch 3 \"south\" on 33", "patch 3 ", "surface 33");
    refused("patch 3 ([^\n]*)", "patch 3 \"south\" on 2", "patch 3 ", "surface 2 carries patch 2");
    refused("patch 3 ([^\n]*)", "patch 3 south on 3", "patch 3 ", "double quotes");
    refused("patch 3 ([^\n]*)", "patch 3 \"south on 3", "patch 3 ", "closing quote");
    refused("patch 3 ([^\n]*)", "patch 3 \"south\" 3", "patch 3 ", "'on'");
    refused("patch 3 ([^\n]*)", "patch 2 \"south\" on 3", "patch 2 \"south", "patch 2 is there twice");
    refused("corner 3 [^\n]*\n", "", "curve (\\d+) from (3 |\\d+ to 3 )", "corner 3, which is not there");
    refused("corner 3 [^\n]*\n", "corner 3 1 2 x\n", "corner 3 ", "'x'");
    refused("corner 3 [^\n]*\n", "corner 3 1 2 inf\n", "corner 3 ", "finite");
    refused("corner 3 [^\n]*\n", "corner 3 1 1.5 7\n", "curve (\\d+) from (3 |\\d+ to 3 )", "from corner 3");
    refused("corner 0?3 [^\n]*\n", "corner 0 1 1.5 7\n", "corner 0 ", "numbers start at 1");
    refused("curve 4 from \\d+ to \\d+", "curve 4 closed", "curve 4 ", "not closed");
    refused("curve 4 from \\d+ to \\d+", "curve 4", "curve 4 ", "has no ends");
    refused("curve 4 from", "curve 4 closed from", "curve 4 ", "closed and has ends");
    refused("curve 4 ([^\n]*) along 4", "curve 4 $1 along 44", "curve 4 ", "polyline 44");
    refused("curve 4 ([^\n]*) along 4", "curve 4 $1", "curve 4 ", "leans on nothing");
    refused("curve 4 ([^\n]*) between \\d \\d", "curve 4 $1 between 1 9", "curve 4 ", "patch 9");
    refused("curve 4 ([^\n]*) angle [^a]*along", "curve 4 $1 angle 90 400 along", "curve 4 ", "0..360");
    refused("curve 4 ([^\n]*) angle [^a]*along", "curve 4 $1 angle 90 20 along", "curve 4 ", "smaller angle");
    refused("\npatch 1", "\nedge 3\npatch 1", "edge 3", "'edge'");
    refused("surface 2 (\\d+) points", "surface 2 99999 points", "surface 2 ", "99999");
    refused("\nend\n", "\n", "", "cut short");
    refused("\nend\n", "\nend\nend", "", "after 'end'");
    CHECK(refusal_of("solid cube\n").find("no domain file") != std::string::npos);
    CHECK(refusal_of("hexopt domain 2\nend\n").find("version") != std::string::npos);
    CHECK(refusal_of("hexopt domain 1\nend\n").find("no patches") != std::string::npos);
}

TEST_CASE("damaged domain files are refused or give a domain, and nothing else") {
    const std::string text = text_of(domain_of(cube()));
    for (std::size_t length = 0; length + 1 < text.size(); length += 7)
        CHECK(!read_text(text.substr(0, length)));
    std::mt19937 random(7);
    const std::string digits = "0123456789 -.e\n\"#abc";
    int whole = 0;
    for (int round = 0; round < 1500; ++round) {
        std::string damaged = text;
        for (int i = 0; i < 1 + round % 4; ++i)
            damaged[random() % damaged.size()] = digits[random() % digits.size()];
        const auto domain = read_text(damaged);
        if (domain)
            whole += domain->model.triangle_count() > 0;
        else
            CHECK(!domain.error().one_line().empty());
    }
    CHECK(whole > 0);
}
