// All real geometries, clean and defective: whatever is kept has a closed manifold surface.
#include "domain/orient_surface.hpp"
#include "io/read_surface.hpp"
#include "mesh/recognise_hanging.hpp"
#include "mesh/validate_structure.hpp"
#include "stages/refine/refine.hpp"
#include "stages/trim/trim.hpp"
#include "support/skip.hpp"

#include <catch2/catch.hpp>
#include <filesystem>
#include <set>

using namespace hexopt;
namespace fs = std::filesystem;

namespace {

/// Far thinner than the default cells: nothing is inside.
const std::set<std::string> kTooThin = {"dirty_offset1", "multi_element_slab", "naca64a010_slab",
                                        "rae2822_slab"};

std::vector<fs::path> real_models() {
    std::vector<fs::path> files;
    const fs::path folder = fs::path(HEXOPT_SHARED_DATA) / "geometry";
    if (!fs::exists(folder)) return files;
    for (const auto& entry : fs::directory_iterator(folder))
        if (entry.path().extension() == ".stl") files.push_back(entry.path());
    std::sort(files.begin(), files.end());
    return files;
}

void check_kept(const TrimOutput& out) {
    CHECK(out.refine_cells.empty());
    CHECK(out.report.closed_manifold());
    CHECK(validate_structure(out.kept, Parallel(1)).empty());
    // What hangs is seen from ids and positions alone too.
    HexMesh bare = out.kept;
    bare.hanging.clear();
    Context context(1);
    const auto recognised = recognise_hanging(bare, RecogniseOptions{}, context.parallel());
    REQUIRE(recognised);
    CHECK(recognised->hanging.vertex == out.kept.hanging.vertex);
}

void trim_model(const fs::path& file) {
    Context context(2);
    const Result<TriangleSoup> soup = read_surface(file, context);
    if (!soup) FAIL(soup.error().one_line());
    const Result<OrientedSurface> oriented = orient_surface(*soup, context);
    if (!oriented) FAIL(oriented.error().one_line());
    const Result<Domain> domain = build_domain(oriented->soup, {}, context);
    if (!domain) FAIL(domain.error().one_line());
    RefineOptions refine_options;
    refine_options.target_cells = 5e3;
    Result<RefineOutput> refined = refine(*domain, refine_options, context);
    if (!refined) FAIL(refined.error().one_line());
    TrimOptions options;
    for (int round = 0; round <= 10; ++round) {
        if (round == 10) options.partial = PartialFaces::remove;
        const Result<TrimOutput> out = trim(refined->octree, *domain, options, context);
        if (!out && kTooThin.contains(file.stem())) return;
        if (!out) FAIL(out.error().one_line());
        if (out->refine_cells.empty()) return check_kept(*out);
        refine_cells(*refined, out->refine_cells, context);
    }
    FAIL("cells are left to refine");
}

} // namespace

TEST_CASE("the kept cells of every real model have a closed manifold surface", "[slow]") {
    const std::vector<fs::path> files = real_models();
    if (files.empty()) HEXOPT_SKIP("the real geometries are absent");
    for (const fs::path& file : files) {
        INFO(file.stem().string());
        trim_model(file);
    }
}
