// The command line's `quality`: exit codes, JSON, text.
#include "io/scratch.hpp"

#include <catch2/catch.hpp>
#include <cstdlib>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string>
#include <sys/wait.h>

using namespace hexopt::test;

namespace {

int run(const std::string& arguments) {
    const int status = std::system((HEXOPT_BINARY_DIR "/bin/hexopt-gpu quality " + arguments).c_str());
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

/// A cube whose vertex 6 is at (x, x, x).
std::string write_cube(const std::string& file, double x) {
    std::ofstream(file)
        << "MeshVersionFormatted 1\nDimension 3\nVertices\n8\n0 0 0 0\n1 0 0 0\n1 1 0 0\n0 1 0 0\n"
        << "0 0 1 0\n1 0 1 0\n"
        << x << ' ' << x << ' ' << x << " 0\n0 1 1 0\nHexahedra\n1\n1 2 3 4 5 6 7 8 0\nEnd\n";
    return file;
}

} // namespace

TEST_CASE("the quality command reports and judges") {
    const Scratch folder;
    const auto file = [&](const char* name) { return (folder / name).string(); };
    const std::string good = write_cube(file("good.mesh"), 1), bad = write_cube(file("bad.mesh"), 0.2);
    const std::string out = file("out.txt"), json = file("q.json"), quiet = " > " + out + " 2>&1";
    CHECK(run(good + quiet) == 0);
    CHECK(slurp(out).find("every cell is valid") != std::string::npos);
    CHECK(run(good + " --require-valid --min-sj 0.999" + quiet) == 0);
    CHECK(run(bad + " --json " + json + quiet) == 0);
    CHECK(slurp(out).find("NOT VALID") != std::string::npos);
    const nlohmann::json report = nlohmann::json::parse(slurp(json));
    CHECK(report["cells"] == 1);
    CHECK(report["validity"]["concave8"] == 1);
    CHECK(report["worst_cells"].size() == 1);
    CHECK(run(bad + " --require-valid" + quiet) == 5);
    CHECK(run(bad + " --min-sj 0.5" + quiet) == 9);
    CHECK(slurp(out).find("cell 0") != std::string::npos);
    CHECK(run(bad + " --worst 0 --quiet --json " + json + quiet) == 0);
    CHECK(slurp(out).empty());
    CHECK(nlohmann::json::parse(slurp(json))["worst_cells"].empty());
    CHECK(run(file("missing.mesh") + quiet) == 3);
    CHECK(run(good + " --json " + file("no/such/folder.json") + quiet) == 4);
    CHECK(run(good + " --worst -1" + quiet) == 2);
    CHECK(run(quiet) == 2);
}
