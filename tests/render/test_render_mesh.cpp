#include "render/render_mesh.hpp"

#include "render/color_map.hpp"
#include "render/outer_box.hpp"
#include "render/png.hpp"
#include "samples/grid.hpp"
#include "samples/samples.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <glm/geometric.hpp>

using namespace hexopt;

namespace {

RenderOptions small_picture() {
    RenderOptions options;
    options.size = {320, 240};
    return options;
}

Result<Image> draw(const HexMesh& mesh, const RenderOptions& options, int threads = 2) {
    Context context(threads);
    return render_mesh(mesh, compute_topology(mesh), options, context);
}

/// Pixels whose hue is that of the colour, whatever the light.
int count_like(const Image& image, Color color) {
    int count = 0;
    const float size = std::sqrt(color.r * color.r + color.g * color.g + color.b * color.b);
    for (int y = 40; y < image.height(); ++y)
        for (int x = 0; x < image.width() * 2 / 3; ++x) {
            const Color c = image.get(x, y);
            const float length = std::sqrt(c.r * c.r + c.g * c.g + c.b * c.b);
            const float dot = c.r * color.r + c.g * color.g + c.b * color.b;
            count += length > 0.2f && dot > 0.998f * length * size;
        }
    return count;
}

} // namespace

TEST_CASE("a cube fills the picture in the colour of its quality") {
    const HexMesh mesh = *make_grid({.cells = {4, 4, 4}}, Parallel(1));
    RenderOptions options = small_picture();
    options.view = *parse_view("x");
    const Image image = *draw(mesh, options);
    const int like = count_like(image, quality_color(1));
    CHECK(like > 10000);
    CHECK(count_like(image, kBadColor) == 0);
    CHECK(image.get(0, 239).r == 1); // background
}

TEST_CASE("bad cells stand out") {
    HexMesh mesh = *make_grid({.cells = {2, 2, 2}}, Parallel(1));
    for (Point& p : mesh.positions) p.z = -p.z; // every cell is turned over
    CHECK(count_like(*draw(mesh, small_picture()), kBadColor) > 3000);
}

TEST_CASE("levels, patches and plain colours") {
    Context context(1);
    const HexMesh octree = *make_sample("octree-corner", {}, context);
    RenderOptions options = small_picture();
    options.color = ColorBy::level;
    options.clips = {*parse_clip("x=0.7")};
    const Image levels = *draw(octree, options);
    CHECK(count_like(levels, level_color(0, 2)) > 300);
    CHECK(count_like(levels, level_color(2, 2)) > 100);

    HexMesh grid = *make_grid({.cells = {2, 2, 2}}, Parallel(1));
    grid.patch_names = {"left", "rest"};
    grid.boundary.clear();
    const Topology topology = compute_topology(grid);
    for (CellFace face : topology.boundary_faces)
        grid.boundary.push_back({face_vertices(grid, face), face.face == 2 ? Index{0} : Index{1}});
    options = small_picture();
    options.color = ColorBy::patch;
    const Image patches = *draw(grid, options); // from -y, which is face 2, and +x
    CHECK(count_like(patches, patch_color(0)) > 1000);
    CHECK(count_like(patches, patch_color(1)) > 1000);
    options.color = ColorBy::none;
    CHECK(count_like(*draw(grid, options), patch_color(0)) == 0);
}

TEST_CASE("a picture is the same for any number of threads") {
    Context context(2);
    SampleOptions sample;
    sample.tangled = 0.1;
    const HexMesh mesh = *make_sample("octree-warped", sample, context);
    for (std::size_t worst : {0u, 7u}) {
        RenderOptions options = small_picture();
        options.worst_count = worst;
        options.clips = {*parse_clip("-x=0.5")};
        CHECK(draw(mesh, options, 1)->bytes() == draw(mesh, options, 4)->bytes());
    }
}

TEST_CASE("close-ups draw each of the worst cells") {
    Context context(1);
    SampleOptions sample;
    sample.tangled = 0.2;
    const HexMesh mesh = *make_sample("grid", sample, context);
    RenderOptions options = small_picture();
    options.worst_count = 4;
    CHECK(count_like(*draw(mesh, options), kBadColor) > 2000);
    options.worst_count = 100;
    CHECK(draw(mesh, options));
    const HexMesh cube = *make_grid({.cells = {1, 1, 1}}, Parallel(1));
    CHECK(count_like(*draw(cube, options), quality_color(1)) > 3000); // fewer cells than asked for
}

TEST_CASE("pictures of degenerate meshes") {
    HexMesh mesh = *make_grid({.cells = {2, 2, 2}}, Parallel(1));
    HexMesh point = mesh;
    for (Point& p : point.positions) p = Point(1, 2, 3);
    CHECK(draw(point, small_picture()));
    HexMesh huge = mesh;
    for (Point& p : huge.positions) p *= 1e200;
    CHECK(count_like(*draw(huge, small_picture()), quality_color(1)) > 3000);
    HexMesh tiny = mesh;
    for (Point& p : tiny.positions) p *= 1e-200;
    CHECK(count_like(*draw(tiny, small_picture()), quality_color(1)) > 3000);
}

