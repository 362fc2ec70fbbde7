#include "render/view.hpp"

#include <catch2/catch.hpp>
#include <glm/geometric.hpp>

using namespace hexopt;

namespace {

bool is_near(const Point& a, const Point& b) { return glm::length(a - b) < 1e-12; }

} // namespace

TEST_CASE("every view is a right-handed orthonormal frame") {
    for (const char* text : {"iso", "x", "y", "z", "-x", "-y", "-z", "17,-33", "-200,89.5"}) {
        const Result<View> view = parse_view(text);
        REQUIRE(view);
        CHECK(glm::length(view->right) == Approx(1));
        CHECK(glm::length(view->up) == Approx(1));
        CHECK(is_near(glm::cross(view->right, view->up), view->toward));
    }
}

TEST_CASE("named views look from their side") {
    CHECK(is_near(parse_view("x")->toward, Point(1, 0, 0)));
    CHECK(is_near(parse_view("x")->up, Point(0, 0, 1)));
    CHECK(is_near(parse_view("-y")->right, Point(1, 0, 0)));
    CHECK(is_near(parse_view("z")->right, Point(1, 0, 0)));
    CHECK(is_near(parse_view("z")->up, Point(0, 1, 0)));
    CHECK(is_near(parse_view("0,90")->toward, Point(0, 0, 1)));
}

TEST_CASE("clips and sizes are read") {
    const Clip below = *parse_clip("y=0.25"), above = *parse_clip("-z=1");
    CHECK(below.axis == 1);
    CHECK(below.fraction == 0.25);
    CHECK_FALSE(below.keep_above);
    CHECK(above.axis == 2);
    CHECK(above.fraction == 1);
    CHECK(above.keep_above);
    CHECK(parse_picture_size("800x600")->width == 800);
    CHECK(parse_picture_size("800x600")->height == 600);
}

TEST_CASE("what cannot be read is a usage error") {
    for (const char* text : {"", "w", "xy", "1", "1,", ",1", "1,2,3", "10,91", "nan,0", "0,inf", "1e400,0"})
        CHECK_FALSE(parse_view(text));
    for (const char* text : {"", "x", "x=", "w=0.5", "x=2", "x=-0.1", "x=nan", "--x=0.5", "x=0.5z", "=0.5"})
        CHECK_FALSE(parse_clip(text));
    for (const char* text :
         {"", "800", "800x", "x600", "63x600", "800x16385", "-800x600", "800x600x1", "8e2x600"})
        CHECK_FALSE(parse_picture_size(text));
    CHECK(parse_view("w").error().code == ErrorCode::usage);
}
