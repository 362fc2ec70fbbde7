#include "samples/samples.hpp"

#include "mesh/hanging.hpp"
#include "mesh/topology.hpp"
#include "samples/box_mesh.hpp"
#include "samples/grid.hpp"

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>

namespace hexopt {

namespace {

constexpr std::string_view kStage = "sample";

struct Size {
    Index cells;
    int levels;
};

using Maker = Result<HexMesh> (*)(Size, const Parallel&);

/// Nearest and farthest distance of a point from a box.
std::array<double, 2> distances_to_box(const Point& p, const Point& low, const Point& high) {
    const Point near = glm::max(glm::max(low - p, p - high), Point(0));
    const Point far = glm::max(glm::abs(low - p), glm::abs(high - p));
    return {glm::length(near), glm::length(far)};
}

Result<HexMesh> make_octree(Size size, OctreeOptions options) {
    options.roots = {size.cells, size.cells, size.cells};
    options.levels = size.levels;
    auto mesh = make_box_mesh(make_octree_boxes(options), lattice_units(size.levels));
    if (!mesh) return mesh;
    for (Point& p : mesh->positions) p /= static_cast<double>(size.cells);
    apply_hanging(*mesh, Parallel(1));
    return mesh;
}

/// Refined within a shell round the middle that shrinks with the level, off-centre.
OctreeOptions sphere_refinement(Size size) {
    OctreeOptions options;
    const double n = size.cells;
    options.refine = [n](const Point& low, const Point& high) {
        const auto [near, far] = distances_to_box(Point(0.45 * n, 0.5 * n, 0.55 * n), low, high);
        return near < 0.27 * n && far > 0.27 * n;
    };
    return options;
}

Result<HexMesh> make_unit_grid(Size size, const Parallel& parallel) {
    return make_grid({{size.cells, size.cells, size.cells}}, parallel);
}

Result<HexMesh> make_graded_grid(Size size, const Parallel& parallel) {
    GridOptions options{{size.cells, size.cells, size.cells}};
    options.high = Point(1, 0.8, 0.5);
    options.grading = Point(8, 0.25, 2);
    return make_grid(options, parallel);
}

Result<HexMesh> make_warped_grid(Size size, const Parallel& parallel) {
    auto mesh = make_unit_grid(size, parallel);
    if (mesh) warp(*mesh, 0.05, parallel);
    return mesh;
}

Result<HexMesh> make_octree_corner(Size size, const Parallel&) {
    OctreeOptions options;
    const double reach = 0.6 * size.cells;
    options.refine = [reach](const Point& low, const Point& high) {
        return glm::length(low) < reach * glm::length(high - low) / std::sqrt(3.0);
    };
    return make_octree(size, options);
}

Result<HexMesh> make_octree_sphere(Size size, const Parallel&) {
    return make_octree(size, sphere_refinement(size));
}

Result<HexMesh> make_octree_warped(Size size, const Parallel& parallel) {
    auto mesh = make_octree_sphere(size, parallel);
    if (mesh) warp(*mesh, 0.04, parallel);
    return mesh;
}

Result<HexMesh> make_octree_ball(Size size, const Parallel& parallel) {
    auto mesh = make_octree_sphere(size, parallel);
    if (mesh) bend_to_ball(*mesh, 0.6, parallel);
    return mesh;
}

/// Cells on the deepest level near the sphere, coarser inwards; those not wholly inside are left out.
Result<HexMesh> make_octree_trimmed(Size size, const Parallel&) {
    OctreeOptions options;
    const Point centre(0.5 * size.cells);
    const double radius = 0.47 * size.cells, margin = 6.0 / (1 << size.levels);
    options.refine = [=](const Point& low, const Point& high) {
        const auto [near, far] = distances_to_box(centre, low, high);
        return near < radius && far > radius - margin;
    };
    options.keep = [=](const Point& low, const Point& high) {
        return distances_to_box(centre, low, high)[1] <= radius;
    };
    return make_octree(size, options);
}

/// Cut in two along x in a second ball: chains of hanging vertices that hang on hanging ones.
Result<HexMesh> make_octree_halved(Size size, const Parallel& parallel) {
    OctreeOptions options = sphere_refinement(size);
    const double n = size.cells;
    options.halve_x = [n](const Point& low, const Point& high) {
        return glm::distance(0.5 * (low + high), Point(0.6 * n, 0.45 * n, 0.4 * n)) < 0.33 * n;
    };
    auto mesh = make_octree(size, options);
    if (mesh) warp(*mesh, 0.03, parallel);
    return mesh;
}

struct Sample {
    SampleInfo info;
    Maker make;
};

constexpr std::array<Sample, 11> kSamples = {{
    {{"grid", "structured grid on the unit cube", 16, 0}, make_unit_grid},
    {{"grid-graded", "structured grid on a box, sizes growing along each axis", 16, 0}, make_graded_grid},
    {{"grid-warped", "structured grid, smoothly warped", 16, 0}, make_warped_grid},
    {{"scrambled-cube", "structured grid with all inner vertices at random places", 16, 0}, make_unit_grid},
    {{"octree-corner", "cube refined towards a corner", 4, 3}, make_octree_corner},
    {{"octree-sphere", "cube refined towards a sphere", 6, 2}, make_octree_sphere},
    {{"octree-warped", "cube refined towards a sphere, smoothly warped", 6, 2}, make_octree_warped},
    {{"octree-ball", "cube refined towards a sphere, bent towards a ball", 6, 2}, make_octree_ball},
    {{"octree-trimmed", "octree cells inside a sphere", 6, 2}, make_octree_trimmed},
    {{"octree-halved", "warped octree with cells cut in two along x: chains of hanging vertices", 6, 2},
     make_octree_halved},
    {{"large", "warped grid of a million cells (size 160: four million)", 100, 0}, make_warped_grid},
}};

Error usage_error(std::string reason) {
    return make_error(ErrorCode::usage, std::string(kStage), "", std::move(reason));
}

Status check_options(const SampleOptions& options) {
    if (options.size > 2000) return usage_error("the size must lie in 1..2000 cells");
    if (options.levels < -1 || options.levels > 6) return usage_error("the levels must lie in 0..6");
    return Done{};
}

} // namespace

const std::vector<SampleInfo>& sample_infos() {
    static const std::vector<SampleInfo> infos = [] {
        std::vector<SampleInfo> all;
        for (const Sample& sample : kSamples) all.push_back(sample.info);
        return all;
    }();
    return infos;
}

std::vector<std::string> sample_names() {
    std::vector<std::string> names;
    for (const Sample& sample : kSamples) names.emplace_back(sample.info.name);
    return names;
}

Result<HexMesh> make_sample(std::string_view name, const SampleOptions& options, Context& context) {
    if (auto checked = check_options(options); !checked) return checked.error();
    const auto sample =
        std::find_if(kSamples.begin(), kSamples.end(), [&](const Sample& s) { return s.info.name == name; });
    if (sample == kSamples.end()) {
        std::string known;
        for (const std::string& other : sample_names()) known += (known.empty() ? "" : ", ") + other;
        return usage_error("unknown sample '" + std::string(name) + "'; known: " + known);
    }
    if (options.levels > 0 && sample->info.default_levels == 0)
        return usage_error("sample '" + std::string(name) + "' has no refinement levels");
    const Size size{options.size ? options.size : sample->info.default_size,
                    options.levels >= 0 ? options.levels : sample->info.default_levels};
    context.report(kStage, 0, name);
    auto mesh = sample->make(size, context.parallel());
    if (!mesh) return mesh;
    const bool scrambled = options.scrambled || name == "scrambled-cube";
    if (context.is_cancelled()) return make_error(ErrorCode::cancelled, std::string(kStage), "", "cancelled");
    if (scrambled || options.tangled > 0) {
        const Topology topology = compute_topology(*mesh, context.parallel());
        if (scrambled)
            scramble(*mesh, topology, context.seed(), context.parallel());
        else {
            const PerturbOptions perturbing{options.tangled, options.pattern, context.seed()};
            if (auto reached = perturb(*mesh, topology, perturbing, context.parallel()); !reached)
                return reached.error();
        }
    }
    context.report(kStage, 1, name);
    return mesh;
}

} // namespace hexopt
