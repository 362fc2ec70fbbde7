#include "io/read_outline.hpp"
#include "io/scratch.hpp"

#include <catch2/catch.hpp>

using namespace hexopt;

namespace {

Result<Outline> outlines_of(const std::string& text) {
    const test::Scratch scratch;
    test::spill(scratch / "some.dat", text);
    Context context(1);
    return read_outlines(scratch / "some.dat", context);
}

} // namespace

TEST_CASE("outlines of several loops") {
    const std::string one = "0 0\n1 0\n1 1\n0 0\n", two = "3 0\n4 0\n4 1\n3 0\n";
    for (const std::string& text : {one + "\n" + two, "two loops\n" + one + "999 999\n" + two,
                                    "\n\n" + one + "\n\n" + two + "\n", one + "999.0 999.0\n\n" + two}) {
        INFO(text);
        const auto outline = outlines_of(text);
        INFO((outline ? "" : outline.error().one_line()));
        REQUIRE(outline);
        REQUIRE(outline->loops.size() == 2);
        CHECK(outline->loops[0].points == std::vector<Point2>{{0, 0}, {1, 0}, {1, 1}});
        CHECK(outline->loops[1].points == std::vector<Point2>{{3, 0}, {4, 0}, {4, 1}});
        CHECK(outline->patch_names == std::vector<std::string>{"some_1", "some_2"});
        CHECK(outline->loops[1].patch == std::vector<Index>{1, 1, 1});
    }
    const auto numbered = outlines_of("title\n" + one + "\n" + two);
    REQUIRE(numbered);
    CHECK(numbered->loops[0].line == std::vector<Index>{2, 3, 4});
    CHECK(numbered->loops[1].line == std::vector<Index>{7, 8, 9});
}

TEST_CASE("two sides between blank lines are one loop, other blank lines count for nothing") {
    const auto sides = outlines_of("0 0\n0.5 0.1\n1 0\n\n0 0\n0.5 -0.1\n1 0\n");
    REQUIRE(sides);
    REQUIRE(sides->loops.size() == 1);
    CHECK(sides->loops[0].points.size() == 4);
    CHECK(sides->patch_names == std::vector<std::string>{"some"});
    const auto stray = outlines_of("1 0\n0.5 0.1\n\n0 0\n0.5 -0.1\n");
    REQUIRE(stray);
    CHECK(stray->loops.size() == 1);
}

TEST_CASE("a blunt trailing edge may be left open, points that repeat the one before are left out") {
    const auto blunt = outlines_of("1 0.01\n0.5 0.1\n0.5 0.1\n0 0\n0.5 -0.1\n1 -0.01\n");
    REQUIRE(blunt);
    CHECK(blunt->loops[0].points.size() == 5);
}

TEST_CASE("outlines that are none are refused with file and line") {
    struct Case {
        const char *text, *line, *reason;
    };
    for (const Case& c : {
             Case{"0 0\n2 2\n2 0\n0 1\n0 0\n", "", "crosses or touches itself"},
             Case{"0 0\n2 0\n2 1\n1 0\n0 1\n0 0\n", ":1", "crosses or touches itself"}, // a vertex on an edge
             Case{"0 0\n1 0\n2 1\n2 -1\n1 0\n0 1\n0 0\n", "",
                  "crosses or touches itself"}, // twice through a point
             Case{"0 0\n1 0\n0.5 0\n1 1\n0 1\n0 0\n", ":1", "crosses or touches itself"}, // folds back
             Case{"0 0\n0.1 0\n0.2 0.01\n0.3 0.1\n0.4 0.3\n0.45 0.5\n", ":6", "open"},
             Case{"0 0\n1 0\n1 1\n0 0\n\n0 0\n1 0\n1 1\n0 0\n", ":6", "the same as that at"},
             Case{"0 0\n1 0\n1 1\n0 0\n\n1 1\n0 0\n1 0\n1 1\n", ":6", "the same as that at"},
             Case{"0 0\n1 0\n1 1\n0 0\n\n0.5 0.2\n2 0.2\n2 0.4\n0.5 0.2\n", ":2", "another loop"},
             Case{"0 0\n1 0\n2 0\n0 0\n", ":1", "encloses nothing"},
             Case{"0 0\n1 0\n1 x\n0 0\n", ":3", "not two coordinates"},
             Case{"0 0\n1 0\n1 1e999\n0 0\n", ":3", "not two coordinates"},
             Case{"title only\n", "", "no point"},
             Case{"", "", "empty"},
         }) {
        INFO(c.text);
        const auto outline = outlines_of(c.text);
        REQUIRE_FALSE(outline);
        CHECK(outline.error().code == ErrorCode::bad_input);
        INFO(outline.error().one_line());
        CHECK(outline.error().where.find("some.dat") != std::string::npos);
        CHECK(outline.error().where.ends_with(c.line));
        CHECK(outline.error().reasons.front().find(c.reason) != std::string::npos);
    }
}
