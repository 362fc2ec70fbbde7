#include "capi/grid.hpp"

#include <catch2/catch.hpp>
#include <hexopt/hexopt.hpp>

TEST_CASE("optimize and measure through spans") {
    Grid grid(4);
    grid.tangle();
    const hexopt::Mesh mesh{.positions = grid.positions, .cells = grid.cells};
    std::vector<std::string> stages;
    hexopt::Optimizer optimizer({.progress = [&](std::string_view stage, double, std::string_view) {
        stages.emplace_back(stage);
        return true;
    }});
    CHECK(optimizer.measure(mesh).valid < 64);
    const hexopt::OptimizeResult result = optimizer.optimize(mesh);
    CHECK(result.status == HEXOPT_OK);
    CHECK(result.message.empty());
    CHECK(result.concave32_after == 0);
    CHECK(optimizer.measure(mesh).valid == 64);
    CHECK_FALSE(stages.empty());
}

TEST_CASE("a target out of reach is an outcome, a damaged mesh is a Failure") {
    Grid grid(2);
    const hexopt::Mesh mesh{.positions = grid.positions, .cells = grid.cells};
    grid.positions[3 * grid.vertex(0, 0, 0)] = 0.4;
    hexopt::Optimizer optimizer;
    hexopt::OptimizeOptions options;
    options.boundary = HEXOPT_BOUNDARY_FIXED;
    options.min_sj = 0.999;
    const hexopt::OptimizeResult result = optimizer.optimize(mesh, options);
    CHECK(result.status == HEXOPT_BELOW_TARGET);
    CHECK_FALSE(result.message.empty());

    grid.cells[0] = 1000;
    try {
        optimizer.measure(mesh);
        FAIL("a vertex that does not exist was accepted");
    } catch (const hexopt::Failure& failure) {
        CHECK(failure.status() == HEXOPT_BAD_INPUT);
        CHECK_THAT(failure.what(), Catch::Contains("1000"));
    }
    CHECK_THROWS_AS(optimizer.measure({.positions = {grid.positions.data(), 4}, .cells = grid.cells}),
                    hexopt::Failure);
}

TEST_CASE("what a callback throws comes out of the call, and the optimizer still works") {
    Grid grid(4);
    grid.tangle();
    const hexopt::Mesh mesh{.positions = grid.positions, .cells = grid.cells};
    bool throwing = true;
    hexopt::Optimizer optimizer({.progress = [&](std::string_view, double, std::string_view) {
        if (throwing) throw std::domain_error("from the host");
        return true;
    }});
    CHECK_THROWS_AS(optimizer.optimize(mesh), std::domain_error);
    throwing = false;
    CHECK(optimizer.optimize(mesh).status == HEXOPT_OK);
}
