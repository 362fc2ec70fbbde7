// The command line's `render`: pictures and exit codes.
#include "io/scratch.hpp"

#include <catch2/catch.hpp>
#include <cstdlib>
#include <fstream>
#include <sys/wait.h>

using namespace hexopt::test;

namespace {

int run(const std::string& arguments, const char* command = "render ") {
    const std::string line = HEXOPT_BINARY_DIR "/bin/hexopt-gpu " + std::string(command) + arguments;
    const int status = std::system((line + " > /dev/null 2>&1").c_str());
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

std::string write_cube(const std::string& file) {
    std::ofstream(file)
        << "MeshVersionFormatted 1\nDimension 3\nVertices\n8\n0 0 0 0\n1 0 0 0\n1 1 0 0\n0 1 0 0\n"
           "0 0 1 0\n1 0 1 0\n1 1 1 0\n0 1 1 0\nHexahedra\n1\n1 2 3 4 5 6 7 8 0\nEnd\n";
    return file;
}

} // namespace

TEST_CASE("the render command draws and refuses") {
    const Scratch folder;
    const std::string mesh = write_cube((folder / "cube.mesh").string()), png = (folder / "a.png").string();
    const std::string base = mesh + " -o " + png;
    CHECK(run(base + " --size 200x100") == 0);
    CHECK(slurp(png).substr(1, 3) == "PNG");
    CHECK(run(base + " --size 128x128 --clip=-x=0.25 --clip y=0.75 --view 20,-30 --color none") == 0);
    CHECK(run(base + " --size 128x128 --clip -x=0.25 --worst 1 --view -z") == 0);
    CHECK(run(base + " --color sparkle") == 2);
    CHECK(run(base + " --color patch") == 2);
    CHECK(run(base + " --patches wall") == 2);
    CHECK(run(base + " --without-box") == 2);
    CHECK(run(base + " --without-box --worst 1") == 2);
    CHECK(run(base + " --clip q=1") == 2);
    CHECK(run(base + " --view up") == 2);
    CHECK(run(base + " --size 1x1") == 2);
    CHECK(run(base + " --worst 0") == 2);
    CHECK(run(mesh) == 2);
    CHECK(run((folder / "missing.mesh").string() + " -o " + png) == 3);
    CHECK(run(mesh + " -o /no/such/folder/a.png") == 4);
}

TEST_CASE("the report command makes a page of what quality wrote") {
    const Scratch folder;
    const std::string mesh = write_cube((folder / "cube.mesh").string());
    const std::string json = (folder / "q.json").string(), page = (folder / "q.html").string();
    REQUIRE(run(mesh + " --json " + json, "quality ") == 0);
    CHECK(run(json + " -o " + page, "report ") == 0);
    const std::string html = slurp(page);
    CHECK(html.find("data:image/png;base64,iVBOR") != std::string::npos);
    CHECK(html.find("cube.mesh") != std::string::npos);
    std::filesystem::remove(mesh);
    CHECK(run(json + " -o " + page, "report ") == 3);
    CHECK(run(json + " --no-pictures -o " + page, "report ") == 0);
    CHECK(slurp(page).find("<img") == std::string::npos);
    std::ofstream(json) << "{\"broken\": ";
    CHECK(run(json + " -o " + page, "report ") == 3);
    CHECK(run(json, "report ") == 2);
}
