// Samples have the features that their shapes have, and none that only their tessellation makes.
#include "domain/domain.hpp"
#include "samples/geometry/geometries.hpp"

#include <catch2/catch.hpp>
#include <glm/geometric.hpp>
#include <limits>

using namespace hexopt;

namespace {

Domain features_of(const char* name) {
    Context context(1);
    const auto soup = make_geometry(name, {}, context);
    REQUIRE(soup);
    BoundaryOptions options;
    options.feature_angle_deg = 30;
    auto domain = build_domain(*soup, options, context);
    REQUIRE(domain);
    return std::move(*domain);
}

double least_distance(const BoundaryModel& model) {
    double least = std::numeric_limits<double>::infinity();
    for (Index a = 0; a < model.corner_count(); ++a)
        for (Index b = 0; b < a; ++b)
            least = std::min(least, glm::distance(model.corner_point(a), model.corner_point(b)));
    return least;
}

} // namespace

TEST_CASE("noses of wings are round, and no two of a sample's corners nearly meet") {
    CHECK(least_distance(features_of("wing").model) > 0.5);
    CHECK(least_distance(features_of("business-jet").model) > 0.5);
    CHECK(least_distance(features_of("wing-body").model) > 0.5);
    CHECK(least_distance(features_of("front-wing").model) > 0.0115); // as thick as the end plates
}

TEST_CASE("the ball of the three-pipe joint goes round each pipe") {
    const Domain domain = features_of("three-pipe-joint");
    CHECK(domain.model.curve_count() == 6);
    CHECK(domain.model.corner_count() == 0);
}
