#include "io/read_outline.hpp"
#include "io/read_surface.hpp"
#include "io/scratch.hpp"
#include "io/write_surface.hpp"

#include <catch2/catch.hpp>
#include <filesystem>
#include <limits>

using namespace hexopt;
namespace fs = std::filesystem;

namespace {

TriangleSoup tetrahedron() {
    return {{{0, 0, 0}, {0.1, 0, 0}, {0, 1.0 / 3, 0}, {0, 0, 1e-7}},
            {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {2, 0, 3}},
            {1, 0, 1, 0},
            {"low part", "rest"}};
}

Result<std::vector<glm::dvec2>> outline_of(const std::string& text) {
    const test::Scratch scratch;
    test::spill(scratch / "outline.dat", text);
    Context context(1);
    return read_outline(scratch / "outline.dat", context);
}

} // namespace

TEST_CASE("surfaces are read back as they were written") {
    const test::Scratch scratch;
    Context context(1);
    const TriangleSoup soup = tetrahedron();
    for (const char* name : {"a.stl", "a.obj"}) {
        INFO(name);
        REQUIRE(write_surface(scratch / name, soup, {}, context));
        const auto back = read_surface(scratch / name, context);
        INFO((back ? "" : back.error().one_line()));
        REQUIRE(back);
        CHECK(back->patch_names == soup.patch_names);
        CHECK(back->patch == std::vector<Index>{0, 0, 1, 1});
        REQUIRE(back->triangles.size() == 4);
        constexpr std::size_t kOrder[] = {1, 3, 0, 2};
        for (std::size_t t = 0; t < 4; ++t)
            for (std::size_t k = 0; k < 3; ++k)
                CHECK(back->vertices[back->triangles[t][k]] == soup.vertices[soup.triangles[kOrder[t]][k]]);
    }
}

TEST_CASE("binary STL keeps the shape in single precision, and says that patches are lost") {
    const test::Scratch scratch;
    Context context(1);
    int warnings = 0;
    context.set_log_sink([&](LogLevel level, std::string_view) { warnings += level == LogLevel::warning; });
    const TriangleSoup soup = tetrahedron();
    REQUIRE(write_surface(scratch / "b.stl", soup, {.binary = true}, context));
    CHECK(warnings == 1);
    CHECK(fs::file_size(scratch / "b.stl") == 84 + 4 * 50);
    const auto back = read_surface(scratch / "b.stl", context);
    REQUIRE(back);
    REQUIRE(back->triangles.size() == 4);
    for (std::size_t k = 0; k < 3; ++k) {
        const Point expected = soup.vertices[soup.triangles[1][k]];
        const Point got = back->vertices[back->triangles[0][k]];
        for (int i = 0; i < 3; ++i) CHECK(static_cast<float>(got[i]) == static_cast<float>(expected[i]));
    }
}

TEST_CASE("surfaces that cannot be written are refused and leave the earlier file") {
    const test::Scratch scratch;
    Context context(1);
    test::spill(scratch / "c.stl", "earlier");
    TriangleSoup broken = tetrahedron();
    broken.vertices[2].y = std::numeric_limits<double>::quiet_NaN();
    CHECK(write_surface(scratch / "c.stl", broken, {}, context).error().code == ErrorCode::output_failed);
    broken = tetrahedron();
    broken.triangles[1][2] = 4;
    CHECK(write_surface(scratch / "c.stl", broken, {}, context).error().code == ErrorCode::output_failed);
    broken = tetrahedron();
    broken.patch[0] = 2;
    CHECK(write_surface(scratch / "c.stl", broken, {}, context).error().code == ErrorCode::output_failed);
    CHECK(write_surface(scratch / "c.ply", tetrahedron(), {}, context).error().code == ErrorCode::usage);
    CHECK(write_surface(scratch / "c.obj", tetrahedron(), {.binary = true}, context).error().code ==
          ErrorCode::usage);
    CHECK(fs::file_size(scratch / "c.stl") == 7);
}

TEST_CASE("outlines: Selig's and Lednicer's order give the same loop") {
    const auto selig = outline_of("a title\n1 0\n0.5 0.1\n0 0\n0.5 -0.1 # below\n1 0\n");
    INFO((selig ? "" : selig.error().one_line()));
    REQUIRE(selig);
    CHECK(*selig == std::vector<glm::dvec2>{{1, 0}, {0.5, 0.1}, {0, 0}, {0.5, -0.1}});
    const auto lednicer = outline_of("a title\n3. 3.\n\n0 0\n0.5 0.1\n1 0\n\n0 0\n0.5 -0.1\n1 0\n");
    REQUIRE(lednicer);
    CHECK(*lednicer == *selig);
    const auto clockwise = outline_of("0 0\n0 1\n1 1\n1 0\n");
    REQUIRE(clockwise);
    CHECK(*clockwise == std::vector<glm::dvec2>{{1, 0}, {1, 1}, {0, 1}, {0, 0}});
    CHECK(outline_of("1,0\n0,1\n0,0\n"));
}

TEST_CASE("outlines that are none are refused with their place") {
    for (const char* text : {"only a title\n", "0 0\n1 1\n", "0 0\n1 0\n2 0\n", "0 0\n1 0\nx y\n0 1\n",
                             "0 0\n1 1\n1 0\n0 1\n", "0 0\n1 0\n0.5 0\n1 1\n0 1\n", "0 0\nnan 1\n1 1\n"}) {
        INFO(text);
        const auto outline = outline_of(text);
        REQUIRE_FALSE(outline);
        CHECK(outline.error().code == ErrorCode::bad_input);
    }
    CHECK(outline_of("0 0\n1 0\nx y\n0 1\n").error().where.ends_with(":3"));
}
