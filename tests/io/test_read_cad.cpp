// CAD files made by OpenCASCADE, whole, cut short and damaged, and the real ones.
#include "domain/orient_surface.hpp"
#include "domain/weld_surface.hpp"
#include "io/cad_format.hpp"
#include "io/cad_samples.hpp"
#include "io/read_surface.hpp"
#include "io/scratch.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <condition_variable>
#include <fmt/format.h>
#include <glm/geometric.hpp>
#include <map>
#include <mutex>
#include <numbers>
#include <random>
#include <thread>

using namespace hexopt;
using namespace hexopt::io_detail;
using namespace hexopt::test;
using Catch::Detail::Approx;

namespace {

CadSurface read_whole(const std::string& bytes, TessellationOptions options = {}) {
    Context context(1);
    Result<CadSurface> cad = read_cad_bytes("model", bytes, options, context);
    if (!cad) FAIL(cad.error().one_line());
    CHECK(cad->failed_faces == 0);
    CHECK(cad->soup.patch.size() == cad->soup.triangles.size());
    CHECK(cad->patch_colour.size() == cad->soup.patch_names.size());
    return std::move(*cad);
}

/// Divergence theorem.
double volume_of(const TriangleSoup& soup) {
    double six = 0;
    for (const auto& t : soup.triangles)
        six += glm::dot(soup.vertices[t[0]], glm::cross(soup.vertices[t[1]], soup.vertices[t[2]]));
    return six / 6;
}

/// Edges that are not used once in either direction.
std::size_t unbalanced_edges(const TriangleSoup& soup) {
    std::map<std::pair<Index, Index>, int> balance;
    for (const auto& t : soup.triangles)
        for (int k = 0; k < 3; ++k) {
            const Index a = t[static_cast<std::size_t>(k)], b = t[static_cast<std::size_t>((k + 1) % 3)];
            balance[std::minmax(a, b)] += a < b ? 1 : -1;
        }
    return static_cast<std::size_t>(
        std::count_if(balance.begin(), balance.end(), [](const auto& entry) { return entry.second != 0; }));
}

void check_refused(const std::string& bytes, const std::string& name = "model") {
    Context context(1);
    const Result<CadSurface> cad = read_cad_bytes(name, bytes, {}, context);
    REQUIRE(!cad);
    INFO(cad.error().one_line());
    CHECK(cad.error().code == ErrorCode::bad_input);
    CHECK(cad.error().one_line().find('\n') == std::string::npos);
}

} // namespace

TEST_CASE("a STEP box keeps its names, unnamed faces are numbered") {
    const CadSurface cad = read_whole(step_of_box());
    CHECK(cad.face_count == 6);
    CHECK(cad.soup.patch_names == std::vector<std::string>{"inlet", "wall", "face_4", "face_5", "face_6"});
    CHECK(cad.soup.patch_group == std::vector<Index>{0, 1, 2, 2, 2});
    CHECK(cad.soup.triangles.size() == 12);
    CHECK(cad.soup.vertices.size() == 8);
    CHECK(volume_of(cad.soup) == Approx(24).epsilon(1e-12));
    CHECK(unbalanced_edges(cad.soup) == 0);
}

TEST_CASE("unnamed CAD faces are groups of their own where that is asked for") {
    TessellationOptions options;
    options.unnamed_borders = true;
    CHECK(read_whole(step_of_box(), options).soup.patch_group == std::vector<Index>{0, 1, 2, 3, 4});
}

TEST_CASE("a STEP cylinder is closed, within the tolerance and coloured") {
    const std::string bytes = step_of_cylinder();
    double last_error = 1;
    for (const double deflection : {1e-2, 1e-3, 1e-4}) {
        const CadSurface cad = read_whole(bytes, {deflection, 60});
        CHECK(cad.soup.patch_names.size() == 3);
        CHECK(unbalanced_edges(cad.soup) == 0);
        const double exact = 3 * std::numbers::pi, error = (exact - volume_of(cad.soup)) / exact;
        // A chord's sagitta s leaves out at most 4/3 of s / r of the disc.
        CHECK(error > 0);
        CHECK(error < 4.0 / 3.0 * deflection * std::sqrt(4 + 4 + 9) * 1.05);
        CHECK(error < last_error);
        last_error = error;
        for (const auto& colour : cad.patch_colour) {
            REQUIRE(colour);
            CHECK((*colour)[0] == Approx(1));
            CHECK((*colour)[1] == Approx(0).margin(1e-9));
        }
    }
}

