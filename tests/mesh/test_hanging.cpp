#include "core/random.hpp"
#include "mesh/constraint_midpoints.hpp"
#include "mesh/hanging.hpp"

#include <catch2/catch.hpp>

using namespace hexopt;

namespace {

Hanging rows_of(std::initializer_list<std::tuple<Index, std::vector<Index>, std::vector<double>>> rows) {
    Hanging h;
    for (const auto& [vertex, masters, weights] : rows) append_row(h, vertex, masters, weights);
    return h;
}

/// Rows that hang on vertices earlier in a random order, the first `free` of which do not hang.
Hanging random_rows(Random& random, Index free, Index count) {
    std::vector<Index> order(count);
    for (Index i = 0; i < count; ++i) order[i] = i;
    for (Index i = count; i-- > 1;) std::swap(order[i], order[random.below(i + 1)]);
    Hanging rows;
    for (Index i = free; i < count; ++i) {
        const std::size_t parents = random.below(2) ? 2 : 4;
        std::vector<Index> masters;
        for (std::size_t k = 0; k < parents; ++k) masters.push_back(order[random.below(i)]);
        append_row(rows, order[i], masters, std::vector<double>(parents, parents == 2 ? 0.5 : 0.25));
    }
    return rows;
}

} // namespace

TEST_CASE("close_hanging expands a chain worked by hand") {
    // 4 = (0+1)/2, 5 = (4+2)/2, 6 = (5+4)/2 = 3/4 (0+1)/2 + 1/4 2
    const auto closed = close_hanging(
        rows_of({{6, {5, 4}, {0.5, 0.5}}, {5, {4, 2}, {0.5, 0.5}}, {4, {1, 0}, {0.5, 0.5}}}), 7);
    REQUIRE(closed);
    CHECK(closed->vertex == std::vector<Index>{4, 5, 6});
    CHECK(closed->offset == std::vector<std::size_t>{0, 2, 5, 8});
    CHECK(closed->master == std::vector<Index>{0, 1, 0, 1, 2, 0, 1, 2});
    CHECK(closed->weight == std::vector<double>{0.5, 0.5, 0.25, 0.25, 0.5, 0.375, 0.375, 0.25});
}

TEST_CASE("close_hanging rejects what cannot be closed") {
    const auto reason = [](const Hanging& rows) {
        const auto closed = close_hanging(rows, 5);
        REQUIRE_FALSE(closed);
        CHECK(closed.error().code == ErrorCode::bad_input);
        return closed.error().one_line();
    };
    using Catch::Matchers::Contains;
    CHECK_THAT(reason(rows_of({{0, {1, 2}, {0.5, 0.5}}, {1, {0, 3}, {0.5, 0.5}}})), Contains("circle"));
    CHECK_THAT(reason(rows_of({{0, {0, 2}, {0.5, 0.5}}})), Contains("circle"));
    CHECK_THAT(reason(rows_of({{0, {1}, {1}}, {0, {2}, {1}}})), Contains("twice"));
    CHECK_THAT(reason(rows_of({{5, {1}, {1}}})), Contains("out of range"));
    CHECK_THAT(reason(rows_of({{4, {5}, {1}}})), Contains("out of range"));
    CHECK_THAT(reason(rows_of({{4, {}, {}}})), Contains("no masters"));
    CHECK_THAT(reason(rows_of({{4, {1}, {std::nan("")}}})), Contains("finite"));
}

TEST_CASE("closing random rows keeps every position and leaves no chain") {
    for (std::uint64_t seed = 0; seed < 200; ++seed) {
        Random random(seed);
        const Index count = 40;
        const Hanging rows = random_rows(random, 4 + static_cast<Index>(random.below(6)), count);
        std::vector<Point> positions(count);
        for (Point& p : positions) p = Point(random.uniform(), random.uniform(), random.uniform());
        // Oracle: rows come in an order in which they may be applied one after the other.
        std::vector<Point> expected = positions;
        for (std::size_t row = 0; row < rows.count(); ++row) {
            Point x(0);
            for (std::size_t k = rows.offset[row]; k < rows.offset[row + 1]; ++k)
                x += rows.weight[k] * expected[rows.master[k]];
            expected[rows.vertex[row]] = x;
        }
        const auto closed = close_hanging(rows, count);
        REQUIRE(closed);
        const auto row_of = compute_hanging_row(*closed, count);
        for (std::size_t row = 0; row < closed->count(); ++row) {
            double sum = 0;
            for (std::size_t k = closed->offset[row]; k < closed->offset[row + 1]; ++k) {
                REQUIRE(row_of[closed->master[k]] == kNoIndex);
                sum += closed->weight[k];
            }
            REQUIRE(sum == Approx(1).epsilon(1e-14));
        }
        apply_hanging(*closed, positions, Parallel(2));
        for (Index v = 0; v < count; ++v)
            for (int axis = 0; axis < 3; ++axis)
                REQUIRE(positions[v][axis] == Approx(expected[v][axis]).epsilon(1e-12));
        REQUIRE(max_hanging_deviation(*closed, positions) == 0);
    }
}

TEST_CASE("vertices in the middle are found by what they depend on, however many vertices that are") {
    // 30 and 31 depend on ten vertices each, of which they share two; 32 and 33 lie between them, 34 depends
    // on the same ones but lies nearer to 30; 35 and 36 lie between 0 and 1.
    HexMesh mesh;
    mesh.positions.assign(40, Point(0));
    std::vector<Index> first, second, both;
    for (Index v = 0; v < 18; ++v) {
        if (v < 10) first.push_back(v);
        if (v >= 8) second.push_back(v);
        both.push_back(v);
    }
    const std::vector<double> tenth(10, 0.1);
    std::vector<double> halves(18, 0.05), nearer(18, 0.04);
    halves[8] = halves[9] = 0.1;
    for (std::size_t i = 0; i < 8; ++i) nearer[i] = 0.06;
    nearer[8] = nearer[9] = 0.1;
    mesh.hanging = rows_of({{30, first, tenth},
                            {31, second, tenth},
                            {32, both, halves},
                            {33, both, halves},
                            {34, both, nearer},
                            {35, {0, 1}, {0.5, 0.5}},
                            {36, {0, 1}, {0.5, 0.5}}});
    const ConstraintMidpoints midpoints(mesh);
    const auto between = [&](Index a, Index b) {
        std::vector<Index> found;
        midpoints.find(a, b, found);
        return found;
    };
    CHECK(between(30, 31) == std::vector<Index>{32, 33});
    CHECK(between(31, 30) == std::vector<Index>{32, 33});
    CHECK(between(0, 1) == std::vector<Index>{35, 36});
    CHECK(between(35, 36) == std::vector<Index>{35, 36}); // which lie where they do
    CHECK(between(0, 2).empty());
    CHECK(between(30, 0).empty());
    CHECK(between(38, 39).empty());

    HexMesh plain;
    plain.positions.assign(2, Point(0));
    std::vector<Index> found;
    ConstraintMidpoints(plain).find(0, 1, found);
    CHECK(found.empty());
}
