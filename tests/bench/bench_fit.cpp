/// Fits a surface: bench_fit SURFACE [target cells [OUT.vtu [fit|buffer]]]
/// Prints, for every round of repairs, what of the features is captured and why the rest is not, folded
/// boundary quads, cells that start concave (buffer: after the buffer layers), and processor times of one
/// thread; writes the mesh as the optimizer would get it.
#include "bench/bench_support.hpp"
#include "domain/orient_surface.hpp"
#include "domain/weld_surface.hpp"
#include "io/mesh_io.hpp"
#include "io/read_surface.hpp"
#include "quality/mesh_quality.hpp"
#include "stages/buffer/buffer.hpp"
#include "stages/fit/fit.hpp"
#include "stages/refine/refine.hpp"
#include "stages/trim/trim.hpp"

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <glm/geometric.hpp>

using namespace hexopt;
using namespace hexopt::bench;

namespace {

double curve_length(const Domain& domain, Index c) {
    const auto points = domain.model.curve_points(c);
    double length = 0;
    for (std::size_t i = 1; i < points.size(); ++i) length += glm::distance(points[i - 1], points[i]);
    return length;
}

/// Boundary quads with a corner that is turned over against the patch's normal there.
std::size_t count_folded(const FittedMesh& fitted, const Domain& domain) {
    std::size_t folded = 0;
    for (const BoundaryQuad& quad : fitted.mesh.boundary) {
        bool turned = false;
        for (int k = 0; k < 4 && !turned; ++k) {
            const Point a = fitted.mesh.positions[quad.vertices[(k + 3) % 4]];
            const Point b = fitted.mesh.positions[quad.vertices[k]];
            const Point c = fitted.mesh.positions[quad.vertices[(k + 1) % 4]];
            const Projection at = domain.model.project_patch(quad.patch, (a + b + c) / 3.0);
            turned = glm::dot(glm::cross(c - b, a - b), at.smooth_direction) < 0;
        }
        folded += turned;
    }
    return folded;
}

void print_curves(const Domain& domain, const FitReport& report, bool list) {
    double whole = 0, lost[6] = {};
    std::size_t count[6] = {};
    for (Index c = 0; c < domain.model.curve_count(); ++c) whole += curve_length(domain, c);
    for (const auto& released : report.released_curves) {
        const auto reason = static_cast<std::size_t>(released.reason);
        lost[reason] += curve_length(domain, released.curve);
        ++count[reason];
        if (!list) continue;
        const auto points = domain.model.curve_points(released.curve);
        const auto ends = domain.model.curve_ends(released.curve);
        const auto patches = domain.curve_patch[released.curve];
        std::printf("    curve %u reason %zu length %.4g points %zu ends %d %d angle %.0f-%.0f patches %d %d "
                    "(%.4g %.4g %.4g) - (%.4g %.4g %.4g)\n",
                    released.curve, reason, curve_length(domain, released.curve), points.size(), int(ends[0]),
                    int(ends[1]), domain.angle[released.curve].smallest, domain.angle[released.curve].largest,
                    int(patches[0]), int(patches.back()), points.front().x, points.front().y,
                    points.front().z, points.back().x, points.back().y, points.back().z);
    }
    std::printf("  corners %zu/%zu curves %zu/%zu length %.2f%% released: open %zu (%.2f%%) corner %zu "
                "(%.2f%%) blocked %zu (%.2f%%) sides %zu (%.2f%%) reroutes %d\n",
                report.captured_corners, report.corners, report.captured_curves, report.curves,
                100 * report.followed_length / std::max(whole, 1e-300), count[1], 100 * lost[1] / whole,
                count[2], 100 * lost[2] / whole, count[3], 100 * lost[3] / whole, count[4],
                100 * lost[4] / whole, report.reroutes);
    std::printf("  small %zu (%.2f%%)\n", count[5], 100 * lost[5] / whole);
}

TrimOutput trim_fully(RefineOutput& refined, const Domain& domain, Context& context) {
    TrimOptions options;
    for (int round = 1;; ++round) {
        if (round == 12) options.partial = PartialFaces::remove;
        TrimOutput out = must(trim(refined.octree, domain, options, context));
        if (out.refine_cells.empty()) return out;
        if (refine_cells(refined, out.refine_cells, context).requested == 0)
            options.partial = PartialFaces::remove;
    }
}

} // namespace

int main(int argc, char** argv) {
    if (argc < 2) return 2;
    RefineOptions refine_options;
    refine_options.target_cells = argc > 2 ? std::atof(argv[2]) : 15e3;
    const bool buffers = argc > 4 && !std::strcmp(argv[4], "buffer");
    const bool list = std::getenv("LIST") != nullptr;
    Context context(1);
    TriangleSoup soup = must(read_surface(argv[1], context));
    Point low(1e300), high(-1e300);
    for (const Point& p : soup.vertices) low = glm::min(low, p), high = glm::max(high, p);
    auto start = std::clock();
    soup =
        must(orient_surface(must(weld_surface(soup, 1e-4 * glm::distance(low, high), context)).soup, context))
            .soup;
    BoundaryOptions features;
    features.feature_angle_deg = 30;
    const Domain domain = must(build_domain(soup, features, context));
    const double surface_seconds = seconds_since(start);
    start = std::clock();
    RefineOutput refined = must(refine(domain, refine_options, context));
    std::printf("%zu patches, %zu curves, %zu corners; surface %.2f s, refine %.2f s\n",
                domain.model.patch_count(), domain.model.curve_count(), domain.model.corner_count(),
                surface_seconds, seconds_since(start));
    for (int repair = 0;; ++repair) {
        start = std::clock();
        TrimOutput trimmed = trim_fully(refined, domain, context);
        const double trim_seconds = seconds_since(start);
        start = std::clock();
        FitOutput fitted = must(fit_boundary(std::move(trimmed.kept), domain, {}, context));
        const double fit_seconds = seconds_since(start);
        std::vector<Index> again;
        for (Index cell : fitted.refine_cells) again.push_back(trimmed.kept_cell[cell]);
        std::sort(again.begin(), again.end());
        const bool last =
            repair == 3 || again.empty() || refine_cells(refined, again, context).requested == 0;
        std::printf("  round %d: %zu cells, trim %.2f s, fit %.2f s, refine %zu cells, folded %zu of %zu\n",
                    repair, fitted.fitted.mesh.cell_count(), trim_seconds, fit_seconds, again.size(),
                    count_folded(fitted.fitted, domain), fitted.fitted.mesh.boundary.size());
        print_curves(domain, fitted.report, list && last);
        if (!last) continue;
        FittedMesh result = std::move(fitted.fitted);
        if (buffers) {
            start = std::clock();
            result = must(insert_buffers(std::move(result), domain, {}, context)).fitted;
            std::printf("  buffer %.2f s, folded %zu of %zu\n", seconds_since(start),
                        count_folded(result, domain), result.mesh.boundary.size());
        }
        const Topology topology = compute_topology(result.mesh, context.parallel());
        const auto quality = must(compute_quality(result.mesh, topology, {}, context));
        std::printf("  %zu cells, bad8 %zu, bad24 %zu\n", result.mesh.cell_count(),
                    quality.validity.concave8_cells, quality.validity.concave24_cells);
        for (BoundaryQuad& quad : result.mesh.boundary) quad.patch = 0;
        result.mesh.patch_names = {"surface"};
        if (argc > 3 && std::strcmp(argv[3], "-")) must(write_mesh(argv[3], result.mesh, {}, {}, context));
        return 0;
    }
}
