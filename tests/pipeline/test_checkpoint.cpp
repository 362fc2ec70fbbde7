#include "core/random.hpp"
#include "domain/tapered_chamfer.hpp"
#include "io/archive_file.hpp"
#include "io/scratch.hpp"
#include "io/write_surface.hpp"
#include "pipeline/archive_mesh_state.hpp"
#include "pipeline/checkpoint.hpp"
#include "samples/geometry/geometries.hpp"
#include "samples/geometry/solid.hpp"
#include "support/turned.hpp"

#include <catch2/catch.hpp>
#include <nlohmann/json.hpp>
#include <zlib.h>

using namespace hexopt;
namespace fs = std::filesystem;

namespace {

TriangleSoup cube(double high) {
    return geometry::make_box(Point(0), Point(high), {"west", "east", "south", "north", "down", "up"});
}

MeshJob job_in(const test::Scratch& scratch, double cells) {
    MeshJob job;
    job.surfaces = {scratch / "in.stl"};
    job.output = scratch / "out.vtu";
    job.report = scratch / "out.json";
    job.checkpoint = scratch / "state";
    job.options.refine.target_cells = cells;
    return job;
}

void write_input(const test::Scratch& scratch, const TriangleSoup& soup) {
    Context context(1);
    REQUIRE(write_surface(scratch / "in.stl", soup, {}, context));
}

/// The bytes of every state that a run leaves on disk, as a kill just after would leave them.
std::vector<std::string> collect_states(const MeshJob& job) {
    std::vector<std::string> states;
    Context context(2);
    context.set_progress_sink([&](std::string_view, double, std::string_view) {
        const std::string bytes = test::slurp(job.checkpoint / "mesh.checkpoint");
        if (!bytes.empty() && (states.empty() || states.back() != bytes)) states.push_back(bytes);
    });
    const auto result = run_mesh_job(job, context);
    INFO((result ? "" : result.error().one_line()));
    REQUIRE(result);
    return states;
}

/// Reports of two runs agree in all but what hangs on the clock and on being resumed.
nlohmann::json without_times(const fs::path& report) {
    auto json = nlohmann::json::parse(test::slurp(report));
    for (const char* key : {"stages", "resumed_at"}) json.erase(key);
    if (json["optimizer"].is_object()) json["optimizer"].erase("seconds");
    return json;
}

/// Goes on with each state; the phases that they were in.
std::vector<std::string> resume_all(MeshJob job, const std::vector<std::string>& states) {
    const std::string mesh = test::slurp(job.output);
    const auto report = without_times(job.report);
    std::vector<std::string> phases;
    job.resume = true;
    for (const std::string& state : states) {
        fs::remove(job.output);
        test::spill(job.checkpoint / "mesh.checkpoint", state);
        Context context(1 + static_cast<int>(phases.size() % 2));
        const auto result = run_mesh_job(job, context);
        INFO((result ? "" : result.error().one_line()));
        REQUIRE(result);
        CHECK(test::slurp(job.output) == mesh);
        CHECK_FALSE(fs::exists(job.checkpoint / "mesh.checkpoint"));
        phases.push_back(result->outcome.resumed);
        CHECK(nlohmann::json::parse(test::slurp(job.report))["resumed_at"] == phases.back());
        CHECK(nlohmann::json::diff(without_times(job.report), report).empty());
    }
    return phases;
}

void renew_checksum(std::string& bytes) {
    const std::size_t end = bytes.size() - 4;
    const auto sum =
        static_cast<std::uint32_t>(crc32_z(0, reinterpret_cast<const unsigned char*>(bytes.data()), end));
    std::memcpy(bytes.data() + end, &sum, 4);
}

} // namespace

TEST_CASE("checkpoint: a run goes on from every state to the same bytes") {
    const test::Scratch scratch;
    write_input(scratch, cube(2));
    const MeshJob job = job_in(scratch, 800);
    const auto states = collect_states(job);
    CHECK_FALSE(fs::exists(job.checkpoint / "mesh.checkpoint"));
    CHECK(resume_all(job, states) == std::vector<std::string>{"refined", "fitted", "attempted", "settled"});
}

