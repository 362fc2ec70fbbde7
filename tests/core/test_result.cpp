#include "core/result.hpp"

#include <catch2/catch.hpp>

using namespace hexopt;

TEST_CASE("an error reads as one line, whatever its reasons contain") {
    const Error error{
        ErrorCode::bad_input, "read", "a.vtk:3", {"count is\n-1", "give a count of at least 0"}};
    CHECK(error.one_line() == "read: a.vtk:3: count is -1; give a count of at least 0");
    CHECK(Error{ErrorCode::usage, "", "", {"x"}}.one_line() == "x");
}

TEST_CASE("a result holds a value or an error") {
    Result<int> good = 3;
    Result<int> bad = make_error(ErrorCode::device, "s", "w", "r");
    REQUIRE(good);
    CHECK(*good == 3);
    REQUIRE_FALSE(bad);
    CHECK(bad.error().code == ErrorCode::device);
}