TEST_CASE("the angle bounds the turn along an edge of a CAD surface's triangles") {
    const CadSurface coarse = read_whole(step_of_cylinder(), {0.1, 45}),
                     fine = read_whole(step_of_cylinder(), {0.1, 5});
    CHECK(fine.soup.triangles.size() >= 72 * 4 - 4);
    CHECK(coarse.soup.triangles.size() < fine.soup.triangles.size());
}

TEST_CASE("seams and poles of CAD faces are closed") {
    const CadSurface sphere = read_whole(step_of_sphere()), torus = read_whole(brep_of_torus());
    CHECK(unbalanced_edges(sphere.soup) == 0);
    CHECK(volume_of(sphere.soup) == Approx(32 * std::numbers::pi / 3).epsilon(5e-3));
    CHECK(unbalanced_edges(torus.soup) == 0);
    CHECK(volume_of(torus.soup) == Approx(6 * std::numbers::pi * std::numbers::pi).epsilon(5e-3));
    for (const Point& p : sphere.soup.vertices) CHECK(glm::length(p) == Approx(2).epsilon(1e-9));
}

TEST_CASE("moved and mirrored parts of a STEP assembly point outwards") {
    const CadSurface cad = read_whole(step_of_assembly());
    CHECK(cad.face_count == 12);
    CHECK(volume_of(cad.soup) == Approx(2).epsilon(1e-12));
    CHECK(unbalanced_edges(cad.soup) == 0);
    double lowest = 0, highest = 0;
    for (const Point& p : cad.soup.vertices) {
        lowest = std::min(lowest, p.x);
        highest = std::max(highest, p.x);
    }
    CHECK(lowest == Approx(-3));
    CHECK(highest == Approx(6));
}

TEST_CASE("STEP in metres comes out in millimetres") {
    CHECK(volume_of(read_whole(step_in_metres()).soup) == Approx(24e9).epsilon(1e-9));
}

TEST_CASE("IGES surfaces that share nothing are sewn") {
    const std::string bytes = iges_of_cylinder();
    CHECK(recognise_cad("nameless", bytes) == CadFormat::iges);
    CadSurface cad = read_whole(bytes);
    Context context(1);
    const auto welded = weld_surface(cad.soup, 1e-6, context);
    REQUIRE(welded);
    CHECK(welded->report.open_edges_after == 0);
    const auto oriented = orient_surface(welded->soup, context);
    REQUIRE(oriented);
    CHECK(volume_of(oriented->soup) == Approx(3 * std::numbers::pi).epsilon(5e-3));
}

TEST_CASE("the same CAD file gives the same triangles") {
    const std::string bytes = step_of_sphere();
    const CadSurface first = read_whole(bytes), second = read_whole(bytes);
    CHECK(first.soup.triangles == second.soup.triangles);
    CHECK(first.soup.vertices == second.soup.vertices);
}

TEST_CASE("read_surface reads CAD files by content and lets their tolerance be chosen") {
    const Scratch scratch;
    spill(scratch / "torus", brep_of_torus());
    Context context(1);
    const auto fine = read_surface(scratch / "torus", context);
    const auto coarse = read_surface(scratch / "torus", TessellationOptions{1e-2, 45}, context);
    REQUIRE(fine);
    REQUIRE(coarse);
    CHECK(coarse->triangles.size() * 4 < fine->triangles.size());
    CHECK(fine->patch_names == std::vector<std::string>{"face_1"});
    const auto wrong = read_surface(scratch / "torus", TessellationOptions{0, 45}, context);
    REQUIRE(!wrong);
    CHECK(wrong.error().code == ErrorCode::usage);
}