TEST_CASE("checkpoint: with repairs and a mesh to settle", "[slow]") {
    const test::Scratch scratch;
    Context context(1);
    const auto wing = make_geometry("wing", {}, context);
    REQUIRE(wing);
    write_input(scratch, *wing);
    MeshJob job = job_in(scratch, 0);
    job.options.refine.surface.size = 10;
    job.options.repairs = 1;
    const auto states = collect_states(job);
    const auto report = without_times(job.report);
    REQUIRE(report["attempts"].size() == 2);
    REQUIRE(report["backed_off"]["retreat"]["attempts"] > 0);
    CHECK(resume_all(job, states) ==
          std::vector<std::string>{"refined", "fitted", "refined", "fitted", "attempted", "settled"});
}

TEST_CASE("checkpoint: features that were cut") {
    const test::Scratch scratch;
    write_input(scratch, test::tapered_chamfer());
    MeshJob job = job_in(scratch, 3000);
    job.options.features.feature_angle_deg = 20;
    const auto states = collect_states(job);
    const auto report = without_times(job.report);
    REQUIRE(report["fit"]["narrow_curves"].size() == 1);
    CHECK(report["quality_after"]["scaled_jacobian"]["min"] > 0.2);
    CHECK(resume_all(job, states).size() >= 4);
}

TEST_CASE("checkpoint: planar rounds") {
    const test::Scratch scratch;
    test::spill(scratch / "in.dat", "kite\n0 0\n1 0.2\n2 1\n0.3 0.9\n");
    MeshJob job = job_in(scratch, 500);
    job.surfaces = {scratch / "in.dat"};
    const auto states = collect_states(job);
    REQUIRE_FALSE(states.empty());
    CHECK(resume_all(job, states) == std::vector<std::string>(states.size(), "refined"));
}

TEST_CASE("checkpoint: slabs across other axes and turned ones") {
    const test::Scratch scratch;
    const TriangleSoup plate =
        geometry::make_box(Point(0), Point(1, 0.7, 0.02), {"west", "east", "south", "north", "down", "up"});
    for (const TriangleSoup& soup :
         {test::permuted(plate, 1), test::rounded(test::turned(plate, {20, 30, 40}, Point(0)))}) {
        write_input(scratch, soup);
        const MeshJob job = job_in(scratch, 500);
        const auto states = collect_states(job);
        REQUIRE_FALSE(states.empty());
        CHECK(nlohmann::json::parse(test::slurp(job.report))["planar"].is_object());
        CHECK(resume_all(job, states) == std::vector<std::string>(states.size(), "refined"));
    }
}

TEST_CASE("checkpoint: a cancelled run keeps its state, and an earlier run's is not lost") {
    const test::Scratch scratch;
    write_input(scratch, cube(2));
    MeshJob job = job_in(scratch, 800);
    Context whole(1);
    REQUIRE(run_mesh_job(job, whole));
    const std::string mesh = test::slurp(job.output);
    fs::remove(job.output);

    Context cancelled(1);
    cancelled.set_progress_sink([&](std::string_view stage, double, std::string_view) {
        if (stage == "optimize") cancelled.cancel();
    });
    const auto interrupted = run_mesh_job(job, cancelled);
    REQUIRE(interrupted);
    CHECK(interrupted->outcome.verdict == ErrorCode::cancelled);
    CHECK(fs::exists(job.checkpoint / "mesh.checkpoint"));

    Context again(1);
    const auto anew = run_mesh_job(job, again);
    REQUIRE_FALSE(anew);
    CHECK(anew.error().code == ErrorCode::usage);
    CHECK(anew.error().one_line().find("--resume") != std::string::npos);

    job.resume = true;
    const auto resumed = run_mesh_job(job, again);
    REQUIRE(resumed);
    CHECK(resumed->outcome.resumed == "fitted");
    CHECK(test::slurp(job.output) == mesh);
}

