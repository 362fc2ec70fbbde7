#include "render/render_mesh.hpp"

#include "render/color_map.hpp"
#include "samples/grid.hpp"
#include "samples/samples.hpp"

#include <catch2/catch.hpp>
#include <cmath>

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
