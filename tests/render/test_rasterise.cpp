#include "render/rasterise.hpp"

#include <catch2/catch.hpp>
#include <random>

using namespace hexopt;

namespace {

ScreenQuad quad(double x0, double y0, double x1, double y1, double z, Color color) {
    ScreenQuad q;
    q.corner = {Point(x0, y0, z), Point(x1, y0, z), Point(x1, y1, z), Point(x0, y1, z)};
    q.fill = color;
    return q;
}

constexpr Color kWhite = {1, 1, 1}, kBlack = {0, 0, 0}, kRed = {1, 0, 0};

} // namespace

TEST_CASE("coverage of a pixel is the share of its nine samples") {
    Image image(4, 4, kWhite);
    Scene scene;
    scene.quads.push_back(quad(1, 1, 2 + 1.0 / 3, 3, 0, kBlack));
    rasterise(scene, {0, 0, 4, 4}, image, Parallel(1));
    CHECK(image.get(0, 1).r == 1);
    CHECK(image.get(1, 1).r == 0);
    CHECK(image.get(2, 1).r == Approx(2.0 / 3).margin(0.003));
    CHECK(image.get(2, 3).r == 1);
    CHECK(image.get(1, 0).r == 1);
}

TEST_CASE("the nearest surface is seen, whatever the order") {
    for (bool reverse : {false, true}) {
        Image image(20, 40, kWhite);
        Scene scene;
        scene.quads = {quad(0, 0, 15, 40, 1, kRed), quad(5, 0, 20, 40, 2, kBlack)};
        if (reverse) std::swap(scene.quads[0], scene.quads[1]);
        scene.lines.push_back({Point(0, 20, 1.5), Point(20, 20, 1.5), {0, 0, 1}, 4});
        rasterise(scene, {0, 0, 20, 40}, image, Parallel(2));
        CHECK(image.get(2, 10).r == 1);
        CHECK(image.get(2, 10).g == 0);
        CHECK(image.get(10, 10).r == 0);
        CHECK(image.get(18, 39).r == 0);
        CHECK(image.get(2, 20).b == 1);  // the line lies before the first
        CHECK(image.get(10, 20).b == 0); // and behind the second
    }
}

TEST_CASE("nothing is drawn outside the area") {
    Image image(10, 10, kWhite);
    Scene scene;
    scene.quads.push_back(quad(-1e6, -1e6, 1e6, 1e6, 0, kBlack));
    rasterise(scene, {2, 3, 5, 4}, image, Parallel(1));
    for (int y = 0; y < 10; ++y)
        for (int x = 0; x < 10; ++x) CHECK(image.get(x, y).r == (x >= 2 && x < 7 && y >= 3 && y < 7 ? 0 : 1));
}

TEST_CASE("edges are darker than the fill, and only near the quad's sides") {
    Image image(30, 30, kWhite);
    Scene scene;
    scene.quads.push_back(quad(5, 5, 25, 25, 0, kRed));
    scene.quads[0].edge_opacity = 1;
    scene.quads[0].edge_width = 4;
    rasterise(scene, {0, 0, 30, 30}, image, Parallel(1));
    CHECK(image.get(15, 15).r == 1); // on the diagonal between the two triangles
    CHECK(image.get(15, 5).r < 0.3f);
    CHECK(image.get(5, 15).r < 0.3f);
    CHECK(image.get(15, 9).r == 1);
    CHECK(image.get(2, 2).r == 1);
}

TEST_CASE("any number of threads draws the same, degenerate and infinite quads included") {
    std::mt19937_64 random(5);
    std::uniform_real_distribution<double> at(-20, 220);
    Scene scene;
    for (int i = 0; i < 500; ++i) {
        ScreenQuad q;
        for (Point& p : q.corner) p = Point(at(random), at(random), at(random));
        if (i % 50 == 0) q.corner[2] = q.corner[1] = q.corner[0];
        if (i % 70 == 0) q.corner[3].x = std::numeric_limits<double>::quiet_NaN();
        if (i % 80 == 0) q.corner[3].y = std::numeric_limits<double>::infinity();
        q.fill = {static_cast<float>(i % 7) / 7, static_cast<float>(i % 11) / 11, 0.5f};
        q.edge_opacity = 0.5f;
        scene.quads.push_back(q);
        scene.lines.push_back({q.corner[0], q.corner[2], kBlack, 2});
    }
    Image one(200, 200, kWhite), four(200, 200, kWhite);
    rasterise(scene, {0, 0, 200, 200}, one, Parallel(1));
    rasterise(scene, {0, 0, 200, 200}, four, Parallel(4));
    CHECK(one.bytes() == four.bytes());
    CHECK(one.bytes() != Image(200, 200, kWhite).bytes());
}