TEST_CASE("a cancelled CAD reading ends as cancelled") {
    Context context(1);
    context.cancel();
    const auto cad = read_cad_bytes("model", step_of_sphere(), {}, context);
    REQUIRE(!cad);
    CHECK(cad.error().code == ErrorCode::cancelled);
}

TEST_CASE("CAD files without faces, of another kind or empty are refused") {
    check_refused(step_of_wire());
    check_refused("");
    check_refused("not CAD at all", "model.step");
    check_refused("not CAD at all", "model.igs");
    check_refused("not CAD at all", "model.brep");
    check_refused("ISO-10303-21;\nDATA;\nENDSEC;\nEND-ISO-10303-21;\n");
}

TEST_CASE("CAD files that were cut short are refused") {
    for (const std::string& bytes : {step_of_box(), iges_of_cylinder(), brep_of_spline()})
        for (int part = 1; part < 60; ++part) {
            const std::string cut = bytes.substr(0, bytes.size() * static_cast<std::size_t>(part) / 60);
            if (recognise_cad("model", cut) != CadFormat::none) check_refused(cut);
        }
}

TEST_CASE("huge counts in BREP and IGES files are refused before OpenCASCADE sees them") {
    const std::string brep = brep_of_spline();
    REQUIRE(check_brep("model", brep));
    for (const char* section :
         {"Locations ", "Curve2ds ", "Curves ", "Polygon3D ", "Surfaces ", "TShapes "}) {
        const std::string heading = fmt::format("\n{}", section);
        REQUIRE(brep.find(heading) != std::string::npos);
        const std::size_t at = brep.find(heading) + heading.size();
        const std::string inflated = fmt::format("{}99999999{}", brep.substr(0, at), brep.substr(at));
        CHECK(!check_brep("model", inflated));
    }
    const std::string iges = iges_of_cylinder();
    REQUIRE(check_iges("model", iges));
    const std::size_t line = iges.find("\n102,");
    REQUIRE(line != std::string::npos);
    const std::size_t end = iges.find(',', line + 5);
    const std::size_t blank = iges.find("  ", end); // gives up one column to the longer number
    REQUIRE(blank < line + 60);
    const std::string inflated =
        fmt::format("{}{}{}{}", iges.substr(0, line + 5), std::string(end - line - 4, '9'),
                    iges.substr(end, blank - end), iges.substr(blank + 1));
    CHECK(!check_iges("model", inflated));
}

TEST_CASE("damaged CAD files end in an error or a surface") {
    std::mt19937 random(7);
    std::size_t refused = 0, read = 0;
    for (const std::string& bytes :
         {step_of_box(), step_of_sphere(), iges_of_cylinder(), brep_of_spline(), brep_of_torus()})
        for (int run = 0; run < 30; ++run) {
            std::string damaged = bytes;
            for (unsigned edit = 0; edit < 1 + run % 4u; ++edit) {
                const std::size_t at = random() % damaged.size();
                const std::string_view letters = "0123456789-.,;()#'*$E \n";
                damaged[at] = letters[random() % letters.size()];
            }
            Context context(1);
            // Some damage keeps OpenCASCADE busy for ever: then cancelling ends it.
            std::mutex mutex;
            std::condition_variable done;
            bool is_done = false;
            std::thread watch([&] {
                std::unique_lock lock(mutex);
                if (!done.wait_for(lock, std::chrono::seconds(1), [&] { return is_done; })) context.cancel();
            });
            const auto cad = read_cad_bytes("model.step", damaged, {1e-2, 45}, context);
            {
                const std::lock_guard lock(mutex);
                is_done = true;
            }
            done.notify_one();
            watch.join();
            if (cad) {
                ++read;
                continue;
            }
            ++refused;
            CHECK(cad.error().one_line().find('\n') == std::string::npos);
        }
    CHECK(read > 10);
    CHECK(refused > 10);
}
