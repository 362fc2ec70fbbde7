#include "io/mesh_io.hpp"
#include "io/scratch.hpp"
#include "support/skip.hpp"

#include <sstream>

using namespace hexopt;
namespace fs = std::filesystem;

namespace {

/// Counts found by splitting the text at white space: nothing of the readers is used.
std::size_t number_after(const std::string& text, const std::string& word) {
    std::istringstream stream(text);
    std::string token;
    std::size_t number = 0;
    while (stream >> token)
        if (token == word) stream >> number;
    return number;
}

} // namespace

TEST_CASE("the real meshes are read whole") {
    const fs::path folder = fs::path(HEXOPT_SHARED_DATA) / "hexmeshes";
    if (!fs::exists(folder)) {
        HEXOPT_SKIP(folder.string() + " is absent");
    }
    std::size_t meshes = 0;
    for (const auto& entry : fs::directory_iterator(folder)) {
        const bool is_vtk = entry.path().extension() == ".vtk";
        if (!is_vtk && entry.path().extension() != ".mesh") continue;
        ++meshes;
        INFO(entry.path());
        Context context(1);
        std::size_t warnings = 0;
        context.set_log_sink(
            [&](LogLevel level, std::string_view) { warnings += level >= LogLevel::warning; });
        const auto mesh = read_mesh(entry.path(), context);
        INFO((mesh ? "" : mesh.error().one_line()));
        REQUIRE(mesh);
        const std::string text = test::slurp(entry.path());
        CHECK(mesh->vertex_count() == number_after(text, is_vtk ? "POINTS" : "Vertices"));
        CHECK(mesh->cell_count() == number_after(text, is_vtk ? "CELLS" : "Hexahedra"));
        CHECK(warnings == 0);
    }
    CHECK(meshes == 21);
}