TEST_CASE("what cannot be drawn is a usage error") {
    const HexMesh mesh = *make_grid({.cells = {2, 2, 2}}, Parallel(1));
    RenderOptions options = small_picture();
    CHECK_FALSE(draw(HexMesh{}, options));
    options.clips = {*parse_clip("x=0")};
    CHECK_FALSE(draw(mesh, options));
    options = small_picture();
    options.color = ColorBy::patch;
    CHECK_FALSE(draw(mesh, options));
    HexMesh no_levels = mesh;
    no_levels.level.clear();
    options.color = ColorBy::level;
    CHECK_FALSE(draw(no_levels, options));
    options = small_picture();
    options.worst_count = 101;
    CHECK_FALSE(draw(mesh, options));
}

namespace {

/// A box of cells with one taken out of its middle.
HexMesh box_with_hole() {
    HexMesh mesh = *make_grid({.cells = {5, 5, 5}}, Parallel(1));
    const auto is_middle = [&](const Cell& cell) {
        Point centre(0);
        for (Index v : cell) centre += mesh.positions[v] / 8.0;
        return glm::length(centre - Point(0.5)) < 1e-6;
    };
    std::erase_if(mesh.cells, is_middle);
    mesh.level.clear();
    mesh.patch_names = {"box", "body"};
    mesh.boundary.clear();
    const Topology topology = compute_topology(mesh);
    const std::vector<std::uint8_t> on_box = find_faces_on_box(mesh, topology);
    for (std::size_t i = 0; i < on_box.size(); ++i)
        mesh.boundary.push_back({face_vertices(mesh, topology.boundary_faces[i]), on_box[i] ? 0u : 1u});
    return mesh;
}

} // namespace

TEST_CASE("the outer box of a flow is told from its body") {
    const HexMesh flow = box_with_hole();
    const Topology topology = compute_topology(flow);
    const std::vector<std::uint8_t> on_box = find_faces_on_box(flow, topology);
    CHECK(std::count(on_box.begin(), on_box.end(), 1) == 6 * 25);
    CHECK(std::count(on_box.begin(), on_box.end(), 0) == 6);
    CHECK(has_outer_box(flow, topology));
    const HexMesh cube = *make_grid({.cells = {3, 3, 3}}, Parallel(1));
    CHECK(!has_outer_box(cube, compute_topology(cube)));
    Context context(1);
    const HexMesh ball = *make_sample("octree-ball", {}, context);
    CHECK(!has_outer_box(ball, compute_topology(ball)));
}

TEST_CASE("patches and what is within the box are drawn alone, from both sides") {
    const HexMesh flow = box_with_hole();
    RenderOptions all = small_picture();
    all.color = ColorBy::patch;
    const Image whole = *draw(flow, all);
    CHECK(count_like(whole, patch_color(0)) > 3000);
    CHECK(count_like(whole, patch_color(1)) < 30); // but for the legend hidden in the box
    RenderOptions body = all, named = all;
    body.without_box = true;
    named.patches = {"body"};
    const Image alone = *draw(flow, body), same = *draw(flow, named);
    CHECK(count_like(alone, patch_color(1)) > 3000);
    CHECK(count_like(alone, patch_color(0)) < 30);
    CHECK(encode_png(alone) == encode_png(same));
    // Its faces look into the hole, away from whoever sees them, and are no darker than the box's own.
    RenderOptions plain = body, box = all;
    plain.color = box.color = ColorBy::none;
    const auto brightest = [](const Image& image) {
        float most = 0;
        for (int y = 60; y < image.height() - 60; ++y)
            for (int x = 60; x < image.width() - 60; ++x) {
                const Color c = image.get(x, y);
                if (c.b < 0.99f) most = std::max(most, c.b);
            }
        return most;
    };
    CHECK(brightest(*draw(flow, plain)) > 0.95f * brightest(*draw(flow, box)));
}

TEST_CASE("choices of surfaces that leave nothing are refused") {
    const HexMesh flow = box_with_hole();
    RenderOptions options = small_picture();
    options.patches = {"wing"};
    const auto unknown = draw(flow, options);
    REQUIRE(!unknown);
    CHECK(unknown.error().code == ErrorCode::usage);
    CHECK(unknown.error().one_line().find("it has box, body") != std::string::npos);
    options.patches = {"box"};
    options.without_box = true;
    REQUIRE(!draw(flow, options));
    const HexMesh cube = *make_grid({.cells = {3, 3, 3}}, Parallel(1));
    options.patches.clear();
    REQUIRE(!draw(cube, options));
}