TEST_CASE("checkpoint: another run's is refused, and what differs is named") {
    const test::Scratch scratch;
    write_input(scratch, cube(2));
    const MeshJob job = job_in(scratch, 800);
    const auto states = collect_states(job);
    const auto refusal = [&](const auto& change, int seed = 1) {
        MeshJob changed = job;
        changed.resume = true;
        change(changed);
        test::spill(job.checkpoint / "mesh.checkpoint", states.front());
        Context context(1, static_cast<std::uint64_t>(seed));
        const auto result = run_mesh_job(changed, context);
        REQUIRE_FALSE(result);
        CHECK(test::slurp(job.checkpoint / "mesh.checkpoint") == states.front());
        return result.error();
    };
    const auto names = [](const Error& error, const std::string& text) {
        INFO(error.one_line());
        return error.code == ErrorCode::usage && error.one_line().find(text) != std::string::npos;
    };
    CHECK(names(refusal([](MeshJob& j) { j.options.refine.target_cells = 900; }),
                "refine.cells was 800 and is 900"));
    CHECK(names(refusal([](MeshJob& j) {
                    j.options.refine.patches = {{"up", {0.1, -1}}};
                }),
                "patches.up was not given and is size 0.1"));
    CHECK(names(refusal([](MeshJob&) {}, 7), "seed was 1 and is 7"));
    CHECK(names(refusal([](MeshJob& j) { j.checkpoint.clear(); }), "--checkpoint"));
    CHECK(refusal([&](MeshJob& j) { j.checkpoint = scratch / "none"; }).code == ErrorCode::bad_input);
    write_input(scratch, cube(2.5));
    CHECK(names(refusal([](MeshJob&) {}), "surface 1 was in.stl"));
    write_input(scratch, cube(2));
    // The output does not count: it may be written elsewhere, in another format.
    MeshJob moved = job;
    moved.resume = true;
    moved.output = scratch / "out.vtk";
    moved.write.encoding = Encoding::text;
    Context context(1);
    CHECK(run_mesh_job(moved, context));
}

TEST_CASE("checkpoint: damaged and hostile files are refused") {
    const test::Scratch scratch;
    write_input(scratch, cube(2));
    MeshJob job = job_in(scratch, 800);
    const auto states = collect_states(job);
    job.resume = true;
    Context context(1);
    const auto refused = [&](const std::string& bytes) {
        test::spill(job.checkpoint / "mesh.checkpoint", bytes);
        const auto result = run_mesh_job(job, context);
        return !result && result.error().code == ErrorCode::bad_input;
    };
    const std::string& good = states.back();
    Random random(3);
    CHECK(refused(""));
    CHECK(refused("hexopt-gpu checkpoint\n"));
    CHECK(refused(good + "x"));
    for (int i = 0; i < 40; ++i) {
        CHECK(refused(good.substr(0, random.below(good.size()))));
        std::string flipped = good;
        flipped[random.below(good.size())] ^= static_cast<char>(1 << random.below(8));
        CHECK(refused(flipped));
    }
    std::string newer = good;
    ++newer[std::string("hexopt-gpu checkpoint\n").size()];
    CHECK(refused(newer));
}

TEST_CASE("checkpoint: no bytes with a right checksum make the reader read beyond them or crash") {
    const test::Scratch scratch;
    write_input(scratch, cube(2));
    const MeshJob job = job_in(scratch, 800);
    const auto states = collect_states(job);
    Context context(1);
    StageClock clock;
    const auto prepared = prepare_domain(cube(2), job.options, clock, context);
    REQUIRE(prepared);
    Random random(5);
    std::size_t read = 0, refused = 0;
    for (const std::string& good : states)
        for (int i = 0; i < 100; ++i) {
            std::string bytes = good;
            const std::size_t begin = 40, at = begin + random.below(bytes.size() - begin - 12);
            if (i % 3 == 0)
                bytes[at] = static_cast<char>(random.below(256));
            else if (i % 3 == 1)
                bytes.erase(at, 1 + random.below(9));
            else
                for (int k = 0; k < 8; ++k) bytes[at + static_cast<std::size_t>(k)] = i % 2 ? '\xff' : '\0';
            renew_checksum(bytes);
            test::spill(scratch / "mutant", bytes);
            const auto file = ArchiveFile::open(scratch / "mutant", "checkpoint", kCheckpointFormat, context);
            if (!file) continue;
            ArchiveReader reader = file->reader();
            RunIdentity identity;
            reader(identity);
            std::vector<StageTime> times;
            const auto state = read_state(reader, prepared->domain, times, context);
            ++(state ? read : refused);
            if (!state) CHECK_FALSE(state.error().one_line().empty());
        }
    CHECK(refused > 40); // where a digit of a position changed there is nothing to refuse
    CHECK(read > 0);
}
